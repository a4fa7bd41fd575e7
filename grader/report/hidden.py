"""The student's view of a result: without the criteria that the rubric hides."""

from __future__ import annotations

from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric


def hidden_ids(rubric: Rubric) -> frozenset[str]:
    """The ids of the criteria that `grader check` does not show."""
    return frozenset(c.id for c in rubric.criteria if c.visibility == "hidden")


def without_hidden(result: GradingResult, rubric: Rubric) -> GradingResult:
    """The result as if the hidden criteria were not in the rubric: points, maximum and status follow."""
    shown = tuple(c for c in result.criteria if c.id not in hidden_ids(rubric))
    if len(shown) == len(result.criteria):
        return result
    return result.model_copy(
        update={
            "criteria": shown,
            "points": round(sum(c.points for c in shown), rubric.digits),
            "max_points": sum(c.max_points for c in shown),
            "status": "error" if result.error else _status(shown),
        }
    )


def _status(shown: tuple[CriterionResult, ...]) -> str:
    statuses = {c.status for c in shown if c.max_points > 0}
    if not statuses or Status.ERROR in statuses:
        return "error"
    return "inconclusive" if statuses & {Status.INCONCLUSIVE, Status.MANUAL} else "graded"
