"""What people decided and what being late cost, in the words of the reports."""

from __future__ import annotations

from datetime import datetime

from grader.model.result import AppliedOverride, Automatic, CriterionResult, GradingResult, HandedIn
from grader.wording import number, plural

TITLE = "Decided by a person"
BY = {"roster": "as the roster says", "commit": "the commit's date", "nobody": "nobody says it"}


def late_words(result: GradingResult) -> tuple[str, ...]:
    """Lines that say what being late cost, when it was handed in, and which commit counts; none where nobody asked."""
    late, known = result.late, result.late or result.handed_in
    if known is None:
        return ()
    cost = late.text if late else ""
    if late and late.points != late.points_before:
        before = f"{number(late.points_before)} of {number(result.max_points)} points before"
        cost = f"{before}, {number(late.points)} after: {late.text}"
    return tuple(words[:1].upper() + words[1:] for words in (cost, _times(known), known.note) if words)


def _times(known: HandedIn) -> str:
    zone = (known.deadline or known.at).tzinfo if known.at else None
    at = f"handed in {_time(known.at.astimezone(zone))} ({BY[known.by]})" if known.at else ""
    days = known.extension_days
    extension = f" with {plural(days, 'day')} of extension" if days else ""
    deadline = f"deadline {_time(known.deadline)}{extension}" if known.deadline else ""
    return ", ".join(words for words in (at, deadline) if words)


def _time(time: datetime) -> str:
    """`2026-11-20 23:59 UTC+01:00`; seconds only where there are any."""
    clock = f"{time:%Y-%m-%d %H:%M:%S}".removesuffix(":00")
    offset = f"{time:%z}"
    return f"{clock} UTC{offset[:3]}:{offset[3:5]}"


def decision(override: AppliedOverride) -> str:
    """`by A. Miller, 2026-11-02: clear names`, as far as it is known."""
    who = ", ".join(part for part in (override.author or "a person", str(override.date or "")) if part)
    return f"by {who}{': ' if override.comment else ''}{override.comment}"


def automatic_words(override: AppliedOverride, criterion: CriterionResult) -> str:
    """`fail 0/10: 5 Hz, not 10 Hz`."""
    message = override.automatic.message
    return _said(override.automatic, criterion) + (f": {message}" if message else "")


def look_again(override: AppliedOverride, criterion: CriterionResult) -> str:
    """Why a person should look again; empty where the check says what it said then."""
    if not override.changed:
        return ""
    now, then = _said(override.automatic, criterion), _said(override.was, criterion)
    return f"the check now says {now}, it said {then} when this was decided: look again"


def _said(automatic: Automatic, criterion: CriterionResult) -> str:
    return f"{automatic.status.value} {number(automatic.points)}/{number(criterion.max_points)}"


def decided(result: GradingResult) -> list[tuple[AppliedOverride, CriterionResult]]:
    """What was decided about which criterion, in the rubric's order."""
    by_id = {criterion.id: criterion for criterion in result.criteria}
    return [
        (override, by_id[override.criterion]) for override in result.overrides if override.criterion in by_id
    ]
