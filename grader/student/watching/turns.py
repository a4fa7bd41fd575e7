"""What is better and what is worse than in the result before. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status


@dataclass(frozen=True, kw_only=True)
class Turns:
    """Criteria that are worth points: `reached` has all now, `lost` had all, `more` and `less` have others than before;
    `open` could be judged before and cannot be now."""

    reached: tuple[CriterionResult, ...] = ()
    more: tuple[CriterionResult, ...] = ()
    less: tuple[CriterionResult, ...] = ()
    lost: tuple[CriterionResult, ...] = ()
    open: tuple[CriterionResult, ...] = ()

    def __bool__(self) -> bool:
        return any((self.reached, self.more, self.less, self.lost, self.open))


FIELDS = ("reached", "more", "less", "lost", "open")


def turns(before: GradingResult | None, after: GradingResult) -> Turns:
    """The difference; none where there is nothing to compare."""
    known = {c.id: c for c in before.criteria} if before is not None else {}
    found: dict[str, list[CriterionResult]] = {name: [] for name in FIELDS}
    for criterion in after.criteria:
        earlier = known.get(criterion.id)
        if earlier is not None and criterion.max_points > 0:
            name = _turn(earlier, criterion)
            if name:
                found[name].append(criterion)
    return Turns(**{name: tuple(criteria) for name, criteria in found.items()})


def _turn(before: CriterionResult, after: CriterionResult) -> str:
    if after.status.is_retryable:
        return "" if before.status.is_retryable else "open"
    had, has = before.status is Status.PASS, after.status is Status.PASS
    if has != had:
        return "reached" if has else "lost"
    if after.points == before.points:
        return ""
    return "more" if after.points > before.points else "less"
