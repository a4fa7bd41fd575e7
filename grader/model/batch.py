"""The records of a class: its submissions (a roster), what a batch does, what was published and sent, what is alike.

They are `run.json` (schema `grader.run/1`), the lines of `published.jsonl` and `sent.jsonl`, and `similarity.json`
(schema `grader.similarity/1`), on which no mark depends.
The docstring of a field says what its key means: the reference and the JSON schemas are made of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Literal

from pydantic import AwareDatetime, Field

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
    """The student's id, if there is one."""
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
    """What a batch was asked to do, and how far it has come."""

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


SentState = Literal["sending", "sent", "failed"]


class Publication(Record):
    """One result that was published, as it was then. The last line of a submission counts."""

    schema_: Literal["grader.published/1"] = Field(default="grader.published/1", alias="schema")
    """Which format this is, and its version."""
    id: str
    """The student's id."""
    at: AwareDatetime
    """When it was published."""
    by: str = ""
    """Who published it."""
    status: Literal["graded", "inconclusive", "error"]
    """The result's status."""
    points: float
    """The result's points."""
    max_points: float
    """The most points that can be reached."""
    digest: str
    """sha256 of the `result.json` that was published: `.published/<id>/<its first 16 digits>/` holds it."""
    changes: tuple[str, ...] = ()
    """What changed since the publication before, as the student reads it; empty for the first one."""


class Sent(Record):
    """One step of sending feedback to one student. The last line of a student, a form and a digest counts."""

    schema_: Literal["grader.sent/1"] = Field(default="grader.sent/1", alias="schema")
    """Which format this is, and its version."""
    id: str
    """The student's id."""
    form: str
    """How it was sent: the value of `--form`."""
    digest: str
    """The `digest` of the publication that was sent."""
    at: AwareDatetime
    """When."""
    state: SentState
    """`sending`: it was begun; if no line follows, nobody knows how it ended. `sent`; `failed`: it was not sent."""
    place: str = ""
    """Where it went: a file, an address, a commit, a comment."""
    message: str = ""
    """Why it failed."""


Lines = tuple[tuple[int, int], ...]
"""First and last lines of stretches, counted from 1."""


class FileMatch(Record):
    """What of one file of the first submission is in a file of the second, the one that has most of it."""

    file_a: str
    file_b: str
    lines_a: Lines
    lines_b: Lines


class Pair(Record):
    """Two submissions, `a` before `b`.

    `similarity_a` is the share (0 to 1) of a's own code that is in b too; a's own code is what is left when everything
    in `TakenOut` is taken out. `lines_a` is the number of a's lines that hold it.
    """

    a: str
    b: str
    similarity_a: float
    similarity_b: float
    lines_a: int
    lines_b: int
    files: tuple[FileMatch, ...]


class TakenOut(Record):
    """What is no one's own.

    `starter` are the files of the starter code, `tutorials` those that the grader knows. `common` is the number of
    fingerprints that are in more than half of the submissions, None where the class is too small to say so.
    """

    starter: tuple[str, ...] = ()
    tutorials: tuple[str, ...] = ()
    common: int | None = None


class NotCompared(Record):
    """A submission, or one file of it, that could not be compared, and why."""

    id: str
    file: str = ""
    reason: str


class Similarity(Record):
    """`threshold` is the share from which a pair is named, `min_lines` the least number of matching lines of each.

    `clusters` are the submissions that hang together by pairs. `too_little` have too little code of their own to tell
    anything. `same_group` counts the pairs that were left out because both are of one group.
    """

    schema_: Literal["grader.similarity/1"] = Field(default="grader.similarity/1", alias="schema")
    library: str
    library_version: str
    threshold: float
    min_lines: int
    compared: int
    pairs: tuple[Pair, ...] = ()
    clusters: tuple[tuple[str, ...], ...] = ()
    taken_out: TakenOut = TakenOut()
    too_little: tuple[str, ...] = ()
    not_compared: tuple[NotCompared, ...] = ()
    same_group: int = 0
    notes: tuple[str, ...] = ()
