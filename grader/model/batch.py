"""`run.json`: what a batch was asked to do and how far it came. Schema `grader.run/1`."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.result import RubricInfo
from grader.model.roster import Entry, RosterFault

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
