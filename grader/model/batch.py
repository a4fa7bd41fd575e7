"""The submissions of a class (a roster), and `run.json`, schema `grader.run/1`: what a batch does, and its progress.

The docstring of a field says what its key means: the reference and the JSON schemas are made of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.result import RubricInfo


class Entry(Record):
    """One submission of a roster."""

    id: str
    """The student's id."""
    source: str
    """What `grader grade` takes (paths are absolute), without passwords."""
    ref: str | None = None
    """A repository's branch, tag or commit."""
    package: str = ""
    """The name of the package to grade in place of the lab's, or empty."""
    name: str = ""
    """The student's name."""
    group: str = ""
    """The group."""
    submitted_at: datetime | None = None
    """When it was submitted, as the roster says, with a time zone."""
    extension_days: float = 0.0
    """The student's extension in days."""
    late_days: int = Field(default=0, exclude_if=lambda value: not value)
    """How many late days of the course the student can use here. Only there if there are any."""
    where: str = ""
    """The file and line: `roster.csv:7`."""
    modes_lost: bool = Field(default=False, exclude_if=lambda value: not value)
    """Whether files lost their executable bits on the way, as single files do on a platform. Only there if they did."""
    extra: Mapping[str, str] = Field(default_factory=dict)
    """The further columns, as they were."""


class RosterFault(Record):
    """A row of a roster that cannot be graded."""

    where: str
    """The file and line: `roster.csv:7`."""
    id: str | None = None
    """The student's id, where there is one."""
    text: str
    """What is wrong."""
    name: str = ""
    """The student's name."""
    group: str = ""
    """The group."""
    extra: Mapping[str, str] = Field(default_factory=dict)
    """The further columns, as they were."""

    def __str__(self) -> str:
        return f"{self.where}: {self.text}"


class Roster(Record):
    """The submissions of a class, in the order of the roster. `columns` names columns that mean nothing to the grader,
    `faults` rows that cannot be graded. `again` are rows of students who are there already: faults, too, unless
    several attempts are allowed."""

    file: str
    entries: tuple[Entry, ...]
    columns: tuple[str, ...] = ()
    faults: tuple[RosterFault, ...] = ()
    again: tuple[Entry, ...] = ()


MISSING, ROSTER, UNPUBLISHED = "not-graded-yet", "roster", "not-published"
"""Kinds of errors that only a class has: not graded so far, a fault of the roster, and not published so far."""
State = Literal["running", "complete", "interrupted"]


class Counts(Record):
    """How many submissions have which outcome."""

    submissions: int = 0
    """All of them."""
    graded: int = 0
    """Those without open points."""
    inconclusive: int = 0
    """Those with open points."""
    error: int = 0
    """Those that could not be graded."""
    missing: int = 0
    """Those without a result so far."""
    kept: int = 0
    """Those that were complete before."""
    passed: int = 0
    """Those that passed."""


class CriterionInfo(Record):
    id: str
    """The criterion's `id`."""
    title: str
    """Its title."""
    max_points: float
    """The most points that can be reached."""
    extra: float = Field(default=0.0, exclude_if=lambda value: not value)
    """The most that a bonus adds, or minus the most that a penalty takes off. Only there for these."""


class BatchRun(Record):
    """What a batch was asked to do, and how far it is."""

    schema_: Literal["grader.run/1"] = Field(default="grader.run/1", alias="schema")
    """Which format this is, and its version."""
    state: State
    """`running` (or killed), `complete`, `interrupted`."""
    grader: str
    """The grader's version."""
    rubric: RubricInfo
    """What the class was judged by."""
    rubric_source: str
    """What `--rubric` said: an id or a file."""
    title: str
    """The rubric's title."""
    max_points: float
    """The most points that can be reached."""
    criteria: tuple[CriterionInfo, ...]
    """The rubric's criteria."""
    roster: str
    """The roster, as it was given."""
    static_only: bool = False
    """Whether only files were judged."""
    before: datetime | None = None
    """What `--before` said."""
    started_at: datetime
    """When the batch began."""
    ended_at: datetime | None = None
    """When it ended; null while it runs."""
    jobs: int = 0
    """How many were graded side by side; 0 for as many as the machine allows."""
    cluster: str = ""
    """The address of the cluster's scheduler, without passwords."""
    cluster_insecure: bool = False
    """Whether a cluster without certificates was allowed."""
    own_folder: bool = False
    """Whether a batch made the folder of results, and so keeps it private to its owner."""
    allow_local: tuple[str, ...] = ()
    """What `--allow-local` said: folders below which the roster may name paths."""
    remote_only: bool = False
    """Whether the roster may name no path of the machine (`--remote-only`)."""
    counts: Counts = Counts()
    """How many submissions have which outcome."""
    columns: tuple[str, ...] = ()
    """The roster's further columns."""
    faults: tuple[RosterFault, ...] = ()
    """Rows of the roster that cannot be graded."""
    entries: tuple[Entry, ...] = ()
    """The submissions, in the roster's order."""
