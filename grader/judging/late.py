"""What being late costs: pure arithmetic on absolute times. A day is 24 hours, whatever the clocks were set to."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from decimal import Decimal

from grader.judging.points import round_half_up
from grader.model.result import HandedIn, Lateness
from grader.rubric.model import Late, Rubric
from grader.wording import plural

UNITS = {"day": timedelta(days=1), "hour": timedelta(hours=1)}
SPANS = {"day": 86_400, "hour": 3600, "minute": 60, "second": 1}
NOBODY = "nobody says when it was handed in, so it counts as in time"


def deadline_of(rubric: Rubric, extension_days: float = 0.0) -> datetime | None:
    """The rubric's deadline with one submission's extension, in its time zone; None where the rubric has none."""
    if rubric.deadline is None:
        return None
    moved = rubric.deadline.astimezone(timezone.utc) + timedelta(days=extension_days)
    return moved.astimezone(rubric.deadline.tzinfo)


def lateness(points: float, rubric: Rubric, handed_in: HandedIn | None) -> Lateness | None:
    """What is left of `points`, and why. None where there is no deadline.

    The deadline is that of `handed_in`, which holds the extension already; where it has none, the rubric's with the
    extension. What nobody dates counts as in time.
    """
    given = handed_in or HandedIn()
    deadline = given.deadline or deadline_of(rubric, given.extension_days) or given.before
    if deadline is None:
        return None
    late = _late_by(given.at, deadline, rubric.late)
    left, text = _cost(points, rubric, late) if late else (points, _in_time(given, deadline))
    fields = {name: getattr(given, name) for name in HandedIn.model_fields}
    return Lateness(
        **{**fields, "deadline": deadline},
        late_s=late.total_seconds(),
        points_before=points,
        points=left,
        text=text,
    )


def _late_by(at: datetime | None, deadline: datetime, policy: Late | None) -> timedelta:
    """How much later than the deadline; nothing for what is in time, by grace too."""
    if at is None:
        return timedelta()
    by = _between(deadline, at)
    return by if by > _grace(policy) else timedelta()


def _between(earlier: datetime, later: datetime) -> timedelta:
    """In absolute time: two times of one time zone are subtracted by its clocks otherwise."""
    return later.astimezone(timezone.utc) - earlier.astimezone(timezone.utc)


def _grace(policy: Late | None) -> timedelta:
    return timedelta(minutes=policy.grace_minutes) if policy else timedelta()


def _cost(points: float, rubric: Rubric, late: timedelta) -> tuple[float, str]:
    """The points that are left of a submission that is `late`, and the reason in plain English."""
    policy = rubric.late
    if policy is None:
        return points, f"{_span(late)} late; the rubric has no late policy, so nothing is lost"
    if policy.cut_off_days is not None and late > timedelta(days=policy.cut_off_days):
        return 0.0, f"{_span(late)} late, after the cut-off: nothing counts"
    begun = -(-late // UNITS[policy.per])
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
        return NOBODY
    over = _between(deadline, given.at)
    if over > timedelta():
        return f"in time: {_span(over)} after the deadline, which is within the grace"
    if over > -timedelta(days=given.extension_days):
        return f"in time thanks to {plural(given.extension_days, 'day')} of extension"
    return "in time"


def _span(time: timedelta) -> str:
    """`2 days 3 hours`: the two largest units, what is less than a second as one."""
    left = max(1, int(time.total_seconds()))
    parts = []
    for unit, seconds in SPANS.items():
        number, left = divmod(left, seconds)
        parts += [plural(number, unit)] if number else []
    return " ".join(parts[:2])
