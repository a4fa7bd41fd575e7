"""The result of one submission: `result.json`, schema `grader.result/1`. Its keys are an interface."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from grader.model.git_status import Standing
from grader.model.record import Record
from grader.model.submission_time import AppliedOverride, HandedIn, Lateness
from grader.model.verdict import EvidenceCitation, FileCitation, Status


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
