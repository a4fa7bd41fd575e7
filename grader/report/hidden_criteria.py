"""A result as its student may see it: without hidden criteria before grading, with one row for them once published."""

from __future__ import annotations

from grader.judging.settle import awarded, lateness, status_after_overrides
from grader.judging.summary import total_fields, total_points
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.rubric.model import Rubric
from grader.wording import plural


def hidden_ids(rubric: Rubric) -> frozenset[str]:
    """Return the ids of the criteria that `grader check` does not show."""
    return frozenset(c.id for c in rubric.criteria if c.visibility == "hidden")


def without_hidden(result: GradingResult, rubric: Rubric) -> GradingResult:
    """Return the result as if the hidden criteria were not in the rubric: points, maximum, status and what being late
    costs follow, and what people decided about hidden criteria is left out."""
    hidden = hidden_ids(rubric)
    shown = tuple(c for c in result.criteria if c.id not in hidden)
    if len(shown) == len(result.criteria):
        return result
    decided = tuple(o for o in result.overrides if o.criterion not in hidden)
    visible = rubric.model_copy(update={"criteria": tuple(c for c in rubric.criteria if c.id not in hidden)})
    points = total_points(visible, shown)
    # a part of the points that show, not of all
    late = lateness(points, visible, result.late) if result.late else None
    update = {
        **total_fields(visible, shown),
        "criteria": shown,
        "overrides": decided,
        "late": late,
        "points": late.points if late else points,
        "max_points": round(sum(c.max_points for c in shown), 6),
        "status": status_after_overrides(result, shown, awarded(decided)),
    }
    return result.model_copy(update=update)


NOT_SHOWN = "not-shown"
"""The id of the row that stands for all hidden criteria."""


def for_student(result: GradingResult, hidden: frozenset[str]) -> GradingResult:
    """Return a published result as its student may read it: with the points that count.

    All criteria of the ids in `hidden` are one row with points and without words, and nothing speaks to those who mark.
    """
    unseen = [c for c in result.criteria if c.id in hidden]
    shown = [_unlink(c, hidden) for c in result.criteria if c.id not in hidden]
    # a note about such a run would tell what is hidden
    runs = {c.scenario for c in unseen} - {c.scenario for c in shown}
    gate = result.gate
    update = {
        "criteria": (*shown, *_in_one(unseen)),
        "overrides": tuple(
            o.model_copy(update={"changed": False}) for o in result.overrides if o.criterion not in hidden
        ),
        "notes": tuple(note for note in result.notes if note.scenario not in runs),
        "gate": gate.model_copy(update={"criterion": NOT_SHOWN})
        if gate and gate.criterion in hidden
        else gate,
    }
    return result.model_copy(update=update)


def _unlink(criterion: CriterionResult, hidden: frozenset[str]) -> CriterionResult:
    if criterion.blocked_by not in hidden:
        return criterion
    return criterion.model_copy(update={"blocked_by": NOT_SHOWN})


def _in_one(criteria: list[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return one row for these criteria; none where they are worth nothing."""
    counting = [c for c in criteria if c.counts]
    if not counting:
        return ()
    points, most = (round(sum(p), 6) for p in zip(*((c.points, c.max_points) for c in counting), strict=True))
    extra = 0.0 if most else round(sum(c.extra for c in counting), 6)
    full = points >= sum(c.full for c in counting)
    status = Status.PASS if full else Status.PARTIAL if points > 0 else Status.FAIL
    if any(c.status.is_open for c in counting):
        status = Status.INCONCLUSIVE
    title = f"{plural(len(counting), 'criterion', 'criteria')} that your course does not show"
    row = CriterionResult.unmeasured(
        id=NOT_SHOWN,
        title=title,
        status=status,
        points=points,
        max_points=most,
        extra=extra,
        message="" if full else title,
    )
    return (row,)
