"""`grader ci github|gitlab`: what `action.yml` and `ci/gitlab.yml` run. All that it is asked stands in variables."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from grader import pipeline
from grader.batch.folder import read_result
from grader.ci.files import add_forms, clear, keep
from grader.ci.github import GitHub
from grader.ci.gitlab import GitLab
from grader.ci.mark import needed_words, with_mark
from grader.ci.outcome import OF_CODE, Graded, Outcome
from grader.ci.settings import Settings, read_settings
from grader.cli.choice import choose
from grader.cli.display import open_progress
from grader.cli.errors import report
from grader.cli.outcome import exit_code, settled
from grader.cli.prefix import package_prefix
from grader.cli.say import say
from grader.errors import ExitCode, GraderError, PackageNotFound, SubmissionError
from grader.judging.summary import total_points
from grader.model.result import GradingResult
from grader.report.hidden import hidden_ids, without_hidden
from grader.report.terminal import open_console, print_report
from grader.report.text import number
from grader.rubric.load import LoadedRubric
from grader.temporary import temporary_folder

STUDENTS = {SubmissionError.kind, PackageNotFound.kind}
RESULT = "result.json"


def run(*, system: str) -> ExitCode:
    """Grade as `grader check` does, keep the reports, tell the CI system. Its job fails as `GRADER_FAIL_ON` says."""
    variables = dict(os.environ)
    teller = (
        GitHub(variables)
        if system == "github"
        else GitLab(Path(variables.get("GRADER_OUT") or "grader-results"))
    )
    try:
        settings = read_settings(variables)
        with teller.unheard():
            graded = _graded(settings)
    except GraderError as error:
        teller.refuse(error)
        raise
    teller.tell(graded)
    say(f"{graded.outcome.value}: {graded.said}")
    say(f"sandbox: {graded.result.environment.sandbox}")
    code = next(code for code, outcome in OF_CODE.items() if outcome is graded.outcome)
    return code if graded.fails else ExitCode.PASSED


def _graded(settings: Settings) -> Graded:
    loaded, source = choose(settings.path, settings.lab)
    rubric = with_mark(loaded, settings.mark)
    clear(settings.out)
    options = pipeline.GradeOptions(
        sandbox=settings.sandbox, submission_id=None, static_only=settings.static, keep_hidden=False
    )
    with temporary_folder("check") as folder:
        try:
            with open_progress(early=False) as progress:
                made = pipeline.grade(source, rubric, folder, options, progress)
            result, place = without_hidden(made, rubric.rubric), folder / made.submission.id
        except GraderError as error:
            result, place = _left(folder, error)
        keep(place, settings.out, rubric.rubric)
    prefix = _prefix(result, Path(source))
    add_forms(settings.out, result, prefix, rubric.docs)
    hidden = len(hidden_ids(rubric.rubric))
    print_report(result, rubric.rubric, open_console(sys.stdout), hidden=hidden, static=settings.static)
    return _judged(result, rubric, settings, prefix)


def _left(folder: Path, error: GraderError) -> tuple[GradingResult, Path]:
    """The result that says why nothing was graded. Raises the error where there is none."""
    report(error)
    for place in sorted(path.parent for path in folder.glob(f"*/{RESULT}")):
        result = read_result(place)
        if result is not None:
            return result, place
    raise error


def _prefix(result: GradingResult, source: Path) -> str:
    """The package's folder in the repository: the one around it, or where the job was started."""
    source = source.resolve()
    cloned = any((folder / ".git").exists() for folder in (source, *source.parents))
    return package_prefix(result, source if cloned and source.is_dir() else Path.cwd()) or ""


def _judged(result: GradingResult, rubric: LoadedRubric, settings: Settings, prefix: str) -> Graded:
    criteria = settled(result.criteria) if settings.static else result.criteria
    refused = result.error is not None and result.status == "error"
    code = ExitCode.NOT_GRADED if refused or not criteria else exit_code(criteria, rubric.rubric)
    outcome = OF_CODE[code]
    students = result.error is not None and result.error.kind in STUDENTS
    points, most = total_points(rubric.rubric, criteria), sum(c.max_points for c in criteria)
    return Graded(
        outcome=outcome,
        fails=outcome in settings.fail_on or (students and Outcome.BELOW in settings.fail_on),
        points=points,
        max_points=most,
        said=_said_of_error(result)
        if outcome is Outcome.NOT_GRADED
        else _said(points, most, rubric, outcome, static=settings.static),
        result=result,
        rubric=rubric.rubric,
        folder=settings.out.absolute(),
        prefix=prefix,
    )


def _said_of_error(result: GradingResult) -> str:
    own = result.error is not None and result.error.kind in STUDENTS
    why = result.error.message if result.error else "a check of the grader failed"
    return why if own else f"{why}; this is not the submission's fault, and no mark is lost"


def _said(points: float, most: float, rubric: LoadedRubric, outcome: Outcome, *, static: bool) -> str:
    files = " that the files alone decide (nothing was run)" if static else ""
    told = f"{number(points)} of {number(most)} points{files}"
    if outcome is Outcome.INCONCLUSIVE:
        return (
            f"{told}, and something could not be judged: run it again, or a person decides; no mark is lost"
        )
    return f"{told}; {needed_words(rubric.rubric, most)}"
