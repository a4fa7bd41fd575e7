"""Which criterion cost most."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from grader.model.batch import CriterionInfo
from grader.report.class_page.lines import Line


@dataclass(kw_only=True)
class Cost:
    """What one criterion cost all submissions that were judged. `partly`, `failed` and `blocked` count them; `open`
    those whose points are not settled yet."""

    place: int
    criterion: CriterionInfo
    judged: int = 0
    points: float = 0.0
    partly: int = 0
    failed: int = 0
    blocked: int = 0
    open: int = 0

    @property
    def lost(self) -> int:
        """How many submissions lost points by it, or would have if it were worth any."""
        return self.partly + self.failed + self.blocked

    @property
    def share(self) -> float:
        """How many of those that were judged, in percent."""
        return 100 * self.lost / self.judged if self.judged else 0.0


def costs(lines: Iterable[Line], criteria: Sequence[CriterionInfo]) -> list[Cost]:
    """Of each criterion, in the rubric's order."""
    found = [Cost(place=place, criterion=criterion) for place, criterion in enumerate(criteria)]
    for line in lines:
        if line.judged:
            for cost in found:
                _add(cost, line)
    return found


def most_first(found: Iterable[Cost]) -> list[Cost]:
    """Those that cost anything: most points first, then what most submissions lost."""
    return sorted(
        (cost for cost in found if cost.lost), key=lambda cost: (-cost.points, -cost.lost, cost.place)
    )


def _add(cost: Cost, line: Line) -> None:
    letter = line.letters[cost.place]
    if letter == "n":
        return
    cost.judged += 1
    cost.partly += letter == "a"
    cost.failed += letter == "f"
    cost.blocked += letter == "b"
    cost.open += letter in "iem"
    if letter in "afb":
        most = cost.criterion.max_points
        cost.points += max(0.0, most - line.points_of(cost.place, most))
