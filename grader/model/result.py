"""When a submission was handed in, what a late one costs, and what a person decided instead of a check."""

from __future__ import annotations

from datetime import date, datetime
from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, FileCitation, Status

Day = date | datetime
COMMENT_CHARS = 2000
AUTHOR_CHARS = 200
SaidBy = Literal["roster", "commit", "nobody"]
"""Who says when it was handed in: the roster's `submitted_at`, the commit's date, or nobody."""


class HandedIn(Record):
    """When a submission was handed in, and until when it could be. All times have a time zone.

    `at` is None where nobody says it. `deadline` holds the extension already; `before` is the time before which the
    commit that counts was looked for, None where the last one counts. `note` says how that commit was chosen.
    """

    at: AwareDatetime | None = None
    by: SaidBy = "nobody"
    deadline: AwareDatetime | None = None
    extension_days: float = 0.0
    before: AwareDatetime | None = None
    note: str = ""


class Lateness(HandedIn):
    """The same in a result: `late_s` after the deadline (0 for in time), and what that cost.

    `points_before` are those that were reached; the result's `points` are those that are left. `text` says why.
    """

    late_s: float = 0.0
    points_before: float
    points: float
    text: str


class Override(Record):
    """A person's points for one criterion of one submission (`overrides.yaml`)."""

    points: Annotated[float, Field(ge=0)]
    comment: Annotated[str, Field(max_length=COMMENT_CHARS)] = ""
    author: Annotated[str, Field(max_length=AUTHOR_CHARS)] = ""
    date: Day | None = None


class Automatic(Record):
    """What the check had said."""

    status: Status
    points: float
    message: str


class AppliedOverride(Override):
    """The same in a result. `automatic` is what the check says now, `was` what it said when the override was first
    applied; `changed` marks that these differ: the person did not know what the check says now."""

    criterion: str
    automatic: Automatic
    was: Automatic
    changed: bool = False


# [model.git_status] How what lies on the disk stands to what git has, as `grader check` tells a student. It changes no verdict.


class Point(Record):
    """One way in which what will be marked differs from what was checked, and the command that mends it.

    `kind` is a word for programs (`uncommitted`, `untracked`, `ignored`, `mode`, `unpushed`, …), `text` one line for
    people, `mend` a command or "". Of a `remark` nobody can say that anything differs.
    """

    kind: str
    text: str
    mend: str = ""
    remark: bool = False


class Standing(Record):
    """`summary` says in one line what git has where nothing differs; `points` are empty then."""

    points: tuple[Point, ...] = ()
    summary: str = ""


# [model.result] The result of one submission: `result.json`, schema `grader.result/1`. Its keys are an interface.


class CriterionResult(Record):
    """One line of the report. `points` are those earned, rounded as the rubric says."""

    id: str
    title: str
    check: str
    scenario: str | None
    status: Status
    points: float
    max_points: float
    message: str
    expected: str
    measured: str
    hint: str
    reproduce: str
    citations: tuple[FileCitation | EvidenceCitation, ...]


class EarlyVerdict(Record):
    """What a criterion's verdict is before anything is built or run. One that is not `final` may still change."""

    criterion: CriterionResult
    final: bool


class SubmissionInfo(Record):
    """Whose work it is: `commit` for a repository, `digest` (sha256 of the package's tree) always."""

    id: str
    source: str
    commit: str | None
    digest: str
    package: str


class RubricInfo(Record):
    id: str
    version: str
    digest: str


class EnvironmentInfo(Record):
    grader: str
    ros: str
    python: str
    sandbox: str


class TimingInfo(Record):
    """Seconds. `cpu_s` is the grader's own, `student_cpu_s` that of the student's processes and build."""

    wall_s: float
    cpu_s: float
    student_cpu_s: float


NO_TIME = TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0)


class Note(Record):
    """What a student's process was not allowed (`refused`), or had too much of (`limit`). It costs no points.

    `scenario` is the run that it was noticed in (`package`: the build), `actor` the process or node.
    """

    scenario: str
    actor: str
    kind: Literal["refused", "limit"]
    text: str


class ErrorInfo(Record):
    kind: str
    message: str
    hint: str


class GradingResult(Record):
    """`points` are those that count in the end: with what a person decided, and without what being late cost.

    `standing` is what `grader check --json` says of git; no file of results has it.
    """

    schema_: Literal["grader.result/1"] = Field(default="grader.result/1", alias="schema")
    submission: SubmissionInfo
    rubric: RubricInfo
    status: Literal["graded", "inconclusive", "error"]
    points: float
    max_points: float
    criteria: tuple[CriterionResult, ...]
    environment: EnvironmentInfo
    timing: TimingInfo
    notes: tuple[Note, ...] = ()
    overrides: tuple[AppliedOverride, ...] = ()
    handed_in: HandedIn | None = None
    late: Lateness | None = None
    standing: Standing | None = None
    error: ErrorInfo | None = None
