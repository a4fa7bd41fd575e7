"""Many gradings, as a batch makes them."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from benchmarks.figures import NotMeasured, Options
from fixtures.make import faulty_package
from grader.classes.batch.job import FolderJob, grade_all
from grader.evidence.reader import load_evidence
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(__file__).resolve().parent / "data"
LAB = "leeds-comp3631-lab1"
RUBRIC = ROOT / "rubrics" / f"{LAB}.yaml"
SOLUTION = ROOT / "reference_solutions" / LAB
FAULTY = ("counter-resets-to-1", "chatter-5hz", "listener-silent")
LAB_POINTS = 100
KINDS = {"reference": SOLUTION, **{name: faulty_package(LAB, name) for name in FAULTY}}
"""A correct submission, a counter that starts again wrongly, a wrong rate, a listener that prints nothing."""


class Grading(NamedTuple):
    """A result, and how many of its runs were made again."""

    name: str
    result: GradingResult
    again: int


Verdicts = dict[str, tuple[Status, float]]
"""Status and points of each criterion."""


def cores() -> int:
    return len(os.sched_getaffinity(0))


def in_flight() -> int:
    """How many gradings keep all cores at work: they wait most of the time."""
    return 4 * cores()


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


def graded(jobs: Sequence[FolderJob], most: int) -> Iterator[Grading]:
    """Each grading as it ends, `most` at a time. Raises NotMeasured where there is no result."""
    for number, one in enumerate(grade_all(jobs, most, lambda _: None), 1):
        print(f"\r{number} of {len(jobs)} graded", end="", file=sys.stderr, flush=True)
        if one.result is None:
            raise NotMeasured(f"{one.name} was not graded: {one.error}")
        yield Grading(one.name, one.result, one.again)
    print(file=sys.stderr)


def verdicts_of(criteria: Sequence[CriterionResult]) -> Verdicts:
    return {criterion.id: (criterion.status, criterion.points) for criterion in criteria}


def uncounted(all_s: float, wall_s: float, results: Iterable[GradingResult]) -> Iterator[str]:
    """Yield why `all_s` cannot be the CPU seconds of all that was run: each grading tells what it knows of itself."""
    told_s = sum(result.timing.cpu_s + result.timing.student_cpu_s for result in results)
    if all_s < told_s:
        yield f"{all_s:.1f} s of CPU were counted, and the gradings themselves tell of {told_s:.1f} s"
    if all_s > wall_s * cores():
        yield f"{all_s:.1f} s of CPU were counted, more than {cores()} cores have in {wall_s:.1f} s"


def build_cpu_s(evidence: Path) -> float:
    """CPU seconds of the build, by the arena's own accounting."""
    events = [event for _, event in load_evidence([evidence / "package.mcap"])["package"].processes]
    return sum(event.cpu_s or 0.0 for event in events if event.role == "build" and event.event == "exit")
