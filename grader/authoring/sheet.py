"""A rubric in the making: scenarios, criteria, points that add up, notes for its author."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from grader.rubric.consistency import TOTAL_POINTS

WEIGHTS = {
    "manifest": 1, "cmake": 1, "build": 1, "executable": 1, "node-lives": 1, "node-name": 1, "topic-type": 2, "rate": 3,
    "counter-start": 1, "counter-step": 1, "counter-wrap": 3, "message": 1, "hears": 2, "service": 2, "latched": 1,
    "cmake-install": 2, "launch-xml": 2, "launch-runs": 2,
}  # fmt: skip

Entry = dict[str, Any]


class Sheet:
    """Collects the parts of a rubric. `notes` are for the author: what was seen and is not covered."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.scenarios: dict[str, Entry] = {}
        self.criteria: list[Entry] = []

    def add(self, id_: str, title: str, check: str, parameters: Entry, **more: object) -> str:
        """Add a criterion without points and return its id, numbered where it is taken."""
        taken = {c["id"] for c in self.criteria}
        name = next(n for n in (id_, *(f"{id_}-{i}" for i in range(2, 100))) if n not in taken)
        entry = {"id": name, "title": title, "points": 0, "check": check}
        self.criteria.append(
            entry | ({"with": parameters} if parameters else {}) | {k: v for k, v in more.items() if v}
        )
        return name


def given(**lists: list[str]) -> Entry:
    """Those that hold something."""
    return {name: items for name, items in lists.items() if items}


def share_out(criteria: list[Entry]) -> None:
    """Points by weight, whole numbers, the largest remainders rounded up: together 100."""
    weights = [WEIGHTS.get(c["check"], 1) for c in criteria]
    exact = [TOTAL_POINTS * w / sum(weights) for w in weights]
    for criterion, points in zip(criteria, exact, strict=True):
        criterion["points"] = int(points)
    order = sorted(range(len(exact)), key=lambda i: (int(exact[i]) - exact[i], i))
    for index in order[: TOTAL_POINTS - sum(c["points"] for c in criteria)]:
        criteria[index]["points"] += 1


def plain(number: float) -> float | int:
    return int(number) if number == int(number) else number


def label_of(name: str) -> str:
    """A criterion's id from a topic or service: letters, digits and hyphens."""
    letters: Iterator[str] = (c if c.isalnum() and c.isascii() else "-" for c in name.lower())
    label = "-".join(part for part in "".join(letters).split("-") if part)
    return label if label[:1].isalpha() else f"t-{label}"
