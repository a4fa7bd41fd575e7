"""Where in the class one is: the filter, the words that are looked for, and what comes before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grader.classes.review.submissions import ALL, FILTERS, Item

WORDS_CHARS = 100


@dataclass(frozen=True, kw_only=True)
class Place:
    """`shown` are the submissions that the filter `kind` and the words `q` show, `counts` how many each filter has.

    `before` and `after` are the keys of the neighbours of the submission one is at, empty where there is none; it need
    not be shown itself, as it may have left the filter by what was decided. `position` counts from 1, 0 for that.
    """

    kind: str
    q: str
    shown: Sequence[Item]
    counts: Mapping[str, int]
    total: int
    before: str = ""
    after: str = ""
    position: int = 0

    @property
    def kept(self) -> dict[str, Any]:
        """What addresses carry so that one stays in the same list."""
        given = {"show": "" if self.kind == ALL else self.kind, "q": self.q}
        return {name: value for name, value in given.items() if value}


def place_of(items: Sequence[Item], asked: Mapping[str, str], *, at: str = "") -> Place:
    """The place that an address or a form asks for; what it asks for and is not known is left out."""
    kind = asked.get("show", ALL)
    kind = kind if kind in FILTERS else ALL
    q = asked.get("q", "").strip()[:WORDS_CHARS]
    shown = [item for item in items if item.fits(kind, q)]
    here = next((i for i, item in enumerate(items) if item.key == at), -1)
    ahead = {item.key for item in items[:here]} if here > 0 else set()
    left = [item.key for item in shown if item.key in ahead]
    right = [item.key for item in shown if item.key not in ahead and item.key != at]
    return Place(
        kind=kind,
        q=q,
        shown=shown,
        counts={name: sum(name in item.kinds for item in items) for name in FILTERS},
        total=len(items),
        before=left[-1] if left else "",
        after=right[0] if right else "",
        position=len(left) + 1 if any(item.key == at for item in shown) else 0,
    )
