"""From results to exit codes."""

from __future__ import annotations

from collections.abc import Iterable

from grader.errors import ExitCode
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric

UNSETTLED = frozenset({Status.INCONCLUSIVE, Status.ERROR})


def exit_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Of all criteria that are shown: passed, below the pass mark, or not to be told yet.

    Where the rubric has a pass mark, points decide; what is still open cannot take reached points away.
    Without one, every visible criterion that is worth points must be reached, save those that a person marks.
    """
    shown = tuple(criteria)
    if rubric.pass_mark is not None and sum(c.points for c in shown) >= _mark(shown, rubric):
        return ExitCode.PASSED
    if any(c.status in UNSETTLED for c in shown):
        return ExitCode.INCONCLUSIVE
    if rubric.pass_mark is not None:
        return ExitCode.BELOW_PASS_MARK
    visible = {c.id for c in rubric.criteria if c.visibility == "visible"}
    needed = [c for c in shown if c.id in visible and c.max_points > 0 and c.status is not Status.MANUAL]
    if not needed:
        return ExitCode.INCONCLUSIVE
    return ExitCode.PASSED if all(c.status is Status.PASS for c in needed) else ExitCode.BELOW_PASS_MARK


def _mark(shown: tuple[CriterionResult, ...], rubric: Rubric) -> float:
    """The pass mark, in proportion where hidden criteria are left out."""
    return (rubric.pass_mark or 0.0) * sum(c.max_points for c in shown) / (rubric.max_points or 1.0)
