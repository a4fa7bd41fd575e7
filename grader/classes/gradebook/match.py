"""Which row of a platform's export is whose: only where there is no doubt."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from grader.classes.gradebook.identity import Identity, plain


@dataclass(frozen=True, kw_only=True)
class Matched:
    """`rows` gives the row of each submission, by their places; `doubtful` says why others have none."""

    rows: dict[int, int]
    doubtful: dict[int, str]


def match(ours: Sequence[Identity], theirs: Sequence[Identity]) -> Matched:
    """By what belongs to one person only, and where nothing of that is known on one side, by name."""
    by_sure, by_name = defaultdict[tuple[str, str], set[int]](set), defaultdict[str, set[int]](set)
    for place, identity in enumerate(theirs):
        for sure in identity.sure:
            by_sure[sure].add(place)
        if identity.name:
            by_name[identity.name].add(place)
    found = {}
    for place, identity in enumerate(ours):
        rows = set().union(*(by_sure.get(sure, set()) for sure in identity.sure))
        found[place] = rows or by_name.get(identity.name, set())
        found[place] = {row for row in found[place] if not _contradict(identity, theirs[row])}
    wanted = defaultdict[int, list[int]](list)
    for place, rows in found.items():
        for row in rows:
            wanted[row].append(place)
    doubtful = {place: why for place, rows in found.items() if (why := _doubt(rows, wanted))}
    return Matched(
        rows={place: next(iter(rows)) for place, rows in found.items() if place not in doubtful},
        doubtful=doubtful,
    )


def _contradict(ours: Identity, theirs: Identity) -> bool:
    """Whether only the platform's number says so, and the names have nothing in common: Moodle numbers teams too."""
    if not (ours.name and theirs.name) or any(kind != "platform" for kind, _ in ours.sure & theirs.sure):
        return False
    name = plain(ours.name)
    return not any(plain(word) in name for word in theirs.name.split() if len(word) > 1)


def _doubt(rows: set[int], wanted: dict[int, list[int]]) -> str:
    if not rows:
        return "nobody there has this id, number, login, address or name"
    if len(rows) > 1:
        return f"{len(rows)} rows there could be this student"
    (row,) = rows
    return "another submission fits the same row" if len(wanted[row]) > 1 else ""
