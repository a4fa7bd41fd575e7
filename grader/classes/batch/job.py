"""What a batch hands to whoever grades one submission, and what comes back."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from datetime import datetime
from functools import partial
from itertools import islice
from pathlib import Path
from queue import SimpleQueue
from typing import Literal, Protocol

from pydantic import Field

from grader import __version__
from grader.classes.fetching import NothingInTime, Obtained, Rule, obtain
from grader.errors import GraderError, SubmissionError, UsageError
from grader.faults import NOTHING_RUN, Attempt, fault_of, told_apart
from grader.intake import safe_name, without_password
from grader.judging.settle import settle
from grader.judging.summary import passed
from grader.model.progress import Silence
from grader.model.record import Record
from grader.model.result import GradingResult, SubmissionInfo, TimingInfo
from grader.model.roster import Entry
from grader.model.submission_time import HandedIn, Override
from grader.pipeline import GradeOptions, grade
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric
from grader.temporary import temporary_folder
from grader.workers import Child

Sandbox = Literal["auto", "require", "none"]
OutcomeStatus = Literal["graded", "inconclusive", "error"]


class Job(Record):
    """One submission's grading into `out/<id>/`. It can be sent to another process, and to another machine.

    `before` is the time before which the commit that counts is looked for (`--before`), `overrides` map criteria to
    what a person decided. `earlier` is the result of an earlier batch: where it is complete for the same commit, rubric
    and grader, nothing is done, unless `again`. `commit` is the one to grade of a repository, whatever else is said.
    What was fetched after `fetched_since` (seconds since 1970) is not fetched again.
    """

    entry: Entry
    rubric: LoadedRubric
    out: Path
    sandbox: Sandbox = "auto"
    static_only: bool = False
    before: datetime | None = None
    overrides: Mapping[str, Override] = Field(default_factory=dict)
    earlier: GradingResult | None = None
    again: bool = False
    commit: str | None = None
    fetched_since: float = 0.0


class Outcome(Record):
    """What became of a job, in short: the rest is in its folder.

    `kept`: the earlier result stays. `handed_in` is what was found out about the submission's time, None where it could
    not be had. `message` and `hint` say in one line each why there is no result, or why the earlier one stays.
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


# [classes.batch.work] One job: the roster's entry is fetched and graded, unless that has been done already.

def work(job: Job) -> Outcome:
    """Grade the job's submission into `job.out/<its id>/`. Raises KeyboardInterrupt, and nothing else."""
    begun = time.monotonic()
    try:
        with temporary_folder("fetch") as folder:
            outcome = _graded(job, folder)
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are graded
        outcome = _failed(job, fault_of(error))
    return outcome.model_copy(update={"wall_s": round(time.monotonic() - begun, 3)})


def _graded(job: Job, folder: Path) -> Outcome:
    try:
        obtained = _fetched(job, folder)
    except Exception as error:
        fault = fault_of(error)
        if job.earlier is not None and job.earlier.status != "error" and not isinstance(fault, NothingInTime):
            return _outcome(job, job.earlier, kept=True, because=fault)
        with told_apart(_attempt(job)):
            raise
    options = GradeOptions(
        sandbox=job.sandbox,
        submission_id=safe_name(job.entry.id),
        static_only=job.static_only,
        tidy=False,
        kept=partial(_kept, job),
        settled=partial(_settled, job, obtained.handed_in),
    )
    result = grade(obtained.source, job.rubric, job.out, options, Silence())
    return _outcome(job, result, kept=result is job.earlier, handed_in=obtained.handed_in)


def _attempt(job: Job) -> Attempt:
    """For the result of what could not be fetched."""
    about = SubmissionInfo(
        id=safe_name(job.entry.id),
        source=without_password(job.entry.source),
        commit=None,
        digest="",
        package="",
    )
    return Attempt(
        source=about.source,
        submission_id=about.id,
        rubric=job.rubric,
        out=job.out,
        keep_hidden=True,
        timing=lambda: TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0),
        about=about,
    )


