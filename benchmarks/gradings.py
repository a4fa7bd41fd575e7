"""Many gradings, as a batch makes them."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figures import NotMeasured, Options
from grader.batch.workers import Graded, Job, grade_all
from grader.evidence.reader import load_evidence
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(__file__).resolve().parent / "data"
LAB = "leeds-comp3631-lab1"
RUBRIC = ROOT / "rubrics" / f"{LAB}.yaml"
SOLUTION = ROOT / "reference_solutions" / LAB
FIXTURES = ROOT / "fixtures" / LAB
LAB_POINTS = 100
KINDS = {
    "reference": SOLUTION,
    "counter-resets-to-1": FIXTURES / "counter-resets-to-1",
    "chatter-5hz": FIXTURES / "chatter-5hz",
    "listener-silent": FIXTURES / "listener-silent",
}
"""A correct submission, a counter that starts again wrongly, a wrong rate, a listener that prints nothing."""

Verdicts = dict[str, tuple[Status, float]]
"""Status and points of each criterion."""


def cores() -> int:
    return len(os.sched_getaffinity(0))


@contextmanager
def folder_for(name: str, options: Options) -> Iterator[Path]:
    """Where results go: a temporary folder, or the one that is kept."""
    if options.keep is not None:
        kept = Path(options.keep).resolve() / name
        kept.mkdir(parents=True, exist_ok=True)
        yield kept
        return
    with tempfile.TemporaryDirectory(prefix="benchmark-") as folder:
        yield Path(folder)


def graded(jobs: Sequence[Job], side_by_side: int) -> Iterator[tuple[str, GradingResult]]:
    """Each result as it comes. Raises NotMeasured where there is none."""
    for number, one in enumerate(grade_all(jobs, side_by_side, lambda _: None), 1):
        print(f"\r{number} of {len(jobs)} graded", end="", file=sys.stderr, flush=True)
        yield one.name, _result(one)
    print(file=sys.stderr)


def verdicts_of(criteria: Sequence[CriterionResult]) -> Verdicts:
    return {criterion.id: (criterion.status, criterion.points) for criterion in criteria}


def build_cpu_s(evidence: Path) -> float:
    """CPU seconds of the build, by the arena's own accounting."""
    events = [event for _, event in load_evidence([evidence / "package.mcap"])["package"].processes]
    return sum(event.cpu_s or 0.0 for event in events if event.role == "build" and event.event == "exit")


def _result(one: Graded) -> GradingResult:
    if one.result is None:
        raise NotMeasured(f"{one.name} was not graded: {one.error}")
    return one.result
