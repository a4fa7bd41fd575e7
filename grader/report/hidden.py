"""The student's view of a result: without the criteria that the rubric hides."""

from __future__ import annotations

from grader.judging.settle import lateness, status_after_overrides
from grader.model.result import GradingResult
from grader.rubric.model import Rubric


def hidden_ids(rubric: Rubric) -> frozenset[str]:
    """The ids of the criteria that `grader check` does not show."""
    return frozenset(c.id for c in rubric.criteria if c.visibility == "hidden")


def without_hidden(result: GradingResult, rubric: Rubric) -> GradingResult:
    """The result as if the hidden criteria were not in the rubric: points, maximum, status and what being late costs
    follow, and what people decided about hidden criteria is left out."""
    hidden = hidden_ids(rubric)
    shown = tuple(c for c in result.criteria if c.id not in hidden)
    if len(shown) == len(result.criteria):
        return result
    decided = tuple(o for o in result.overrides if o.criterion not in hidden)
    points = round(sum(c.points for c in shown), rubric.digits)
    visible = rubric.model_copy(update={"criteria": tuple(c for c in rubric.criteria if c.id not in hidden)})
    late = lateness(points, visible, result.late) if result.late else None
    update = {
        "criteria": shown,
        "overrides": decided,
        "late": late,
        "points": late.points if late else points,
        "max_points": sum(c.max_points for c in shown),
        "status": status_after_overrides(result, shown, {o.criterion for o in decided}),
    }
    return result.model_copy(update=update)
