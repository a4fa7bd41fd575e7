"""What was found becomes a roster: ids that no two have, and a record for each fault."""

from __future__ import annotations

import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.intake.names import brief, encodable, safe_name
from grader.model.batch import Entry, Roster, RosterFault

ID_BYTES_MAX = 255


@dataclass(frozen=True, kw_only=True)
class Found:
    """One submission, or what was meant for one. `id` is empty where it has none, `entry` None where it has faults."""

    where: str
    id: str = ""
    entry: Entry | None = None
    faults: tuple[str, ...] = ()


def gather(file: Path, found: Sequence[Found], *, columns: tuple[str, ...] = ()) -> Roster:
    """The first of those that share an id stays; each later one is a fault that says where the first is."""
    times = Counter(_key(one.id) for one in found)
    first: dict[str, str] = {}
    entries, faults = [], []
    for one in found:
        key = _key(one.id)
        wrong = [*one.faults, *id_faults(one.id)]
        if key and key in first:
            wrong.append(f"id: {brief(one.id)} is there already, in {first[key]}")
        first.setdefault(key, one.where)
        own = one.id if key and times[key] == 1 and not any(id_faults(one.id)) else None
        faults += [RosterFault(where=one.where, id=own, text=text) for text in wrong]
        if not wrong and one.entry is not None:
            entries.append(one.entry)
    return Roster(file=str(file), entries=tuple(entries), columns=columns, faults=tuple(faults))


def id_faults(submission_id: str) -> Iterator[str]:
    """Why `submission_id` can name no folder of results; nothing for an empty one, which is a fault of its own."""
    if not submission_id:
        return
    if not encodable(submission_id):
        yield f"id: {brief(submission_id)} is no text"
    elif any(unicodedata.category(sign) in {"Cc", "Zl", "Zp"} for sign in submission_id):
        yield f"id: {brief(submission_id)} has a line end or a control character in it"
    elif not any(sign.isalnum() for sign in submission_id):
        yield f"id: {brief(submission_id)} has no letter and no digit"
    elif len(submission_id.encode()) > ID_BYTES_MAX:
        yield f"id: {brief(submission_id)} is longer than a file's name may be ({ID_BYTES_MAX} bytes)"


def columns_of(entries: Iterable[Entry | None]) -> tuple[str, ...]:
    """The names of all further columns, in the order in which they turn up."""
    return tuple(dict.fromkeys(name for entry in entries if entry for name in entry.extra))


def _key(submission_id: str) -> str:
    """Two ids that would share one folder of results are one, on file systems that take `A` for `a`, too."""
    return safe_name(submission_id).casefold() if submission_id else ""
