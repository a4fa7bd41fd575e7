"""From criteria to exit codes."""

from __future__ import annotations

from collections.abc import Iterable

from grader.errors import ExitCode
from grader.judging.summary import overall_status, reached_pass_mark
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric

EXACT_DIGITS = 6
"""More than points have, and fewer than show how floating point multiplies."""


def exit_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Of the criteria that are shown: not graded where the grader itself failed, passed, not settled, or below.

    A pass mark in points that is reached stays reached, whatever is still open.
    """
    shown = tuple(criteria)
    status = overall_status(shown)
    if status == "error":
        return ExitCode.NOT_GRADED
    if reached_pass_mark(_in_proportion(rubric, shown), shown):
        return ExitCode.PASSED
    return ExitCode.INCONCLUSIVE if status == "inconclusive" else ExitCode.BELOW_PASS_MARK


def worst(codes: Iterable[ExitCode]) -> ExitCode:
    """How several ended together. Not graded is worse than below the mark, that than not settled."""
    order = (ExitCode.PASSED, ExitCode.INCONCLUSIVE, ExitCode.BELOW_PASS_MARK, ExitCode.NOT_GRADED)
    return max(codes, key=order.index)


def staged_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Of a hook before a commit: what fails, fails it, whatever the pass mark is. What is open does not."""
    judged = settled(criteria)
    counted = [c for c in judged if c.max_points > 0 or c.status is Status.ERROR]
    return exit_code(judged, rubric.model_copy(update={"pass_mark": None})) if counted else ExitCode.PASSED


def settled(criteria: Iterable[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Those that could be judged."""
    return tuple(c for c in criteria if not c.status.is_open)


def _in_proportion(rubric: Rubric, shown: tuple[CriterionResult, ...]) -> Rubric:
    """The rubric with its pass mark as large a part of the points that are shown as it is of all."""
    if rubric.pass_mark is None:
        return rubric
    share = sum(c.max_points for c in shown) / (rubric.max_points or 1.0)
    return rubric.model_copy(update={"pass_mark": round(rubric.pass_mark * share, EXACT_DIGITS)})
