"""One job: the roster's entry is fetched and graded, unless that has been done already."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

from grader import __version__
from grader.classes.batch.job import Job, Outcome
from grader.classes.fetching import NothingInTime, Obtained, Rule, obtain
from grader.errors import GraderError, SubmissionError, UsageError
from grader.faults import NOTHING_RUN, GradingContext, classify_errors, fault_of
from grader.files import temporary_folder
from grader.intake import safe_name, without_password
from grader.judging.settle import settle
from grader.judging.summary import passed
from grader.model.progress import Silence
from grader.model.result import NO_TIME, GradingResult, HandedIn, SubmissionInfo
from grader.pipeline import GradeOptions, grade
from grader.rubric.model import Rubric


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
        with classify_errors(_context(job)):
            raise
    options = GradeOptions(
        sandbox=job.sandbox,
        submission_id=safe_name(job.entry.id),
        static_only=job.static_only,
        tidy=False,
        find_earlier=partial(_find_earlier, job),
        settle=partial(_settle, job, obtained.handed_in),
    )
    result = grade(obtained.source, job.rubric, job.out, options, Silence())
    return _outcome(job, result, kept=result is job.earlier, handed_in=obtained.handed_in)


def _context(job: Job) -> GradingContext:
    """For the result of what could not be fetched."""
    submission = SubmissionInfo(
        id=safe_name(job.entry.id),
        source=without_password(job.entry.source),
        commit=None,
        digest="",
        package="",
    )
    return GradingContext(
        source=submission.source,
        submission_id=submission.id,
        rubric=job.rubric,
        out=job.out,
        keep_hidden=True,
        timing=lambda: NO_TIME,
        submission=submission,
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


def _find_earlier(job: Job, about: SubmissionInfo) -> GradingResult | None:
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


def _settle(job: Job, handed_in: HandedIn, result: GradingResult) -> GradingResult:
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
