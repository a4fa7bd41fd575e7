"""The submissions of a class as the list shows them, read again when their files change; filter and search.

For marking without names: what they are called (`aliases`), and what is taken out of their texts (`Mask`).
"""

from __future__ import annotations

import json
import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.gradebook import GradebookRow
from grader.intake.names import safe_name
from grader.judging.settle import awarded
from grader.model.batch import MISSING, ROSTER, Entry
from grader.model.record import Record
from grader.model.result import GradingResult, Override, SubmissionInfo
from grader.model.verdict import Status
from grader.report.class_page.submissions import LEFT_OUT, WORDS, order, reduced, words_in
from grader.results import RESULT
from grader.untrusted_text import line

FILTERS = {
    "manual": "Waiting for points",
    "inconclusive": "Not decided yet",
    "error": "Errors",
    "changed": "Look again",
    "asked": "Requests",
    "all": "All",
}
FILTERS_OF_ONE = {
    "open": "Open",
    "lost": "Lost",
    "decided": "Decided",
    "changed": "Look again",
    "asked": "Requests",
    "all": "All",
}
"""Those of a list of one criterion across the class."""
ALL, ASKED, NOTED = "all", "asked", "noted"
"""The last one is not a filter: a person said something and left the points to the check."""
HASH_CHARS = (7, 8, 10, 12)  # to which git, GitHub and GitLab abbreviate a commit
KEPT = frozenset(
    {
        *("check", "criterion", "digest", "id", "kind", "scenario", "schema", "status", "rubric"),
        *("at", "before", "date", "deadline"),
    }
)
"""Keys whose values are the rubric's or the grader's own words, or times."""
_ADDRESS = re.compile(
    r"[\w.+-]{1,100}@[\w-]{1,100}(?:\.[\w-]{1,60}){0,6}(?::\S{1,200})?|\b(?:https?|ssh|git)://\S{1,300}"
)
Stamp = tuple[int, int, int] | None
T = TypeVar("T")
AnyRecord = TypeVar("AnyRecord", bound=Record)


@dataclass(frozen=True, kw_only=True)
class ListedCriterion:
    """What a list shows of one criterion of a submission; `kinds` are the filters that show it, `said` is what its
    check said. `diagnosis` is the same for what checks said alike, and empty where the check itself awards the points.
    `waits` says whether it would be open without a decision."""

    status: Status
    points: float
    full: float
    kinds: frozenset[str]
    diagnosis: str
    said: str
    author: str
    waits: bool


@dataclass(frozen=True, kw_only=True)
class ListedSubmission:
    """One submission in the list. `key` names its folder and stands in addresses, `kinds` are the filters that show it,
    `open` counts the criteria that no one has decided, by status; `lines` has what is to be said of each criterion,
    and `decided` names those that a person has decided as the result says.
    `alias` stands in place of its id and names while these are hidden."""

    key: str
    entry: Entry
    status: str
    points: float
    max_points: float
    open: tuple[tuple[Status, int], ...]
    kinds: frozenset[str]
    late: bool
    gradable: bool
    lines: Mapping[str, ListedCriterion]
    decided: frozenset[str]
    alias: str = ""

    @property
    def address(self) -> str:
        """What it is called in addresses."""
        return self.alias or self.key

    @property
    def title(self) -> str:
        """What it is called in pages."""
        return self.alias.replace("-", " ").capitalize() or self.entry.id

    @property
    def name(self) -> str:
        """Whose it is; empty where names are hidden."""
        return "" if self.alias else self.entry.name

    @property
    def group(self) -> str:
        """The group's name; empty where names are hidden."""
        return "" if self.alias else self.entry.group

    @property
    def state(self) -> tuple[str, str]:
        """A status for its colour, and in words what is to be done with it."""
        if self.status == "inconclusive":
            return (
                ("manual", "waiting for points")
                if self.kinds == {"manual", ALL}
                else ("inconclusive", "not decided yet")
            )
        return {"missing": ("blocked", "not graded yet"), "error": ("error", "not graded")}.get(
            self.status, ("pass", "graded")
        )

    def kinds_of(self, criterion: str) -> frozenset[str]:
        """Return the filters that show it, in the list of one criterion where there is one."""
        if not criterion:
            return self.kinds
        one = self.lines.get(criterion)
        return one.kinds if one else frozenset()

    def with_requests(self, waiting: Collection[str]) -> ListedSubmission:
        """Return it with the criteria about which its student asks and has no answer."""
        lines = {
            name: replace(self.lines[name], kinds=self.lines[name].kinds | {ASKED})
            for name in waiting
            if name in self.lines
        }
        return replace(self, kinds=self.kinds | {ASKED}, lines={**self.lines, **lines}) if waiting else self

    def with_decisions(self, decided: Mapping[str, Override]) -> ListedSubmission:
        """Return it as the list shows it with these decisions, which its result may not have yet."""
        changed = {}
        with_points = {name: one for name, one in decided.items() if one.awards}
        for name in (self.decided ^ with_points.keys()) & self.lines.keys():
            one, now = self.lines[name], with_points.get(name)
            kinds = one.kinds - {"open", "decided", "changed"} | ({"decided"} if now else set())
            kinds |= {"open"} if one.waits and not now else set()
            changed[name] = replace(one, kinds=kinds, author=now.author if now else "")
        for name in (decided.keys() - with_points.keys()) & self.lines.keys():
            one = changed.get(name, self.lines[name])
            changed[name] = replace(one, kinds=one.kinds | {NOTED})
        return replace(self, lines={**self.lines, **changed}) if changed else self

    def fits(self, kind: str, words: str, criterion: str = "") -> bool:
        """Return whether a filter shows it and its id, name or group has these words."""
        shown = kind in self.kinds_of(criterion)
        return shown and words.casefold() in f"{self.title} {self.name} {self.group}".casefold()


