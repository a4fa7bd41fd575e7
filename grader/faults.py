"""Classify what ended a grading: the fault of the submission, the machine or the grader, and a result that says so."""

from __future__ import annotations

import errno
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from grader.errors import (
    Busy,
    EvidenceError,
    GraderError,
    HostError,
    InternalError,
    OutputError,
    OutputLost,
    SubmissionError,
    UsageError,
)
from grader.files import FULL
from grader.intake.source import Source, identify
from grader.judging.summary import assemble_result, environment_info
from grader.model.result import (
    NO_TIME,
    CriterionResult,
    ErrorInfo,
    GradingResult,
    RubricOrigin,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.verdict import Status
from grader.report.files import write_reports
from grader.results import RESULT, Results
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Criterion

MACHINE = FULL | {
    errno.ENOMEM: "there is too little memory",
    errno.EAGAIN: "no more processes can be started",
    errno.EMFILE: "too many files are open (ulimit -n)",
    errno.ENFILE: "too many files are open",
    errno.EROFS: "the disk became read-only",
    errno.ESTALE: "the network disk is gone",
}
AGAIN = "fix that (`grader doctor` checks this machine), then grade again"
NUMBER = re.compile(r"\[Errno (\d+)\]")
# neither is expected in a grading: the evidence is what this grader has just written
UNEXPECTED = {EvidenceError.kind, GraderError.kind}
NO_THREAD = "can't start new thread"
"""What Python says where there is no memory for its stack, or too many run."""
MEMORY = "grade fewer submissions side by side, or on a machine with more memory"
REPORT = "run with --debug for the traceback, and report it; the submission can be graded again"


@dataclass(kw_only=True)
class GradingContext:
    """What is known of a grading while it runs, for the result that says that it failed. `submission` is None until the
    submission is open."""

    source: str | Source
    submission_id: str | None
    rubric: LoadedRubric
    out: Path
    keep_hidden: bool
    timing: Callable[[], TimingInfo]
    submission: SubmissionInfo | None = None
    rubric_origin: RubricOrigin | None = None


@contextmanager
def classify_errors(context: GradingContext) -> Iterator[None]:
    """Turn whatever ends the grading into an error that says whose fault it is, and write a result that says the same.

    Errors of the command line and of the rubric leave no result, and neither does a submission that another grader
    is working on.
    """
    try:
        yield
    except (Exception, SystemExit) as error:  # whatever it is, a submission must not go missing
        fault = fault_of(error)
        if not isinstance(fault, (UsageError, Busy)):
            fault.note = _write_error_result(fault, context)
        if fault is error:
            raise
        raise fault from error


def fault_of(error: BaseException) -> GraderError:
    """Return the error as one of the student's, the machine's or the grader's own."""
    if isinstance(error, MemoryError) or (isinstance(error, RuntimeError) and str(error) == NO_THREAD):
        return HostError("the grader ran out of memory", hint=MEMORY)
    # an OutputError here means that the folder, which was checked at the start, can no longer be written
    if isinstance(error, GraderError) and not isinstance(error, (OutputError, SubmissionError)):
        return error if error.kind not in UNEXPECTED else _internal(error)
    machine = _machine_fault(error)
    if machine is not None:
        return machine
    return error if isinstance(error, SubmissionError) else _internal(error)


def _machine_fault(error: BaseException) -> HostError | None:
    """Return the machine's fault behind an error, at whatever depth; None where the machine is not at fault."""
    cause = error if isinstance(error, OSError) else error.__cause__
    reason = MACHINE.get(_number(cause)) if isinstance(cause, OSError) else None
    if reason and isinstance(error, GraderError):
        more = "" if reason in error.message else f" ({reason})"
        return HostError(f"{error.message}{more}", hint=AGAIN)
    if reason and isinstance(cause, OSError):
        return HostError(f"{reason}: {cause.filename}" if cause.filename else reason, hint=AGAIN)
    if isinstance(error, OutputError):
        return OutputLost(error.message, hint=error.hint)
    if isinstance(error, subprocess.TimeoutExpired):
        return HostError(f"{error.cmd[0]} did not end within {error.timeout:g} s", hint=AGAIN)
    return None


def _number(error: OSError) -> int:
    """Return its errno; shutil's error has only the texts of several."""
    found = NUMBER.search(str(error)) if isinstance(error, shutil.Error) else None
    return int(found[1]) if found else error.errno or 0


def _internal(error: BaseException) -> InternalError:
    return InternalError(f"internal error: {type(error).__name__}: {error}", hint=REPORT)


def error_result(
    fault: GraderError, submission: SubmissionInfo, rubric: LoadedRubric, timing: TimingInfo = NO_TIME
) -> GradingResult:
    """Return the result that says why nothing was graded: every criterion is open, and no points are awarded."""
    result = assemble_result(
        submission,
        rubric,
        tuple(_not_judged(criterion, fault) for criterion in rubric.rubric.criteria),
        runs={},
        environment=environment_info(),
        timing=timing,
    )
    error = ErrorInfo(kind=fault.kind, message=fault.message, hint=fault.hint)
    return result.model_copy(update={"status": "error", "error": error})


def _not_judged(criterion: Criterion, fault: GraderError) -> CriterionResult:
    own = fault.blame == "submission"
    lost = "not judged" if own else "not judged, which is not the submission's fault, so this costs no marks"
    return CriterionResult.unmeasured(
        id=criterion.id,
        title=criterion.title,
        check=criterion.check,
        scenario=criterion.scenario,
        status=Status.ERROR,
        max_points=criterion.points,
        extra=criterion.extra,
        message=f"{lost}: {fault.message}",
        hint=fault.hint if own else "grade the submission again",
    )


def _write_error_result(fault: GraderError, context: GradingContext) -> str:
    """Write the result that says what went wrong; where it is not written, return a note that says why.

    An earlier complete result stays, unless the submission itself is at fault now.
    """
    submission = context.submission
    if submission is None and (known := identify(context.source, context.submission_id)):
        submission = SubmissionInfo.unopened(*known)
    if submission is None:
        return ""
    folder = context.out / submission.id
    try:
        with Results(folder) as results:
            if fault.blame != "submission" and results.complete:
                return f"the result of an earlier run stays as it is: {folder / RESULT}"
            result = error_result(fault, submission, context.rubric, context.timing())
            result = result.model_copy(update={"rubric_origin": context.rubric_origin})
            # an error has no evidence, and what an earlier run recorded goes with its result
            results.evidence.rmdir()
            rubric, hidden = context.rubric.rubric, context.keep_hidden
            write_reports(result, results.new, console="", rubric=rubric, keep_hidden=hidden)
            (results.new / "console.log").unlink()
            results.commit()
    except Exception as second:  # noqa: BLE001 - the first error is the one to report
        return f"no result could be written: {getattr(second, 'message', '') or type(second).__name__}"
    return ""
