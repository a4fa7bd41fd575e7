"""What `grader report` writes: the reports of results that exist already, of a submission or a class."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from grader.classes.batch.existing_results import (
    Written,
    figures_in,
    has_result,
    result_in,
    write_all,
    write_one,
)
from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.batch.run import INDEX
from grader.cli.errors import report
from grader.cli.outcome import exit_code
from grader.cli.output import say, say_beside
from grader.cli.select_rubric import package_prefix
from grader.errors import EvidenceError, ExitCode, UsageError
from grader.files import atomic_write
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation
from grader.portable import cores
from grader.report.class_page.page import write_class_page
from grader.report.class_page.submissions import salt_in
from grader.report.forms import FORMS, ReportInput
from grader.report.sentences import missing_hidden
from grader.report.terminal import open_console, print_report
from grader.report.view import without_hidden
from grader.rubric.find import named_labs
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.model import Rubric
from grader.wording import first_few

STDOUT = "-"
NAMES_SHOWN = 5


def folders_in(folder: Path, batch: BatchFolder | None) -> list[Path]:
    """Return the submissions of a batch, or in any folder of results. Raises UsageError if there are none."""
    try:
        places = sorted(folder.iterdir()) if batch is None else map(batch.folder_of, batch.run.entries)
        found = [place for place in places if has_result(place)]
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}", hint="give a folder of results") from error
    if not found:
        hint = "give the --out of `grader batch`, or a submission's folder"
        raise UsageError(f"{folder} contains no results", hint=hint)
    return found


def rubric_of(given: str | None, folder: Path, batch: BatchFolder | None = None) -> LoadedRubric:
    """Return the rubric that is given, else the one of the batch, else the lab with the result's id."""
    if given is None and batch is None and (folder.absolute().parent / RUN).is_file():
        batch = open_batch(folder.absolute().parent)
    if given is None and batch is None:
        given = result_in(folder).rubric.id
        if not named_labs(given):
            message = f'{folder}: its rubric "{given}" is none of the labs that are known here'
            raise UsageError(message, hint="name its file with --rubric")
    return load_rubric(given or (batch.run.rubric_source if batch else ""))


def write_reports(folders: Sequence[Path], rubric: LoadedRubric) -> ExitCode:
    """Write every report of these submissions. NOT_GRADED if a result cannot be read."""
    if len(folders) == 1:
        digest = write_one(folders[0], rubric).rubric.digest
        done = [Written(folder=folders[0], rubric_digest=digest)]
    else:
        done = list(write_all(folders, rubric, cores()))
    _say_others(
        [w.folder.absolute().name for w in done if not w.error and w.rubric_digest != rubric.digest], rubric
    )
    for failed in (w for w in done if w.error):
        report(EvidenceError(failed.error, hint=failed.hint))
    good = sum(not w.error for w in done)
    where = folders[0] if len(folders) == 1 else folders[0].parent
    say(f"{good} of {len(done)} written: {where}" if len(done) > 1 else str(where / "report.html"))
    return ExitCode.PASSED if good == len(done) else ExitCode.NOT_GRADED


def _say_others(names: Sequence[str], rubric: LoadedRubric) -> None:
    if names:
        shown = first_few(names, NAMES_SHOWN)
        _remark(f"{shown}: judged by another version of {rubric.path}")


def _remark(text: str) -> None:
    say_beside(f"report: {text}")


def write_class_pages(batch: BatchFolder, anonymous: Path | None) -> None:
    """Write the class's page, and one without names to `anonymous`."""
    targets = [(batch.path / INDEX, False), *([(anonymous, True)] if anonymous else [])]
    for target, nameless in targets:
        pairs = ((row.entry, row.result) for row in batch.rows())
        salt = salt_in(batch.path) if nameless else None
        write_class_page(batch.run, pairs, target, anonymous=nameless, salt=salt)
        say(str(target))


def write_form(
    folder: Path, rubric: LoadedRubric, form: str, out: str, prefix: str | None, *, student: bool
) -> ExitCode:
    """Write one form of a submission's report to the file `out`, or to stdout for `-`."""
    result = result_in(folder, rubric)
    if result.rubric.digest != rubric.digest:
        _say_others([folder.absolute().name], rubric)
    if form == "gradescope" and student:
        raise UsageError("Gradescope hides hidden criteria itself", hint="leave out --student")
    shown = without_hidden(result, rubric.rubric) if student or form == "classroom" else result
    if form == "terminal" and out == STDOUT:
        hidden = missing_hidden(shown, rubric.rubric)
        print_report(shown, rubric.rubric, open_console(sys.stdout), hidden=hidden, full=True)
        return ExitCode.PASSED
    where = _prefix(result, prefix) if FORMS[form].cites_lines else ""
    about = ReportInput(
        result=shown,
        rubric=rubric.rubric,
        hidden=missing_hidden(shown, rubric.rubric),
        prefix=where,
        passed=_passed(shown, rubric.rubric),
        docs=rubric.docs,
        load_figures=lambda: figures_in(folder, shown, rubric.rubric),
    )
    data = FORMS[form].render(about)
    if out == STDOUT:
        sys.stdout.buffer.write(data)
    else:
        atomic_write(Path(out), data)
    return ExitCode.PASSED


def _prefix(result: GradingResult, given: str | None) -> str:
    found = package_prefix(result, Path.cwd()) if given is None else given
    cites = any(isinstance(cited, FileCitation) for c in result.criteria for cited in c.citations)
    if found is None and cites:
        package = result.submission.package
        _remark(
            f"no package {package} with these files is here, so paths begin in it; give its folder with --prefix"
        )
    return found or ""


def _passed(result: GradingResult, rubric: Rubric) -> bool:
    return result.status != "error" and exit_code(result.criteria, rubric) is ExitCode.PASSED
