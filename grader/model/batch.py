"""What a roster says."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.result import RubricInfo


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


# [model.batch] `run.json`: what a batch was asked to do and how far it came. Schema `grader.run/1`.

MISSING, ROSTER = "not-graded-yet", "roster"
"""Kinds of errors that only a class has: nothing was graded so far, and the roster keeps it from that."""
State = Literal["running", "complete", "interrupted"]


class Counts(Record):
    """How many submissions came to what. `kept` of them were complete before; `missing` have no result yet."""

    submissions: int = 0
    graded: int = 0
    inconclusive: int = 0
    error: int = 0
    missing: int = 0
    kept: int = 0
    passed: int = 0


class CriterionInfo(Record):
    id: str
    title: str
    max_points: float


class BatchRun(Record):
    """`roster` is the file or folder as it was given, `rubric_source` what `--rubric` said (an id or a file).

    `title` and `criteria` are the rubric's; `entries` are the roster's, without passwords, and `columns` its further
    columns. `before` is `--before`.
    """

    schema_: Literal["grader.run/1"] = Field(default="grader.run/1", alias="schema")
    state: State
    grader: str
    rubric: RubricInfo
    rubric_source: str
    title: str
    max_points: float
    criteria: tuple[CriterionInfo, ...]
    roster: str
    static_only: bool = False
    before: datetime | None = None
    started_at: datetime
    ended_at: datetime | None = None
    jobs: int = 0
    cluster: str = ""
    cluster_insecure: bool = False
    own_folder: bool = False
    allow_local: tuple[str, ...] = ()
    remote_only: bool = False
    counts: Counts = Counts()
    columns: tuple[str, ...] = ()
    faults: tuple[RosterFault, ...] = ()
    entries: tuple[Entry, ...] = ()
