"""What a roster says."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

from pydantic import Field

from grader.model.record import Record


class Entry(Record):
    """One submission. `source` is what `grader grade` takes, an absolute path where it is one; `ref` is a repository's.

    `submitted_at` has a time zone. `where` says where the entry comes from (`roster.csv:7`), for messages; `extra`
    holds the columns that mean nothing to the grader, as they were.
    """

    id: str
    source: str
    ref: str | None = None
    name: str = ""
    group: str = ""
    submitted_at: datetime | None = None
    extension_days: float = 0.0
    where: str = ""
    extra: Mapping[str, str] = Field(default_factory=dict)


class RosterFault(Record):
    """An entry that cannot be graded: where it stands (`roster.csv:7`), its id where it has one of its own, and why."""

    where: str
    id: str | None = None
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.text}"


class Roster(Record):
    """The submissions of a class, in the order of the roster; `columns` are the names of the further columns.

    `faults` are entries that cannot be graded: the others can.
    """

    file: str
    entries: tuple[Entry, ...]
    columns: tuple[str, ...] = ()
    faults: tuple[RosterFault, ...] = ()
