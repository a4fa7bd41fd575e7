"""Several markers: which submissions each of them has, and their decisions put together without losing any."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.run import ids_of
from grader.classes.overrides import COMMENTS_FILE as BANK
from grader.classes.overrides import FILE, read_bank, read_written
from grader.classes.overrides.write import OverrideChange, write_overrides
from grader.classes.review.session import hold_review
from grader.errors import UsageError
from grader.files import atomic_write
from grader.model.batch import Entry
from grader.model.result import WrittenOverride
from grader.rubric.model import Rubric
from grader.wording import join_words, number

SHARES = "markers.json"


@dataclass(frozen=True, kw_only=True)
class MarkingShare:
    """`number` of `of` shares, counted from 0, and of these only the submissions of `group`, where it is given."""

    number: int = 0
    of: int = 1
    group: str | None = None

    def __call__(self, entry: Entry) -> bool:
        """Return whether the submission is among them. It stays so when others join the class."""
        digest = hashlib.sha256(entry.id.encode("utf-8", "surrogatepass")).digest()
        mine = int.from_bytes(digest[:8], "big") % self.of == self.number
        return mine and (self.group is None or entry.group == self.group)


def share_of(folder: Path, marker: str | None, of: str | None, group: str | None) -> MarkingShare:
    """Return a marker's share: `of` is how many there are, or the names of all of them with commas between.

    Of a number each name takes the next share that is free, which is kept in `markers.json`. Raises UsageError.
    """
    if of is None or marker is None:
        if of is not None:
            raise UsageError("--of needs --marker", hint="--marker ann --of 4")
        return MarkingShare(group=group)
    if of.isdecimal() and 0 < int(of) < 1000:
        with hold_review(folder):
            names, count = _claim_share(folder, marker, int(of)), int(of)
    else:
        names = [name.strip() for name in of.split(",")]
        count = len(names)
    if marker not in names:
        raise UsageError(f"--marker {marker}: the shares are those of {join_words(names)}")
    return MarkingShare(number=names.index(marker), of=count, group=group)


def _claim_share(folder: Path, marker: str, count: int) -> list[str]:
    """Return who has which share, with this marker among them where one is free."""
    path = folder / SHARES
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


@dataclass(frozen=True, kw_only=True)
class Merged:
    """How many decisions came in, how many were there already, and each conflict in a line: there, one's own stays."""

    added: int
    same: int
    conflicts: tuple[str, ...]


def merge(batch: BatchFolder, rubric: Rubric, other: Path) -> Merged:
    """Put into the class's `overrides.yaml` and `comments.yaml` what those in the folder `other` have beside it.

    Comments are written first, so that no override is without one that it names. Raises RubricError where one of the
    files has faults, UsageError where `other` has no overrides, and what `write_overrides` raises.
    """
    if not (other / FILE).is_file():
        raise UsageError(
            f"{other / FILE}: there is no such file", hint="give the other marker's folder of results"
        )
    ids = ids_of(batch.run)
    with hold_review(batch.path):
        bank, their_bank = read_bank(batch.path / BANK, rubric), read_bank(other / BANK, rubric)
        mine = read_written(batch.path / FILE, rubric, ids, bank)
        theirs = read_written(other / FILE, rubric, ids, their_bank)
        comments: list[OverrideChange] = []
        unlike: set[tuple[str, str]] = set()
        for of, found in their_bank.items():
            comments += [(of, name, one) for name, one in found.items() if name not in bank.get(of, {})]
            unlike |= {(of, name) for name, one in found.items() if bank.get(of, {}).get(name, one) != one}
        changes: list[OverrideChange] = []
        same, conflicts = 0, [f"{BANK}: {of}.{name} says something else there" for of, name in sorted(unlike)]
        for submission, decided in theirs.items():
            for of, one in decided.items():
                here = mine.get(submission, {}).get(of)
                if any((of, name) in unlike for name in one.comments):
                    conflicts.append(f"{submission}.{of}: one of its comments says something else there")
                elif here is None:
                    changes.append((submission, of, one))
                elif here == one:
                    same += 1
                else:
                    conflicts.append(f"{submission}.{of}: here {_words(here)}, there {_words(one)}")
        write_overrides(batch.path / BANK, comments)
        write_overrides(batch.path / FILE, changes)
    return Merged(added=len(changes), same=same, conflicts=tuple(conflicts))


def _words(one: WrittenOverride) -> str:
    points = f"{number(one.points)} points" if one.points is not None else ", ".join(one.comments)
    return f"{points} by {one.author}" if one.author else points
