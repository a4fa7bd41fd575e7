"""Folders graded side by side, each in a process: rubric tests and benchmarks do so."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.errors import GraderError
from grader.model.progress import Silence, StepState
from grader.model.result import GradingResult
from grader.model.sandbox_mode import SandboxMode
from grader.pipeline import GradeOptions, grade, prepare
from grader.rubric.load import load_rubric
from grader.workers import WorkerEnded, run_each


@dataclass(frozen=True, kw_only=True)
class Job:
    """One grading: the submission in `source`, as `name`, into `out/name/`. `rubric` is its file."""

    name: str
    source: Path
    rubric: Path
    out: Path
    sandbox: SandboxMode = "auto"


@dataclass(frozen=True, kw_only=True)
class Graded:
    """A grading's result, or in one line why there is none. `again` is how many of its runs were made again."""

    name: str
    result: GradingResult | None
    error: str = ""
    again: int = 0


def grade_all(jobs: Sequence[Job], most: int, begun: Callable[[str], None]) -> Iterator[Graded]:
    """Yield each job's result as it comes, `most` at a time. `begun` gets each job's name when it starts."""
    for sandbox in {job.sandbox for job in jobs}:
        prepare(GradeOptions(sandbox=sandbox))
    return run_each(_grade, jobs, min(most, len(jobs)), ended=_ended, begun=lambda job: begun(job.name))


def _ended(job: Job, error: WorkerEnded) -> Graded:
    return Graded(name=job.name, result=None, error=f"the process that graded it {error.reason}")


def _grade(job: Job) -> Graded:
    options, steps = GradeOptions(sandbox=job.sandbox, submission_id=job.name), _Steps()
    try:
        result = grade(str(job.source), load_rubric(str(job.rubric)), job.out, options, steps)
    except GraderError as error:
        return Graded(name=job.name, result=None, error=error.message)
    return Graded(name=job.name, result=result, again=steps.again)


class _Steps(Silence):
    """Counts how often each was done."""

    def __init__(self) -> None:
        self._done: Counter[str] = Counter()

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        del detail, expected_s
        if state == "done":
            self._done[name] += 1

    @property
    def again(self) -> int:
        return self._done.total() - len(self._done)
