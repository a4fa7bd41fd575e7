"""Another marker's decisions, put beside one's own without losing either's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.run import ids_of
from grader.classes.overrides import FILE, read_written
from grader.classes.overrides.bank import FILE as BANK
from grader.classes.overrides.bank import read_bank
from grader.classes.overrides.write import Change, write_overrides
from grader.classes.review.session import reviewing
from grader.errors import UsageError
from grader.model.result import WrittenOverride
from grader.rubric.model import Rubric
from grader.wording import number


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
    with reviewing(batch.path):
        bank, their_bank = read_bank(batch.path / BANK, rubric), read_bank(other / BANK, rubric)
        mine = read_written(batch.path / FILE, rubric, ids, bank)
        theirs = read_written(other / FILE, rubric, ids, their_bank)
        comments: list[Change] = []
        unlike: set[tuple[str, str]] = set()
        for of, found in their_bank.items():
            comments += [(of, name, one) for name, one in found.items() if name not in bank.get(of, {})]
            unlike |= {(of, name) for name, one in found.items() if bank.get(of, {}).get(name, one) != one}
        changes: list[Change] = []
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
