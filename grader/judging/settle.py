"""From the automatic result to the one that counts, and back: what people decided, then what being late costs.

Lateness is pure arithmetic on absolute times. A day is 24 hours, whatever the clocks were set to.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from datetime import datetime, timedelta, timezone
from decimal import Decimal
from typing import Literal

from grader.judging.summary import (
    leave_out,
    overall_status,
    round_half_up,
    take_in,
    total_fields,
    total_points,
)
from grader.model.result import (
    AppliedOverride,
    Automatic,
    CriterionResult,
    GradingResult,
    HandedIn,
    Lateness,
    Override,
)
from grader.model.verdict import Status
from grader.rubric.model import Late, Rubric
from grader.wording import plural

UNITS = {"day": timedelta(days=1), "hour": timedelta(hours=1)}
SPANS = {"day": 86_400, "hour": 3600, "minute": 60, "second": 1}
UNDATED = "it is not known when it was submitted, so it counts as in time"


def settle(
    result: GradingResult,
    rubric: Rubric,
    *,
    overrides: Mapping[str, Override],
    handed_in: HandedIn | None,
    before: tuple[AppliedOverride, ...] = (),
) -> GradingResult:
    """Return the result with the points that people gave (`overrides`, by criterion), and without what being late
    costs.

    `before` are the overrides of the earlier result: an override that was there already keeps what the check said when
    it was decided, and is marked where the check says something else now. Overrides of criteria that the result does
    not have are left out.
    """
    automatic = unsettled(result, rubric)
    # Also those that a group had left out: with a person's points, others may be its best.
    judged = take_in(automatic.criteria)
    said = {
        criterion.id: Automatic(status=criterion.status, points=criterion.points, message=criterion.message)
        for criterion in judged
    }
    applied = tuple(_apply(name, overrides[name], said[name], before) for name in said if name in overrides)
    decided = awarded(applied)
    criteria = tuple(_decide(criterion, decided.get(criterion.id), rubric.digits) for criterion in judged)
    criteria = leave_out(rubric, criteria)
    points = total_points(rubric, criteria)
    late = lateness(points, rubric, handed_in)
    update = {
        **total_fields(rubric, criteria),
        "status": status_after_overrides(result, criteria, decided),
        "points": late.points if late else points,
        "criteria": criteria,
        "overrides": applied,
        "handed_in": handed_in,
        "late": late,
    }
    return automatic.model_copy(update=update)


def awarded(overrides: Iterable[AppliedOverride]) -> dict[str, AppliedOverride]:
    """Return, by criterion, those with points: not those that only answer a student or say something more."""
    return {override.criterion: override for override in overrides if override.awards}


def unsettled(result: GradingResult, rubric: Rubric) -> GradingResult:
    """Return the automatic result that a settled one was made from; an automatic result as it is."""
    if not result.overrides and result.handed_in is None and result.late is None:
        return result
    said = {override.criterion: override.automatic for override in result.overrides}
    judged = [c.model_copy(update=dict(said[c.id])) if c.id in said else c for c in take_in(result.criteria)]
    criteria = leave_out(rubric, judged)
    update = {
        "status": status_after_overrides(result, criteria, ()),
        **total_fields(rubric, criteria),
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
    if result.error is not None and any(c.counts and c.id not in decided for c in criteria):
        return "error"
    return overall_status(criteria)


def _apply(
    criterion: str, override: Override, now: Automatic, before: tuple[AppliedOverride, ...]
) -> AppliedOverride:
    earlier = next((b for b in before if b.criterion == criterion and _is(b, override)), None)
    was = earlier.was if earlier else now
    return AppliedOverride(
        **{name: getattr(override, name) for name in Override.model_fields},
        criterion=criterion,
        automatic=now,
        was=was,
        changed=override.awards and (was.status, was.points) != (now.status, now.points),
    )


def _is(earlier: AppliedOverride, override: Override) -> bool:
    return all(getattr(earlier, name) == getattr(override, name) for name in Override.model_fields)


def _decide(criterion: CriterionResult, override: Override | None, digits: int) -> CriterionResult:
    """Return the criterion with a person's points, if there are any. What was expected and measured stays."""
    if override is None or override.points is None:
        return criterion
    points = round_half_up(override.points, digits)
    # The fewest points that it can have: 0, or minus the whole of a penalty.
    least = criterion.full - criterion.max_points - abs(criterion.extra)
    status = Status.PASS if points >= criterion.full else Status.PARTIAL if points > least else Status.FAIL
    author = f" by {override.author}" if override.author else ", decided by a person"
    comment = f": {override.comment}" if override.comment else ""
    answer = f"; to your request: {override.answer}" if override.answer else ""
    of = f" of {criterion.full:g}" if criterion.extra >= 0 else ""
    message = f"{points:g}{of} points{author}{comment}{answer}"
    return criterion.model_copy(update={"status": status, "points": points, "message": message})


