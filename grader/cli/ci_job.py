"""What `grader ci` does in a job of GitHub or GitLab: grade as `grader check` does, keep the reports, tell the system.

`action.yml` and `ci/gitlab.yml` run it; everything it is asked stands in variables.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from grader import pipeline
from grader.cli.checking import say_choice
from grader.cli.display import exit_code, judged_criteria, open_progress
from grader.cli.host_support import warn_without_sandbox
from grader.cli.output import report, say
from grader.cli.select_rubric import Chosen, choose_all, only, package_prefix
from grader.errors import ExitCode, GraderError, RubricError, UsageError
from grader.faults import fault_of
from grader.files import temporary_folder
from grader.integrations.ci_systems import (
    OF_CODE,
    RUNNERS,
    JobResult,
    JobSettings,
    JobStatus,
    add_forms,
    clear,
    describe_outcome,
    keep,
    read_settings,
    with_pass_mark,
)
from grader.judging.summary import overall_status, total_fields
from grader.model.result import GradingResult
from grader.report.sentences import rubric_words, without_sandbox
from grader.report.terminal import Terminal, open_console
from grader.report.view import hidden_ids, is_students_fault, without_hidden
from grader.results import RESULT, read_result
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Rubric

WHICH = "give the package's folder as path (GRADER_PATH), and the lab as lab (GRADER_LAB)"


def run_job(system: str) -> ExitCode:
    """Run the job of `github` or `gitlab`; it fails as `GRADER_FAIL_ON` says."""
    variables = dict(os.environ)
    teller = RUNNERS[system](variables)
    try:
        settings = read_settings(variables)
        # what the package prints could command the runner (`::error::`) as the job does
        with teller.commands_stopped():
            graded = _grade(settings)
    except Exception as error:
        teller.tell_error(fault_of(error))
        raise
    teller.tell(graded)
    say(f"{graded.outcome.value}: {graded.message}")
    say(f"rubric: {graded.result.rubric.id}, digest {rubric_words(graded.result)}")
    warning = without_sandbox(graded.result.environment.sandbox)
    if warning:
        say(warning)
    say(f"sandbox: {graded.result.environment.sandbox}")
    # each outcome is that of one code
    code = next(code for code, outcome in OF_CODE.items() if outcome is graded.outcome)
    return code if graded.fails else ExitCode.PASSED


def _grade(settings: JobSettings) -> JobResult:
    settings.check_attempt()
    chosen = _choose(settings)
    source, rubric = chosen.source, with_pass_mark(chosen.rubric, settings.mark)
    say_choice(chosen)
    if not settings.static:
        warn_without_sandbox(settings.sandbox, rubric)
    # a runner that is used again may have reports of an earlier job there
    clear(settings.out)
    options = pipeline.GradeOptions(
        sandbox=settings.sandbox,
        package=settings.package,
        static_only=settings.static,
        keep_hidden=False,
        repository=settings.repository,
    )
    with temporary_folder("check") as folder:
        try:
            with open_progress(early=False) as progress:
                made = pipeline.grade(source, rubric, folder, options, progress)
            result, place = without_hidden(made, rubric.rubric), folder / made.submission.id
        except GraderError as error:
            result, place = _error_result(folder, error)
        keep(place, settings.out, rubric.rubric)
    prefix = _prefix(result, Path(source))
    add_forms(settings.out, result, rubric.rubric, prefix, rubric.docs)
    hidden, unrun = len(hidden_ids(rubric.rubric)), "--static" if settings.static else ""
    Terminal(open_console(sys.stdout)).report(result, rubric.rubric, hidden=hidden, unrun=unrun)
    return _outcome_of(result, rubric, settings, prefix)


def _choose(settings: JobSettings) -> Chosen:
    try:
        return only(choose_all(settings.path, settings.lab, settings.package))
    except RubricError:
        raise
    except UsageError as error:  # its hint is for people at a terminal
        raise UsageError(error.message, hint=WHICH) from error


def _error_result(folder: Path, error: GraderError) -> tuple[GradingResult, Path]:
    """Return the result that says why nothing was graded. Raises the error if there is none."""
    report(error)
    for place in sorted(path.parent for path in folder.glob(f"*/{RESULT}")):
        result = read_result(place)
        if result is not None:
            return result, place
    raise error


def _prefix(result: GradingResult, source: Path) -> str:
    """Return the package's folder in the repository: the one around it, or where the job was started."""
    source = source.resolve()
    cloned = any((folder / ".git").exists() for folder in (source, *source.parents))
    return package_prefix(result, source if cloned and source.is_dir() else Path.cwd()) or ""


def _outcome_of(result: GradingResult, rubric: LoadedRubric, settings: JobSettings, prefix: str) -> JobResult:
    counted = _counting_result(result, rubric.rubric, static=settings.static)
    error = result.error if result.status == "error" else None
    lab = rubric.rubric
    code = ExitCode.NOT_GRADED if error or not counted.criteria else exit_code(counted.criteria, lab)
    outcome = OF_CODE[code]
    message, hint = describe_outcome(counted, lab, outcome, static=settings.static)
    if settings.attempts is not None:
        message = f"attempt {settings.attempt} of {settings.attempts}: {message}"
    students = error is not None and is_students_fault(result)
    return JobResult(
        outcome=outcome,
        fails=outcome in settings.fail_on or (students and JobStatus.BELOW in settings.fail_on),
        message=message,
        hint=hint,
        result=result,
        counted=counted,
        rubric=lab,
        folder=settings.out.absolute(),
        prefix=prefix,
    )


def _counting_result(result: GradingResult, rubric: Rubric, *, static: bool) -> GradingResult:
    """Return, with `static`, the result of the criteria that can be judged from the files alone."""
    if not static or result.error is not None:
        return result
    criteria = judged_criteria(result.criteria)
    update = {
        "criteria": criteria,
        **total_fields(rubric, criteria),
        # of thirds and the like, floating point leaves something in the last digits
        "max_points": round(sum(c.max_points for c in criteria), 6),
        "status": overall_status(criteria),
    }
    return result.model_copy(update=update)