class Remembered(Generic[T]):
    """What was made of something last, for as long as that is the same. Safe to use from several threads."""

    def __init__(self) -> None:
        self._found: tuple[object, T] | None = None

    def get(self, made_of: object, make: Callable[[], T]) -> T:
        """Return what `make` made of this, calling it where that was something else."""
        found = self._found
        if found is None or found[0] != made_of:
            found = self._found = (made_of, make())
        return found[1]


class Submissions:
    """All of a class in the roster's order. Safe to use from several threads."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._run = Remembered[tuple[BatchFolder, Mapping[str, BatchFolder]]]()
        self._items = defaultdict[str, Remembered[ListedSubmission]](Remembered)

    def batch(self) -> BatchFolder:
        """Return the batch's folder as `run.json` says now. Raises UsageError where that cannot be read."""
        return self._read()[0]

    def items(self) -> tuple[ListedSubmission, ...]:
        """Return every submission; those that the roster itself keeps from being graded come last."""
        return tuple(self._item(key, one) for key, one in self._read()[1].items())

    def item(self, key: str) -> ListedSubmission | None:
        """Return the submission of that folder; None where the class has none."""
        one = self._read()[1].get(key)
        return self._item(key, one) if one else None

    def row(self, key: str) -> GradebookRow | None:
        """Return the same with its result; one of status `error` stands for a result that is not there."""
        one = self._read()[1].get(key)
        return next(one.rows()) if one else None

    def _read(self) -> tuple[BatchFolder, Mapping[str, BatchFolder]]:
        """Return the batch, and by its key each submission as if there were no other."""

        def read() -> tuple[BatchFolder, Mapping[str, BatchFolder]]:
            batch = open_batch(self.path)
            return batch, dict(_each(batch))

        return self._run.get(stamp_of(self.path / RUN), read)

    def _item(self, key: str, one: BatchFolder) -> ListedSubmission:
        run = one.run
        made_of = (stamp_of(f"{self.path}/{key}/{RESULT}"), run.entries, run.faults, run.rubric)
        return self._items[key].get(made_of, lambda: item_of(next(one.rows())))


def _each(batch: BatchFolder) -> Iterator[tuple[str, BatchFolder]]:
    """Yield for each submission its key, and the batch as if it had no other."""
    run = batch.run
    ones: list[tuple[str, dict[str, Any]]] = [
        *((entry.id, {"entries": (entry,), "faults": ()}) for entry in run.entries),
        *((fault.id, {"entries": (), "faults": (fault,)}) for fault in run.faults if fault.id is not None),
    ]
    known: set[str] = set()
    # two ids that differ in capitals have one folder
    for name, update in ones:
        key = safe_name(name)
        if key.casefold() not in known:
            known.add(key.casefold())
            yield key, BatchFolder(batch.path, run.model_copy(update=update))


