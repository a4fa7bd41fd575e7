"""Jobs for tests."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from fixtures.make import declared, faulty_package
from grader.classes.batch.job import GradingJob, SubmissionOutcome
from grader.model.batch import Entry
from grader.results import RESULT
from grader.rubric.load import load_rubric

LAB = "leeds-comp3631-lab1"


def sources() -> list[Path]:
    """Packages, right and wrong ones."""
    return [faulty_package(LAB, name) for name in sorted(declared(LAB))]


def jobs_for(
    out: Path, count: int, *, static_only: bool = True, names: Iterable[str] = ()
) -> Iterator[GradingJob]:
    """`count` submissions, made of the fixtures in turn."""
    rubric = load_rubric(LAB)
    chosen = [faulty_package(LAB, name) for name in names] or sources()
    for number in range(count):
        entry = Entry(id=f"s{number:03}", source=str(chosen[number % len(chosen)]))
        yield GradingJob(entry=entry, rubric=rubric, out=out, static_only=static_only)


def named_job(out: Path, name: str) -> GradingJob:
    """One submission of that id."""
    job = next(jobs_for(out, 1))
    return job.model_copy(update={"entry": job.entry.model_copy(update={"id": name})})


def verdicts(out: Path) -> dict[str, list[tuple[str, str, float]]]:
    """What every result in `out` says of each criterion."""
    found = {}
    for path in sorted(out.glob(f"*/{RESULT}")):
        result = json.loads(path.read_text())
        found[path.parent.name] = [(c["id"], c["status"], c["points"]) for c in result["criteria"]]
    return found


def ids(outcomes: Iterable[SubmissionOutcome]) -> list[str]:
    return sorted(outcome.id for outcome in outcomes)


def ignore(_: str) -> None:
    """Take no notice of a submission that begins."""
