"""The submissions of a class as the list shows them, read again when their files change; filter and search."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.gradebook import Row
from grader.intake import safe_name
from grader.model.batch import MISSING, ROSTER, Entry
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.results import RESULT

FILTERS = {
    "manual": "Waiting for points",
    "inconclusive": "Inconclusive",
    "error": "Errors",
    "changed": "Look again",
    "all": "All",
}
ALL = "all"
Stamp = tuple[int, int, int] | None


@dataclass(frozen=True, kw_only=True)
class Item:
    """One submission in the list. `key` names its folder and stands in addresses, `kinds` are the filters that show it,
    `open` counts the criteria that no one has decided, by status."""

    key: str
    entry: Entry
    status: str
    points: float
    max_points: float
    open: tuple[tuple[Status, int], ...]
    kinds: frozenset[str]
    late: bool
    gradable: bool

    @property
    def state(self) -> tuple[str, str]:
        """A status for its colour, and in words what is to be done with it."""
        if self.status == "inconclusive":
            return (
                ("manual", "waiting for points")
                if self.kinds == {"manual", ALL}
                else ("inconclusive", "inconclusive")
            )
        return {"missing": ("blocked", "not graded yet"), "error": ("error", "not graded")}.get(
            self.status, ("pass", "graded")
        )

    def fits(self, kind: str, words: str) -> bool:
        """Return whether a filter shows it and its id, name or group has these words."""
        entry = self.entry
        return kind in self.kinds and words.casefold() in f"{entry.id} {entry.name} {entry.group}".casefold()


class Submissions:
    """All of a class in the roster's order. Safe to use from several threads."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._run: tuple[Stamp, BatchFolder] | None = None
        self._items: dict[str, tuple[object, Item]] = {}

    def batch(self) -> BatchFolder:
        """Return the batch's folder as `run.json` says now. Raises UsageError where that cannot be read."""
        stamp = stamp_of(self.path / RUN)
        with self._lock:
            if self._run is None or self._run[0] != stamp:
                self._run = (stamp, open_batch(self.path))
            return self._run[1]

    def items(self) -> tuple[Item, ...]:
        """Every submission; those that the roster itself keeps from being graded come last."""
        return tuple(self._item(batch) for batch in _each(self.batch()))

    def item(self, key: str) -> Item | None:
        """Return the submission of that folder; None where the class has none."""
        found = self._one(key)
        return self._item(found) if found else None

    def row(self, key: str) -> Row | None:
        """Return the same with its result; one of status `error` stands for a result that is not there."""
        found = self._one(key)
        return next(found.rows()) if found else None

    def _one(self, key: str) -> BatchFolder | None:
        return next((one for one in _each(self.batch()) if _key(one) == key), None)

    def _item(self, one: BatchFolder) -> Item:
        key = _key(one)
        run = one.run
        made_of = (stamp_of(self.path / key / RESULT), run.entries, run.faults, run.rubric)
        with self._lock:
            found = self._items.get(key)
        if found is None or found[0] != made_of:
            found = (made_of, item_of(next(one.rows())))
            with self._lock:
                self._items[key] = found
        return found[1]


def _each(batch: BatchFolder) -> Iterator[BatchFolder]:
    """The batch as if it had one submission only, for each of them."""
    run = batch.run
    ones: list[tuple[str, dict[str, Any]]] = [
        *((entry.id, {"entries": (entry,), "faults": ()}) for entry in run.entries),
        *((fault.id, {"entries": (), "faults": (fault,)}) for fault in run.faults if fault.id is not None),
    ]
    known: set[str] = set()
    for name, update in ones:
        if safe_name(name).casefold() not in known:
            known.add(safe_name(name).casefold())
            yield BatchFolder(batch.path, run.model_copy(update=update))


def _key(one: BatchFolder) -> str:
    names = [*(entry.id for entry in one.run.entries), *(fault.id or "" for fault in one.run.faults)]
    return safe_name(names[0])


def item_of(row: Row) -> Item:
    """What the list shows of a submission."""
    result = row.result
    waiting = {
        status: sum(c.status is status and c.counts for c in result.criteria)
        for status in (Status.MANUAL, Status.INCONCLUSIVE, Status.ERROR)
    }
    kind = result.error.kind if result.error else ""
    return Item(
        key=safe_name(row.entry.id),
        entry=row.entry,
        status="missing" if kind == MISSING else result.status,
        points=result.points,
        max_points=result.max_points,
        open=tuple((status, count) for status, count in waiting.items() if count and not result.error),
        kinds=_kinds(result, waiting),
        late=result.late is not None and result.late.late_s > 0,
        gradable=kind not in {MISSING, ROSTER},
    )


def _kinds(result: GradingResult, waiting: dict[Status, int]) -> frozenset[str]:
    found = {
        "manual": waiting[Status.MANUAL],
        "inconclusive": waiting[Status.INCONCLUSIVE],
        "error": result.status == "error" or waiting[Status.ERROR],
        "changed": any(override.changed for override in result.overrides),
        ALL: True,
    }
    return frozenset(kind for kind, holds in found.items() if holds)


def stamp_of(path: Path) -> Stamp:
    """Another one once the file is another one; None where there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


WORDS_CHARS = 100


@dataclass(frozen=True, kw_only=True)
class Navigation:
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


def place_of(items: Sequence[Item], asked: Mapping[str, str], *, at: str = "") -> Navigation:
    """Return the place that an address or a form asks for; what it asks for and is not known is left out."""
    kind = asked.get("show", ALL)
    kind = kind if kind in FILTERS else ALL
    q = asked.get("q", "").strip()[:WORDS_CHARS]
    shown = [item for item in items if item.fits(kind, q)]
    here = next((i for i, item in enumerate(items) if item.key == at), -1)
    ahead = {item.key for item in items[:here]} if here > 0 else set()
    left = [item.key for item in shown if item.key in ahead]
    right = [item.key for item in shown if item.key not in ahead and item.key != at]
    return Navigation(
        kind=kind,
        q=q,
        shown=shown,
        counts={name: sum(name in item.kinds for item in items) for name in FILTERS},
        total=len(items),
        before=left[-1] if left else "",
        after=right[0] if right else "",
        position=len(left) + 1 if any(item.key == at for item in shown) else 0,
    )