def item_of(row: GradebookRow) -> ListedSubmission:
    """Return what the list shows of a submission."""
    result = row.result
    waiting = {
        status: sum(c.status is status and c.counts for c in result.criteria)
        for status in (Status.MANUAL, Status.INCONCLUSIVE, Status.ERROR)
    }
    kind = result.error.kind if result.error else ""
    return ListedSubmission(
        key=safe_name(row.entry.id),
        entry=row.entry,
        status="missing" if kind == MISSING else result.status,
        points=result.points,
        max_points=result.max_points,
        open=tuple((status, count) for status, count in waiting.items() if count and not result.error),
        kinds=_kinds(result, waiting),
        late=result.late is not None and result.late.late_s > 0,
        gradable=kind not in {MISSING, ROSTER},
        lines=_lines(result),
        decided=frozenset(awarded(result.overrides)),
    )


_diagnosis = lru_cache(maxsize=20_000)(reduced)


def _lines(result: GradingResult) -> dict[str, ListedCriterion]:
    """Return what is to be said of each criterion; of what could not be graded, only what a person has decided."""
    decided = awarded(result.overrides)
    found = {}
    for criterion in result.criteria:
        by = decided.get(criterion.id)
        if result.error is not None and by is None and criterion.status is not Status.MANUAL:
            continue
        kinds = {
            "open": by is None and criterion.status.is_open and criterion.counts,
            "lost": criterion.status.is_lost,
            "decided": by is not None,
            "changed": by is not None and by.changed,
            ALL: True,
        }
        automatic = by.automatic if by else criterion
        said = line(automatic.message, SAID_CHARS)
        waits = automatic.status.is_open and criterion.counts
        is_lost_or_waits = automatic.status.is_lost or waits
        found[criterion.id] = ListedCriterion(
            status=criterion.status,
            points=criterion.points,
            full=criterion.full,
            kinds=frozenset(kind for kind, holds in kinds.items() if holds),
            diagnosis=f"{automatic.status.value}: {_diagnosis(said)}" if is_lost_or_waits else "",
            said=said,
            author=by.author if by else "",
            waits=waits,
        )
    return found


def _kinds(result: GradingResult, waiting: dict[Status, int]) -> frozenset[str]:
    found = {
        "manual": waiting[Status.MANUAL],
        "inconclusive": waiting[Status.INCONCLUSIVE],
        "error": result.status == "error" or waiting[Status.ERROR],
        "changed": any(override.changed for override in result.overrides),
        ALL: True,
    }
    return frozenset(kind for kind, holds in found.items() if holds)


def stamp_of(path: Path | str) -> Stamp:
    """Return what is another one once the file is another one; None where there is none."""
    try:
        found = os.stat(path)  # noqa: PTH116 - a thousand paths for each page
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


WORDS_CHARS = 100
SAID_CHARS = 300
PAGE = 100
"""Rows of one page of the list; a browser takes longer to lay out a thousand than anybody wants to wait."""


@dataclass(frozen=True, kw_only=True)
class Navigation:
    """`shown` are the submissions that the filter `kind` and the words `q` show, `counts` how many each filter has.

    `before` and `after` are the addresses of the neighbours of the submission one is at, empty where there is none; it
    need not be shown itself, as it may have left the filter by what was decided. `position` counts from 1, 0 for that.
    `page` counts from 1 too: the one that is asked for, or the one on which the submission is.
    """

    kind: str
    q: str
    criterion: str
    shown: Sequence[ListedSubmission]
    counts: Mapping[str, int]
    total: int
    before: str = ""
    after: str = ""
    position: int = 0
    page: int = 1

    @property
    def pages(self) -> int:
        """How many pages the list has."""
        return _pages(self.shown)

    @property
    def first(self) -> int:
        """The place of the page's first row in the whole list, counted from 0."""
        return (self.page - 1) * PAGE

    @property
    def rows(self) -> Sequence[ListedSubmission]:
        """The submissions of the page."""
        return self.shown[self.first : self.first + PAGE]

    @property
    def kept(self) -> dict[str, Any]:
        """What addresses carry so that one stays in the same list."""
        given = {"c": self.criterion, "show": "" if self.kind == ALL else self.kind, "q": self.q}
        return {name: value for name, value in given.items() if value}

    @property
    def filters(self) -> Mapping[str, str]:
        """The filters that there are, with what they are called."""
        return FILTERS_OF_ONE if self.criterion else FILTERS


