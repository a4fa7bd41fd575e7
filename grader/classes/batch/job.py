"""One submission of a class: its `GradingJob`, how it is fetched and graded, and its `SubmissionOutcome`.

An executor does many jobs: `LocalExecutor` with processes of this machine, `classes.cluster` with other machines.
`grade_all` grades folders side by side without a class, for rubric tests and benchmarks.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache, partial
from pathlib import Path
from typing import Literal, Protocol

from pydantic import Field

from grader import __version__
from grader.classes.fetching.history import NothingInTime, Rule
from grader.classes.fetching.obtain import Obtained, obtain
from grader.errors import GraderError, SubmissionError, UsageError
from grader.faults import GradingContext, classify_errors, fault_of
from grader.files import temporary_folder
from grader.intake.credentials import without_password
from grader.intake.names import safe_name
from grader.judging.settle import settle
from grader.judging.summary import NOTHING_RUN, passed
from grader.model import SandboxMode
from grader.model.batch import Entry
from grader.model.record import Record
from grader.model.result import NO_TIME, GradingResult, HandedIn, Override, Silence, StepState, SubmissionInfo
from grader.pipeline import GradeOptions, grade, provide_base_workspace
from grader.rubric.load import LoadedRubric, load_rubric
from grader.workers import WorkerEnded, run_each

OutcomeStatus = Literal["graded", "inconclusive", "error"]
WARM_UP = "grader.pipeline:preload_worker"
KILLED_HINT = "check whether this machine has too little memory, then grade it again with --only"


class GradingJob(Record):
    """One submission's grading into `out/<id>/`. It can be sent to another process, and to another machine.

    `before` is the time before which the commit that counts is looked for (`--before`), `overrides` map criteria to
    what a person decided. `earlier` is the result of an earlier batch: if it is complete for the same commit, rubric
    and grader, nothing is done, unless `again`. `commit` of a repository is graded, whatever else is said.
    What was fetched after `fetched_since` (seconds since 1970) is not fetched again.
    """

    entry: Entry
    rubric: LoadedRubric
    out: Path
    sandbox: SandboxMode = "auto"
    static_only: bool = False
    before: datetime | None = None
    overrides: Mapping[str, Override] = Field(default_factory=dict)
    earlier: GradingResult | None = None
    again: bool = False
    commit: str | None = None
    fetched_since: float = 0.0


class SubmissionOutcome(Record):
    """What became of a job, in short: the rest is in its folder.

    `kept`: the earlier result stays. `handed_in` is the submission's time, None if it could not be found out. `message`
    and `hint` say on one line each why there is no result, or why the earlier one stays.
    """

    id: str
    status: OutcomeStatus
    points: float = 0.0
    max_points: float = 0.0
    passed: bool = False
    kept: bool = False
    handed_in: HandedIn | None = None
    kind: str = ""
    message: str = ""
    hint: str = ""
    wall_s: float = 0.0


class Executor(Protocol):
    """Does many jobs at a time."""

    def run(self, jobs: Iterable[GradingJob], *, begun: Callable[[str], None]) -> Iterator[SubmissionOutcome]:
        """Yield each job's outcome as it comes. Jobs are taken when they can be started; `begun` gets the id of each.

        There is an outcome for every job, whatever happens to it. When the caller stops iterating, running jobs are
        interrupted and have cleaned up on return.
        """
        ...


class LocalExecutor:
    """`count` processes of this machine, each of which does one job at a time."""

    def __init__(self, count: int) -> None:
        self.count = count

    def run(self, jobs: Iterable[GradingJob], *, begun: Callable[[str], None]) -> Iterator[SubmissionOutcome]:
        """See `Executor.run`."""
        return run_each(
            grade_job,
            jobs,
            self.count,
            ended=outcome_of_ended,
            begun=lambda job: begun(job.entry.id),
            warm_up=WARM_UP,
        )


def failed_outcome(job: GradingJob, *, kind: str, message: str, hint: str) -> SubmissionOutcome:
    """Return the outcome of a job that could not be done."""
    most = job.rubric.rubric.max_points
    return SubmissionOutcome(
        id=job.entry.id, status="error", max_points=most, kind=kind, message=message, hint=hint
    )


def outcome_of_ended(job: GradingJob, error: WorkerEnded) -> SubmissionOutcome:
    """Return the outcome of a job whose process ended, with kind `killed` or `interrupted`."""
    if error.interrupted:
        return failed_outcome(job, kind="interrupted", message="interrupted", hint="")
    message = f"the process that graded it {error.reason}"
    return failed_outcome(job, kind="killed", message=message, hint=KILLED_HINT)


def grade_job(job: GradingJob) -> SubmissionOutcome:
    """Fetch and grade the job's submission into `job.out/<its id>/`, unless that has been done already.

    Raises KeyboardInterrupt, and nothing else.
    """
    begun = time.monotonic()
    try:
        with temporary_folder("fetch") as folder:
            outcome = _grade(job, folder)
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are graded
        fault = fault_of(error)
        outcome = failed_outcome(job, kind=fault.kind, message=fault.message, hint=fault.note or fault.hint)
    return outcome.model_copy(update={"wall_s": round(time.monotonic() - begun, 3)})


def _grade(job: GradingJob, folder: Path) -> SubmissionOutcome:
    try:
        obtained = _fetch(job, folder)
    except Exception as error:
        fault = fault_of(error)
        # it could be fetched then, so that it cannot be now is no fault of the submission
        if job.earlier is not None and job.earlier.status != "error" and not isinstance(fault, NothingInTime):
            return _outcome(job, job.earlier, kept=True, fault=fault)
        with classify_errors(_attempt(job)):
            raise

    def settle_result(result: GradingResult) -> GradingResult:
        before = job.earlier.overrides if job.earlier else ()
        named = result.submission.model_copy(update={"name": job.entry.name})
        result = result.model_copy(update={"submission": named})
        return settle(
            result, job.rubric.rubric, overrides=job.overrides, handed_in=obtained.handed_in, before=before
        )

    options = GradeOptions(
        sandbox=job.sandbox,
        submission_id=safe_name(job.entry.id),
        package=job.entry.package,
        static_only=job.static_only,
        tidy=False,
        find_earlier=partial(_find_complete, job),
        settle=settle_result,
    )
    result = grade(obtained.source, job.rubric, job.out, options, Silence())
    return _outcome(job, result, kept=result is job.earlier, handed_in=obtained.handed_in)


def _fetch(job: GradingJob, folder: Path) -> Obtained:
    """Return what is to be graded. A missing source is the submission's fault here, not the command line's."""
    rubric = job.rubric.rubric
    rule = Rule(
        deadline=rubric.deadline,
        late=rubric.late is not None,
        cut_off_days=rubric.late.cut_off_days if rubric.late else None,
        before=job.before,
    )
    try:
        return obtain(job.entry, rule, workdir=folder, fetched_since=job.fetched_since, commit=job.commit)
    except UsageError as error:
        raise SubmissionError(error.message, hint=error.hint) from error


def _attempt(job: GradingJob) -> GradingContext:
    """Return what the result of a submission that could not be fetched says."""
    about = SubmissionInfo.unopened(safe_name(job.entry.id), without_password(job.entry.source))
    return GradingContext(
        source=about.source,
        submission_id=about.id,
        rubric=job.rubric,
        out=job.out,
        keep_hidden=True,
        timing=lambda: NO_TIME,
        submission=about,
    )


def _find_complete(job: GradingJob, about: SubmissionInfo) -> GradingResult | None:
    """Return the earlier result if it is complete for the same commit, content, rubric and grader."""
    earlier = job.earlier
    if earlier is None or earlier.status == "error" or job.again:
        return None
    static = earlier.environment.sandbox == NOTHING_RUN
    is_same = (
        (earlier.submission.commit, earlier.submission.digest) == (about.commit, about.digest)
        and earlier.rubric.digest == job.rubric.digest
        and earlier.environment.grader == __version__
        # what was judged from the files alone is not enough for a batch that runs scenarios
        and (job.static_only or not static or not job.rubric.rubric.scenarios)
    )
    return earlier if is_same else None


def _outcome(
    job: GradingJob,
    result: GradingResult,
    *,
    kept: bool,
    handed_in: HandedIn | None = None,
    fault: GraderError | None = None,
) -> SubmissionOutcome:
    error = fault or result.error
    message = error.message if error else ""
    return SubmissionOutcome(
        id=job.entry.id,
        status=result.status,
        points=result.points,
        max_points=result.max_points,
        passed=passed(job.rubric.rubric, result),
        kept=kept,
        handed_in=handed_in,
        kind=error.kind if error else "",
        message=f"{message}; the earlier result stays" if fault else message,
        hint=error.hint if error else "",
    )


@dataclass(frozen=True, kw_only=True)
class FolderJob:
    """One grading: the submission in `source`, as `name`, into `out/name/`. `rubric` is its file."""

    name: str
    source: Path
    rubric: Path
    out: Path
    sandbox: SandboxMode = "auto"


@dataclass(frozen=True, kw_only=True)
class GradedSubmission:
    """A grading's result, or on one line why there is none. `again` is how many of its runs were made again."""

    name: str
    result: GradingResult | None
    error: str = ""
    again: int = 0


def grade_all(
    jobs: Sequence[FolderJob], most: int, begun: Callable[[str], None]
) -> Iterator[GradedSubmission]:
    """Yield each job's result as it comes, `most` at a time. `begun` gets each job's name when it starts."""
    for sandbox in {job.sandbox for job in jobs}:
        provide_base_workspace(GradeOptions(sandbox=sandbox))
    return run_each(
        _grade_folder,
        jobs,
        min(most, len(jobs)),
        ended=lambda job, error: GradedSubmission(
            name=job.name, result=None, error=f"the process that graded it {error.reason}"
        ),
        begun=lambda job: begun(job.name),
        warm_up=WARM_UP,
    )


def _grade_folder(job: FolderJob) -> GradedSubmission:
    options, steps = GradeOptions(sandbox=job.sandbox, submission_id=job.name), _Steps()
    try:
        result = grade(str(job.source), _load_once(str(job.rubric)), job.out, options, steps)
    except GraderError as error:
        return GradedSubmission(name=job.name, result=None, error=error.message)
    return GradedSubmission(name=job.name, result=result, again=steps.again)


_load_once = lru_cache(maxsize=8)(load_rubric)
"""In a worker, which lives for the jobs of one `grade_all`."""


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
