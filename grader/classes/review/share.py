"""Which submissions of a class one marker has: a share by their ids, or a group."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from grader.classes.review.session import reviewing
from grader.errors import UsageError
from grader.files import atomic_write
from grader.model.batch import Entry
from grader.wording import join_words

FILE = "markers.json"


@dataclass(frozen=True, kw_only=True)
class Share:
    """`number` of `of` shares, counted from 0, and of these only the submissions of `group`, where it is given."""

    number: int = 0
    of: int = 1
    group: str | None = None

    def __call__(self, entry: Entry) -> bool:
        """Return whether the submission is among them. It stays so when others join the class."""
        digest = hashlib.sha256(entry.id.encode("utf-8", "surrogatepass")).digest()
        mine = int.from_bytes(digest[:8], "big") % self.of == self.number
        return mine and (self.group is None or entry.group == self.group)


Shown = Callable[[Entry], bool]


def share_of(folder: Path, marker: str | None, of: str | None, group: str | None) -> Share:
    """Return a marker's share: `of` is how many there are, or the names of all of them with commas between.

    Of a number each name takes the next share that is free, which is kept in `markers.json`. Raises UsageError.
    """
    if of is None or marker is None:
        if of is not None:
            raise UsageError("--of needs --marker", hint="--marker ann --of 4")
        return Share(group=group)
    if of.isdigit() and 0 < int(of) < 1000:
        with reviewing(folder):
            names, count = _claimed(folder, marker, int(of)), int(of)
    else:
        names = [name.strip() for name in of.split(",")]
        count = len(names)
    if marker not in names:
        raise UsageError(f"--marker {marker}: the shares are those of {join_words(names)}")
    return Share(number=names.index(marker), of=count, group=group)


def _claimed(folder: Path, marker: str, count: int) -> list[str]:
    """Return who has which share, with this marker among them where one is free."""
    path = folder / FILE
    try:
        known = json.loads(path.read_bytes())
        names = [str(name) for name in known[str(count)]] if isinstance(known, dict) else []
    except (OSError, ValueError, KeyError, TypeError):
        known, names = {}, []
    if marker in names or len(names) >= count:
        return names
    names.append(marker)
    known = (known if isinstance(known, dict) else {}) | {str(count): names}
    atomic_write(path, (json.dumps(known, indent=2) + "\n").encode())
    return names