def place_of(items: Sequence[ListedSubmission], asked: Mapping[str, str], *, at: str = "") -> Navigation:
    """Return the place that an address or a form asks for; what it asks for and is not known is left out."""
    criterion = asked.get("c", "")
    criterion = criterion if any(criterion in item.lines for item in items) else ""
    filters = FILTERS_OF_ONE if criterion else FILTERS
    kind = asked.get("show", ALL)
    kind = kind if kind in filters else ALL
    q = asked.get("q", "").strip()[:WORDS_CHARS]
    shown = [item for item in items if item.fits(kind, q, criterion)]
    here = next((i for i, item in enumerate(items) if item.key == at), -1)
    ahead = {item.key for item in items[:here]} if here > 0 else set()
    left = [item.address for item in shown if item.key in ahead]
    # the submission itself may have left the filter by what was decided, so its neighbours are found by the
    # whole list
    right = [item.address for item in shown if item.key not in ahead and item.key != at]
    asked_page = asked.get("page", "")
    page = int(asked_page) if re.fullmatch(r"[0-9]{1,6}", asked_page) else 1
    page = len(left) // PAGE + 1 if here >= 0 else max(1, page)
    return Navigation(
        kind=kind,
        q=q,
        criterion=criterion,
        shown=shown,
        counts=Counter(kind for item in items for kind in item.kinds_of(criterion)),
        total=len(items),
        before=left[-1] if left else "",
        after=right[0] if right else "",
        position=len(left) + 1 if any(item.key == at for item in shown) else 0,
        page=min(page, _pages(shown)),
    )


def _pages(shown: Sequence[ListedSubmission]) -> int:
    return max(1, -(-len(shown) // PAGE))


@dataclass(frozen=True, kw_only=True)
class Across:
    """One criterion across the class: how many submissions each filter has, and the address of the first open one,
    empty where none is open."""

    id: str
    title: str
    counts: Mapping[str, int]
    first: str


def across(items: Sequence[ListedSubmission], criteria: Iterable[tuple[str, str]]) -> list[Across]:
    """Return this of each of these criteria (id, title), those with most open ones first."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    first: dict[str, str] = {}
    for item in items:
        for name, one in item.lines.items():
            counts[name].update(one.kinds)
            if "open" in one.kinds:
                first.setdefault(name, item.address)
    found = [
        Across(id=name, title=title, counts=counts[name], first=first.get(name, ""))
        for name, title in criteria
    ]
    return sorted(found, key=lambda one: -one.counts["open"])


def alike(items: Iterable[ListedSubmission], criterion: str, to: ListedSubmission) -> list[ListedSubmission]:
    """Return that submission, and all others whose check said the same of the criterion and about which no person has
    said anything. None where the check itself awards the points."""
    diagnosis = to.lines[criterion].diagnosis if criterion in to.lines else ""
    if not diagnosis:
        return []
    lines = ((item, item.lines.get(criterion)) for item in items)
    return [
        item
        for item, one in lines
        if one
        and one.diagnosis == diagnosis
        and (one.kinds.isdisjoint({"decided", NOTED}) or item.key == to.key)
    ]


# ---- marking without names


def aliases(ids: Sequence[str], salt: bytes) -> dict[str, str]:
    """Return what each submission is called in addresses, by its id, in an order that depends on `salt` alone."""
    return {ids[place]: f"submission-{number}" for number, place in enumerate(order(ids, salt), start=1)}


@dataclass(frozen=True)
class Mask:
    """Takes `words`, mail addresses and repositories out of texts."""

    words: frozenset[str]

    def text(self, text: str) -> str:
        """Return the text with `…` for each of them."""
        found = _ADDRESS.sub(LEFT_OUT, text)
        return WORDS.sub(lambda word: LEFT_OUT if word[0].casefold() in self.words else word[0], found)

    def record(self, record: AnyRecord) -> AnyRecord | None:
        """Return the record with all its texts so; None where nothing sound is left of it."""
        data = self._data(record.model_dump(mode="json", by_alias=True))
        try:
            return type(record).model_validate_json(json.dumps(data))
        except ValidationError:
            return None

    def result(self, result: GradingResult, title: str) -> GradingResult | None:
        """Return the result under another name."""
        info = SubmissionInfo.unopened(title, package=self.text(result.submission.package))
        return self.record(result.model_copy(update={"submission": info}))

    def _data(self, data: Any) -> Any:  # noqa: ANN401 - JSON
        if isinstance(data, str):
            return self.text(data)
        if isinstance(data, Mapping):
            return {key: value if key in KEPT else self._data(value) for key, value in data.items()}
        return [self._data(item) for item in data] if isinstance(data, list) else data


def mask_of(entry: Entry, commit: str, common: frozenset[str]) -> Mask:
    """Return the mask of one submission: words of its id, name and commit, and of its source those that are not
    `common` to the class."""
    hashes = [commit[:chars] for chars in HASH_CHARS]
    own = frozenset(words_in(entry.id, entry.name, commit, *hashes))
    return Mask(own | (frozenset(words_in(entry.source, entry.ref or "")) - common))