def _fetched(job: Job, folder: Path) -> Obtained:
    """A source that is not there is the submission's fault here, not the command line's."""
    try:
        rule = rule_of(job.rubric.rubric, job)
        return obtain(job.entry, rule, workdir=folder, fetched_since=job.fetched_since, commit=job.commit)
    except UsageError as error:
        raise SubmissionError(error.message, hint=error.hint) from error


def rule_of(rubric: Rubric, job: Job) -> Rule:
    """Which commit counts."""
    return Rule(
        deadline=rubric.deadline,
        late=rubric.late is not None,
        cut_off_days=rubric.late.cut_off_days if rubric.late else None,
        before=job.before,
    )


def _kept(job: Job, about: SubmissionInfo) -> GradingResult | None:
    return job.earlier if job.earlier is not None and not job.again and is_done(job, about) else None


def is_done(job: Job, about: SubmissionInfo) -> bool:
    """Whether the earlier result is complete for the same commit, content, rubric and grader."""
    earlier = job.earlier
    if earlier is None or earlier.status == "error":
        return False
    same = (earlier.submission.commit, earlier.submission.digest) == (about.commit, about.digest)
    static = earlier.environment.sandbox == NOTHING_RUN
    return (
        same
        and earlier.rubric.digest == job.rubric.digest
        and earlier.environment.grader == __version__
        and (job.static_only or not static or not job.rubric.rubric.scenarios)
    )


def _settled(job: Job, handed_in: HandedIn, result: GradingResult) -> GradingResult:
    before = job.earlier.overrides if job.earlier else ()
    return settle(result, job.rubric.rubric, overrides=job.overrides, handed_in=handed_in, before=before)


def _outcome(
    job: Job,
    result: GradingResult,
    *,
    kept: bool,
    handed_in: HandedIn | None = None,
    because: GraderError | None = None,
) -> Outcome:
    error = result.error
    return Outcome(
        id=job.entry.id,
        status=result.status,
        points=result.points,
        max_points=result.max_points,
        passed=passed(job.rubric.rubric, result),
        kept=kept,
        handed_in=handed_in,
        kind=because.kind if because else error.kind if error else "",
        message=f"{because.message}; the earlier result stays" if because else error.message if error else "",
        hint=because.hint if because else error.hint if error else "",
    )


def _failed(job: Job, fault: GraderError) -> Outcome:
    return Outcome(
        id=job.entry.id,
        status="error",
        max_points=job.rubric.rubric.max_points,
        kind=fault.kind,
        message=fault.message,
        hint=fault.note or fault.hint,
    )


# [classes.batch.executor] Who does the jobs of a batch: processes of this machine here, a cluster's workers in `grader.classes.cluster`.

class Hands(Protocol):
    """Does jobs, many at a time."""

    def run(self, jobs: Iterable[Job], *, begun: Callable[[str], None]) -> Iterator[Outcome]:
        """Each job's outcome as it comes. Jobs are taken when there are hands for them; `begun` is told of each.

        There is an outcome for every job, whatever happens to it. When the caller stops asking, what runs is
        interrupted and has cleaned up when this returns.
        """
        ...


class Processes:
    """`count` processes of this machine, each of which does one job at a time."""

    def __init__(self, count: int) -> None:
        self.count = max(count, 1)

    def run(self, jobs: Iterable[Job], *, begun: Callable[[str], None]) -> Iterator[Outcome]:
        """As `Hands.run` says."""
        waiting = iter(jobs)
        idle: SimpleQueue[Child] = SimpleQueue()
        children: list[Child] = []
        running: set[Future[Outcome]] = set()
        with ThreadPoolExecutor(self.count) as threads:
            try:
                while True:
                    for job in islice(waiting, self.count - len(running)):
                        if idle.empty() and len(children) < self.count:
                            children.append(Child())
                            idle.put(children[-1])
                        begun(job.entry.id)
                        running.add(threads.submit(_done, idle, job))
                    if not running:
                        break
                    done, running = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        yield future.result()
            finally:
                for child in children:
                    child.interrupt()
                wait(running)
                for child in children:
                    child.close()


def _done(idle: SimpleQueue[Child], job: Job) -> Outcome:
    child = idle.get()
    try:
        return child.do(job)
    finally:
        idle.put(child)
