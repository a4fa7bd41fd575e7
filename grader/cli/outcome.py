"""How a command ends: the report on stdout, where its files are, and the exit code that the criteria come to."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import RenderableType

from grader.cli.output import report, say, say_document
from grader.errors import ExitCode, GraderError
from grader.judging.summary import overall_status, reached_pass_mark, scaled_pass_mark
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.files import result_text
from grader.report.terminal import open_console, print_report
from grader.results import RESULT
from grader.rubric.model import Rubric


def exit_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Return the exit code of the criteria that are shown.

    A pass mark in points that is reached stays reached, even if some criteria are open.
    """
    shown = tuple(criteria)
    status = overall_status(shown)
    if status == "error":
        return ExitCode.NOT_GRADED
    if reached_pass_mark(_in_proportion(rubric, shown), shown):
        return ExitCode.PASSED
    return ExitCode.INCONCLUSIVE if status == "inconclusive" else ExitCode.BELOW_PASS_MARK


def worst(codes: Iterable[ExitCode]) -> ExitCode:
    """Return the worst code: not graded is worse than below the pass mark, and that is worse than inconclusive."""
    order = (ExitCode.PASSED, ExitCode.INCONCLUSIVE, ExitCode.BELOW_PASS_MARK, ExitCode.NOT_GRADED)
    return max(codes, key=order.index)


def staged_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Return the code of a pre-commit hook: any criterion that fails, fails it, whatever the pass mark is."""
    judged = judged_criteria(criteria)
    counted = [c for c in judged if c.is_required or c.status is Status.ERROR]
    return exit_code(judged, rubric.model_copy(update={"pass_mark": None})) if counted else ExitCode.PASSED


def judged_criteria(criteria: Iterable[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return the criteria that could be judged."""
    return tuple(c for c in criteria if not c.status.is_open)


def _in_proportion(rubric: Rubric, shown: tuple[CriterionResult, ...]) -> Rubric:
    """Return the rubric with its pass mark scaled from all points to those that are shown."""
    points = sum(c.max_points for c in shown)
    return rubric.model_copy(update={"pass_mark": scaled_pass_mark(rubric, points)})


REPORT = "report.html"
REPORTS = (REPORT, RESULT, "report.md", "junit.xml", "console.log")


def show(
    result: GradingResult,
    rubric: Rubric,
    folder: Path | None,
    *,
    hidden: int = 0,
    as_json: bool = False,
    static: bool = False,
    unrun: str = "",
    remarks: Sequence[RenderableType] = (),
    full: bool = False,
) -> ExitCode:
    """Print the result, from which `hidden` criteria are left out already, and return its exit code.

    With `static`, only the criteria that could be judged count. `unrun` says why nothing was run, on purpose or not:
    open criteria are then only counted in the report. `remarks` stand before the losses; with `full` all criteria are
    listed.
    """
    if as_json:
        say_document(lambda ascii_only: result_text(result, ascii_only=ascii_only))
    else:
        console = open_console(sys.stdout)
        print_report(result, rubric, console, hidden=hidden, unrun=unrun, remarks=remarks, full=full)
        _paths(folder)
    if result.error is not None:
        report(GraderError(result.error.message, hint=result.error.hint))
    if result.status == "error":
        return ExitCode.NOT_GRADED
    return exit_code(judged_criteria(result.criteria) if static else result.criteria, rubric)


def _paths(folder: Path | None) -> None:
    if folder is None:
        return
    others = [name for name in REPORTS[1:] if (folder / name).is_file()]
    others += ["evidence/"] if (folder / "evidence").is_dir() else []
    if (folder / REPORT).is_file():
        say(f"Report: {folder / REPORT}")
    if others:
        say(f"Beside it: {', '.join(others)}")
