"""From the automatic result to the one that counts, and back: what people decided, then what being late costs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Literal

from grader.judging.late import lateness
from grader.judging.points import round_half_up
from grader.judging.summary import overall_status, total_points
from grader.model.result import AppliedOverride, Automatic, CriterionResult, GradingResult, HandedIn, Override
from grader.model.verdict import Status
from grader.rubric.model import Rubric


def settle(
    result: GradingResult,
    rubric: Rubric,
    *,
    overrides: Mapping[str, Override],
    handed_in: HandedIn | None,
    before: tuple[AppliedOverride, ...] = (),
) -> GradingResult:
    """The result with the points that people gave (`overrides`, by criterion), and without what being late costs.

    `before` are the overrides of the earlier result: an override that was there already keeps what the check said when
    it was decided, and is marked where the check says something else now. Overrides of criteria that the result does
    not have are left out.
    """
    automatic = unsettled(result, rubric)
    said = {criterion.id: _automatic(criterion) for criterion in automatic.criteria}
    applied = tuple(_applied(name, overrides[name], said[name], before) for name in said if name in overrides)
    decided = {override.criterion: override for override in applied}
    criteria = tuple(
        _decided(criterion, decided[criterion.id], rubric.digits) if criterion.id in decided else criterion
        for criterion in automatic.criteria
    )
    points = total_points(rubric, criteria)
    late = lateness(points, rubric, handed_in)
    update = {
        "status": status_after_overrides(result, criteria, decided.keys()),
        "points": late.points if late else points,
        "criteria": criteria,
        "overrides": applied,
        "handed_in": handed_in,
        "late": late,
    }
    return automatic.model_copy(update=update)


def unsettled(result: GradingResult, rubric: Rubric) -> GradingResult:
    """The automatic result that a settled one was made from. An automatic result is given back as it is."""
    if not result.overrides and result.handed_in is None and result.late is None:
        return result
    said = {override.criterion: override.automatic for override in result.overrides}
    criteria = tuple(c.model_copy(update=dict(said[c.id])) if c.id in said else c for c in result.criteria)
    update = {
        "status": status_after_overrides(result, criteria, ()),
        "points": total_points(rubric, criteria),
        "criteria": criteria,
        "overrides": (),
        "handed_in": None,
        "late": None,
    }
    return result.model_copy(update=update)


def status_after_overrides(
    result: GradingResult, criteria: tuple[CriterionResult, ...], decided: Collection[str]
) -> Literal["graded", "inconclusive", "error"]:
    """Return the status of a result with these criteria, of which people decided some.

    What could not be graded at all stays an error until a person has decided all that counts.
    """
    if result.error is not None and any(c.max_points > 0 and c.id not in decided for c in criteria):
        return "error"
    return overall_status(criteria)


def _automatic(criterion: CriterionResult) -> Automatic:
    return Automatic(status=criterion.status, points=criterion.points, message=criterion.message)


def _applied(
    criterion: str, override: Override, now: Automatic, before: tuple[AppliedOverride, ...]
) -> AppliedOverride:
    earlier = next((b for b in before if b.criterion == criterion and _is(b, override)), None)
    was = earlier.was if earlier else now
    return AppliedOverride(
        **{name: getattr(override, name) for name in Override.model_fields},
        criterion=criterion,
        automatic=now,
        was=was,
        changed=(was.status, was.points) != (now.status, now.points),
    )


def _is(earlier: AppliedOverride, override: Override) -> bool:
    """Whether it is the same decision."""
    return all(getattr(earlier, name) == getattr(override, name) for name in Override.model_fields)


def _decided(criterion: CriterionResult, override: Override, digits: int) -> CriterionResult:
    """The criterion with a person's points. What was expected and measured stays."""
    points = round_half_up(override.points, digits)
    status = Status.PASS if points >= criterion.max_points else Status.PARTIAL if points > 0 else Status.FAIL
    author = f" by {override.author}" if override.author else ", decided by a person"
    comment = f": {override.comment}" if override.comment else ""
    message = f"{points:g} of {criterion.max_points:g} points{author}{comment}"
    return criterion.model_copy(update={"status": status, "points": points, "message": message})