def deadline_of(rubric: Rubric, extension_days: float = 0.0) -> datetime | None:
    """Return the rubric's deadline with one submission's extension, in its time zone; None where it has none."""
    if rubric.deadline is None:
        return None
    # In UTC a day is 24 hours; in the deadline's zone clocks may change in between.
    moved = rubric.deadline.astimezone(timezone.utc) + timedelta(days=extension_days)
    return moved.astimezone(rubric.deadline.tzinfo)


def lateness(points: float, rubric: Rubric, handed_in: HandedIn | None) -> Lateness | None:
    """Return what is left of `points`, and why. None where there is no deadline.

    The deadline is that of `handed_in`, which holds the extension already; where it has none, the rubric's with the
    extension. Late days move it by as many as it takes. What no one dates counts as in time.
    """
    given = handed_in or HandedIn()
    deadline = given.deadline or deadline_of(rubric, given.extension_days) or given.before
    if deadline is None:
        return None
    # `-(-a // b)` rounds up: a day that has begun is used.
    used = min(given.late_days, -(-_late_by(given.at, deadline, rubric.late) // UNITS["day"]))
    moved = (deadline.astimezone(timezone.utc) + used * UNITS["day"]).astimezone(deadline.tzinfo)
    late = _late_by(given.at, moved, rubric.late)
    left, text = _cost(points, rubric, late) if late else (points, _in_time(given, moved))
    if used:
        days = plural(used, "late day")
        text = (
            f"{days} used, then {text}"
            if late
            else f"in time with {days} of {given.late_days} that were left"
        )
    fields = {name: getattr(given, name) for name in HandedIn.model_fields}
    return Lateness(
        **{**fields, "deadline": moved},
        late_s=late.total_seconds(),
        late_days_used=used,
        points_before=points,
        points=left,
        text=text,
    )


def _late_by(at: datetime | None, deadline: datetime, policy: Late | None) -> timedelta:
    """Return how much later than the deadline; nothing for what is in time, by grace too."""
    if at is None:
        return timedelta()
    by = _between(deadline, at)
    grace = timedelta(minutes=policy.grace_minutes) if policy else timedelta()
    return by if by > grace else timedelta()


def _between(earlier: datetime, later: datetime) -> timedelta:
    """In absolute time: two times of one time zone are subtracted by its clocks otherwise."""
    return later.astimezone(timezone.utc) - earlier.astimezone(timezone.utc)


def _cost(points: float, rubric: Rubric, late: timedelta) -> tuple[float, str]:
    """Return the points that are left of a submission that is `late`, and the reason in plain English."""
    policy = rubric.late
    if policy is None:
        return points, f"{_span(late)} late; the rubric has no late policy, so nothing is lost"
    if policy.cut_off_days is not None and late > timedelta(days=policy.cut_off_days):
        return 0.0, f"{_span(late)} late, after the cut-off: nothing counts"
    begun = -(-late // UNITS[policy.per])
    # Decimals: three times 0.1 % is 0.3 %, and a half is rounded as people round it.
    summed, cap = begun * Decimal(repr(policy.lost)), Decimal(repr(policy.cap))
    percent = min(summed, cap)
    whole = points if policy.of == "reached" else rubric.max_points
    left = max(Decimal(0), Decimal(repr(points)) - Decimal(repr(whole)) * percent / 100)
    of = f"{points:g} points reached" if policy.of == "reached" else f"the rubric's {whole:g} points"
    share = f"{float(percent):g} %{' (no more can be lost)' if cap < summed else ''}"
    text = f"{plural(begun, policy.per)} late (begun {policy.per}s count): {share} of {of} are lost"
    return round_half_up(float(left), rubric.digits), text


def _in_time(given: HandedIn, deadline: datetime) -> str:
    if given.at is None:
        return UNDATED
    over = _between(deadline, given.at)
    if over > timedelta():
        return f"in time: {_span(over)} after the deadline, which is within the grace"
    if over > -timedelta(days=given.extension_days):
        return f"in time thanks to {plural(given.extension_days, 'day')} of extension"
    return "in time"


def _span(time: timedelta) -> str:
    """Return `2 days 3 hours`: the two largest units, what is less than a second as one."""
    left = max(1, int(time.total_seconds()))
    parts = []
    for unit, seconds in SPANS.items():
        number, left = divmod(left, seconds)
        parts += [plural(number, unit)] if number else []
    return " ".join(parts[:2])
