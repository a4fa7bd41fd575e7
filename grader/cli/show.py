"""How `grade` and `check` end: the report on stdout, where the files are, the exit code."""

from __future__ import annotations

import sys
from pathlib import Path

from grader.cli.errors import report
from grader.cli.outcome import exit_code, settled
from grader.cli.output import say, say_document
from grader.errors import ExitCode, GraderError
from grader.model.result import GradingResult
from grader.report.result_json import result_text
from grader.report.terminal import open_console, print_report
from grader.rubric.model import Rubric

REPORTS = ("report.html", "result.json", "report.md", "junit.xml", "console.log")


def show(
    result: GradingResult,
    rubric: Rubric,
    folder: Path | None,
    *,
    hidden: int = 0,
    as_json: bool = False,
    static: bool = False,
    unrun: str = "",
) -> ExitCode:
    """Print the result (`hidden` criteria are left out of it already) and give its exit code.

    With `static` nothing was run on purpose: the exit code is that of the criteria that could be judged. `unrun` says
    why nothing was run, on purpose or not: what is open is then only counted.
    """
    if as_json:
        say_document(lambda ascii_only: result_text(result, ascii_only=ascii_only))
    else:
        print_report(result, rubric, open_console(sys.stdout), hidden=hidden, static=static, unrun=unrun)
        _paths(folder)
    if result.error is not None:
        report(GraderError(result.error.message, hint=result.error.hint))
    if result.status == "error":
        return ExitCode.NOT_GRADED
    return exit_code(settled(result.criteria) if static else result.criteria, rubric)


def _paths(folder: Path | None) -> None:
    if folder is None:
        return
    say("")
    say("Reports:")
    for name in REPORTS:
        if (folder / name).is_file():
            say(f"  {folder / name}")
    if (folder / "evidence").is_dir():
        say(f"  {folder / 'evidence'}/")
