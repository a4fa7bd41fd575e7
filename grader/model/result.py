"""The result of one submission: `result.json`, schema `grader.result/1`. Its keys are an interface.

The docstring of a field says what its key means: the reference and the JSON schemas are made of them.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, datetime
from typing import Annotated, Literal, Protocol

from pydantic import AliasChoices, AwareDatetime, Field, SerializerFunctionWrapHandler, model_serializer
from typing_extensions import Self

from grader.model.record import Record
from grader.model.repair import Repair
from grader.model.verdict import EvidenceCitation, FileCitation, Mistake, Status

Day = date | datetime
COMMENT_CHARS = 2000
AUTHOR_CHARS = 200
BANK_CHARS = 500
SaidBy = Literal["roster", "commit", "nobody"]
RubricOrigin = Literal["grader", "pinned", "elsewhere", "submission"]


class HandedIn(Record):
    """When a submission was handed in, and the deadline. All times have a time zone."""

    at: AwareDatetime | None = None
    """When it was submitted; null if neither roster nor commit says so."""
    by: SaidBy = "nobody"
    """Which of them says so: the `roster` (`submitted_at`), the `commit` (its date), or `nobody`."""
    deadline: AwareDatetime | None = None
    """The deadline, with the extension; null without one."""
    extension_days: float = 0.0
    """The extension in days."""
    late_days: int = Field(default=0, exclude_if=lambda value: not value)
    """How many late days of the course the student could use. Only there if there are any."""
    before: AwareDatetime | None = None
    """The commit to grade is the last one before this time; null if the last of all is graded."""
    note: str = ""
    """How that commit was chosen."""


class Lateness(HandedIn):
    """How late a submission is, and the penalty."""

    late_s: float = 0.0
    """Seconds after the deadline; 0 if it was in time."""
    late_days_used: int = Field(default=0, exclude_if=lambda value: not value)
    """How many of them this submission used; the deadline is that much later. Only there if there are any."""
    points_before: float
    """The points before the penalty."""
    points: float
    """The points after it."""
    text: str
    """The reason, in one sentence."""


CommentId = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,39}$")]


class BankComment(Record):
    """A comment that is used again and again (`comments.yaml`): one of `points` and `change`, or neither."""

    text: Annotated[str, Field(min_length=1, max_length=BANK_CHARS)]
    """What students read."""
    points: float | None = None
    """The points that it stands for."""
    change: float | None = None
    """What it adds to the criterion's points, or takes from them."""


class WrittenOverride(Record):
    """An override as `overrides.yaml` has it."""

    points: float | None = None
    """The points that count: from 0 to the criterion's, below 0 for a penalty; null: as its `comments` say,
    or, if these have no points, as the check says."""
    comment: Annotated[str, Field(max_length=COMMENT_CHARS)] = ""
    """What the student reads, below the texts of its `comments`."""
    author: Annotated[str, Field(max_length=AUTHOR_CHARS)] = ""
    """Who awarded them."""
    date: Day | None = None
    """When: a day, or a time."""
    comments: Annotated[tuple[CommentId, ...], Field(max_length=10)] = ()
    """The ids of comments in `comments.yaml`; whatever changes there changes here."""
    answer: Annotated[str, Field(max_length=COMMENT_CHARS)] = ""
    """The answer to the student who asked about the criterion."""
    answered: Annotated[tuple[Annotated[str, Field(max_length=40)], ...], Field(max_length=100)] = ()
    """The questions that it answers, by their digests; empty: all of them."""
    together: Annotated[str, Field(max_length=40)] = ""
    """The same word for all overrides that were made in one go, and can be taken back together."""


class Override(Record):
    """Points that a person awards for one criterion of one submission, or only a note or an answer."""

    points: float | None
    """The points that count: from 0 to the criterion's, below 0 for a penalty; null: those of the check."""
    comment: Annotated[str, Field(max_length=COMMENT_CHARS)] = ""
    """What the student reads."""
    author: Annotated[str, Field(max_length=AUTHOR_CHARS)] = ""
    """Who awarded them."""
    date: Day | None = None
    """When: a day, or a time."""
    comments: tuple[CommentId, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The ids of its comments in `comments.yaml`."""
    answer: str = Field(default="", max_length=COMMENT_CHARS, exclude_if=lambda value: not value)
    """The answer to the student who asked about the criterion."""
    answered: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)
    """The questions that it answers, by their digests; empty: all of them."""
    together: str = Field(default="", exclude_if=lambda value: not value)
    """The same word for all overrides that were made in one go."""

    @property
    def awards(self) -> bool:
        """Whether it has points: else the check's verdict counts."""
        return self.points is not None


class Automatic(Record):
    """The verdict of the check, without the override."""

    status: Status
    """The status that the check gave."""
    points: float
    """Its points."""
    message: str
    """Its sentence."""


class AppliedOverride(Override):
    """An override in a result, beside the verdict that it replaces."""

    criterion: str
    """The criterion's `id`."""
    automatic: Automatic
    """What the check says now."""
    was: Automatic
    """What it said when the override was first applied."""
    changed: bool = False
    """Whether these differ: then the person did not know what the check says now."""


class Point(Record):
    """One way in which what will be marked differs from what was checked, and the command that fixes it."""

    kind: str
    """A word for programs: `uncommitted`, `untracked`, `ignored`, `mode`, `unpushed`, …"""
    text: str
    """One line for people."""
    # In files the key is `mend`, on which other programs rely.
    fix: str = Field(default="", validation_alias=AliasChoices("mend", "fix"), serialization_alias="mend")
    """A command that fixes it, or nothing."""
    remark: bool = False
    """Whether it is only a remark: nothing is known to differ."""


class GitStatus(Record):
    """How the files on the disk compare with what git has, for `grader check`. It changes no verdict."""

    points: tuple[Point, ...] = ()
    """Ways in which what will be marked differs from what was checked."""
    summary: str = ""
    """What git has, on one line, if nothing differs."""


class Repaired(Record):
    """What a repaired copy of the package shows about one criterion."""

    repairs: tuple[Repair, ...]
    """The repairs that the criterion needs to be judged, in the order in which a student meets them."""
    share: float
    """The share of its points that it earns when it is judged on the copy, 0 to 1."""
    charged: bool = False
    """Whether this criterion is about the mistake that was repaired: it loses its points, so that the
    others keep theirs."""


class LeftOut(Record):
    """What a criterion would have if its group did not count only the best."""

    points: float
    """The points that it earned."""
    max_points: float
    """The most points that it could have earned."""
    group: str
    """The group's name in the rubric."""


class Gate(Record):
    """A criterion without which the whole is worth less."""

    criterion: str
    """The criterion's `id`."""
    at_most: float
    """The most points that count without it."""
    points_before: float
    """The points that the criteria come to."""


class CriterionResult(Record):
    """One criterion: a line of the report."""

    id: str
    """The criterion's `id` in the rubric."""
    title: str
    """Its title."""
    check: str
    """The check that judged it, or `manual`."""
    scenario: str | None
    """The run that it was judged by, null for one that the files decide."""
    status: Status
    """`pass`, `partial`, `fail`; `blocked`: another criterion keeps it from being judged; `inconclusive`: not the
    submission's fault; `error`: the check failed; `manual`: a person decides."""
    points: float
    """The points earned, rounded as the rubric says; below 0 for a penalty that is taken off."""
    max_points: float
    """The most points that can be reached; 0 for a bonus, a penalty, advice and what is left out."""
    extra: float = Field(default=0.0, exclude_if=lambda value: not value)
    """The most that a bonus adds, or minus the most that a penalty takes off. Only there for these."""
    left_out: LeftOut | None = Field(default=None, exclude_if=lambda value: value is None)
    """Only there if it does not count, because others of its group were better."""
    message: str
    """What was found, in one sentence."""
    expected: str
    """What the lab asks for, with unit."""
    measured: str
    """What was found, with unit."""
    hint: str
    """What to do about it."""
    reproduce: str
    """A command that shows the same."""
    citations: tuple[FileCitation | EvidenceCitation, ...]
    """The lines of files and the parts of the evidence that the verdict rests on."""
    blocked_by: str = Field(default="", exclude_if=lambda value: not value)
    """The `id` of the criterion that keeps this one from being judged. Only there if it is `blocked`."""
    mistake: Mistake | None = Field(default=None, exclude_if=lambda value: value is None)
    """The mistake that lost it. Only there for the mistakes that `Mistake` lists."""
    repaired: Repaired | None = Field(default=None, exclude_if=lambda value: value is None)
    """What a repaired copy of the package shows about it. Only there if one was run and changes something."""
    made_up: dict[str, bool | int | float | str] = Field(default={}, exclude_if=lambda value: not value)
    """The values by which it is judged that were made up for this submission, by their names in the rubric. Only
    there if there are any."""

    @classmethod
    def unmeasured(cls, **fields: object) -> Self:
        """Return a row with a message and points, but without anything that a check expected or measured."""
        # These stand in every row of result.json, so that they have no default: the schema calls them required.
        nothing = dict.fromkeys(("check", "message", "expected", "measured", "hint", "reproduce"), "")
        return cls.model_validate({**nothing, "scenario": None, "points": 0.0, "citations": (), **fields})

    @property
    def counts(self) -> bool:
        """Whether it can change the total."""
        return self.max_points > 0 or self.extra != 0

    @property
    def is_required(self) -> bool:
        """Whether not to reach it costs points."""
        return self.max_points > 0 or self.extra < 0

    @property
    def missing(self) -> float:
        """The points that it lost, or that are still open."""
        # What is open is not earned yet: a bonus and a penalty may still change the total, too.
        if self.status.is_open:
            return self.max_points - self.points + abs(self.extra)
        return max(0.0, self.max_points - self.points)

    @property
    def full(self) -> float:
        """The points with which it is reached."""
        return self.max_points + max(0.0, self.extra)


class EarlyVerdict(Record):
    """What a criterion's verdict is before anything is built or run. One that is not `final` may still change."""

    criterion: CriterionResult
    final: bool


class SubmissionInfo(Record):
    """Whose work it is."""

    id: str
    """Its name, which is that of its folder."""
    source: str
    """Where it came from, as it was given, without passwords."""
    commit: str | None
    """The commit of a repository, else null."""
    digest: str
    """sha256 of the package's files; empty if no package was found."""
    package: str
    """The package's name; empty if none was found or needed."""
    name: str = ""
    """The student's name; only there if the roster has one."""

    @classmethod
    def unopened(cls, name: str, source: str = "", package: str = "") -> Self:
        """Return what is known of a submission called `name` whose files were not read."""
        return cls(id=name, source=source, commit=None, digest="", package=package)

    @model_serializer(mode="wrap")
    def _without_no_name(self, dump: SerializerFunctionWrapHandler) -> dict[str, str | None]:
        data: dict[str, str | None] = dump(self)
        if not self.name:
            data.pop("name", None)
        return data


class RubricInfo(Record):
    id: str
    """The rubric's `id`."""
    version: str
    """The rubric's own `version`, which its author chooses."""
    digest: str
    """sha256 of the rubric's file and of the instructor's files that belong to it."""


class EnvironmentInfo(Record):
    grader: str
    """The grader's version."""
    ros: str
    """The ROS that ran it; empty if nothing was run."""
    python: str
    """The Python that the grader ran under."""
    sandbox: str
    """What confined the student's code, or `nothing was run`."""


class TimingInfo(Record):
    """How long the grading took."""

    wall_s: float
    """Seconds from start to end."""
    cpu_s: float
    """CPU seconds of the grader."""
    student_cpu_s: float
    """CPU seconds of the student's processes and build."""


NO_TIME = TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0)


class Note(Record):
    """Something that a student's process was not allowed, or a limit that it reached. It costs no points."""

    scenario: str
    """The run that it was noticed in; `package` is the build."""
    actor: str
    """The process or node."""
    kind: Literal["refused", "limit"]
    """`refused`: it was not allowed. `limit`: it reached a limit."""
    text: str
    """What it was."""


class ErrorInfo(Record):
    kind: str
    """Whose fault: `submission`, `package-not-found` (the submission's); `host`, `arena`, `output`, `ros-missing`,
    `sandbox-missing` (the machine's); `internal` (the grader's); `roster`, `not-graded-yet`, `not-published` (of a
    class). Readers must accept others."""
    message: str
    """What is wrong."""
    hint: str
    """What to do about it."""


class Attempts(Record):
    """The attempts of a student, of which one counts."""

    counts: Literal["best", "last", "by-criterion"]
    """Which one counts: the one with the most points, the last one, or for each criterion its best one."""
    chosen: int
    """Which one that is, counted from 1; by criterion, the one with the most points."""
    points: tuple[float | None, ...]
    """The points of each of them, before overrides; null for one that could not be graded."""


class GradingResult(Record):
    """The whole result of one submission."""

    # With a `_`, since pydantic has a method `schema`.
    schema_: Literal["grader.result/1"] = Field(default="grader.result/1", alias="schema")
    """Which format this is, and its version."""
    submission: SubmissionInfo
    """Whose work it is."""
    rubric: RubricInfo
    """What it was judged by."""
    rubric_origin: RubricOrigin | None = Field(default=None, exclude_if=lambda value: value is None)
    """Where the rubric came from. `grader`: it comes with the grader. `pinned`: its digest was given, and
    matches. `submission`: it is in the student's repository, so the student can change it. `elsewhere`:
    another file on the machine."""
    status: Literal["graded", "inconclusive", "error"]
    """`graded`: every criterion worth points is decided. `inconclusive`: some are open. `error`: it could not be
    graded, and `error` says why."""
    points: float
    """The points that count: after overrides, a gate and the late penalty."""
    max_points: float
    """The most points that can be reached, without bonuses."""
    attempts: Attempts | None = Field(default=None, exclude_if=lambda value: value is None)
    """The student's attempts. Only there if the course allows several."""
    gate: Gate | None = Field(default=None, exclude_if=lambda value: value is None)
    """The gate that keeps the points low. Only there if one does."""
    criteria: tuple[CriterionResult, ...]
    """The rubric's criteria, in its order."""
    environment: EnvironmentInfo
    """What graded it."""
    timing: TimingInfo
    """What that took."""
    notes: tuple[Note, ...] = ()
    """What was noticed while it ran; it costs no points. Only there if there is anything."""
    overrides: tuple[AppliedOverride, ...] = ()
    """The overrides: points that a person awarded in place of a check. Only there if there are any."""
    handed_in: HandedIn | None = None
    """When it was submitted. Only there if a roster or a deadline says so."""
    late: Lateness | None = None
    """The late penalty. Only there if the rubric has a deadline."""
    standing: GitStatus | None = None
    """The part of the work that is not committed or not pushed. Only in the output of `grader check`, and if
    there is anything; it costs no points."""
    error: ErrorInfo | None = None
    """Why it could not be graded. Only there for the status `error`."""


StepState = Literal["waiting", "running", "done", "failed", "skipped"]


class Progress(Protocol):
    """A display of a grading's progress. Safe to call from any thread, cheap enough to call often."""

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Show that one step (`intake`, `build`, a scenario's name) is now in `state`.

        `detail` says what it does or waits for; `expected_s` is how long the whole step is likely to take.
        """

    def early(self, verdicts: Callable[[], tuple[EarlyVerdict, ...]]) -> None:
        """Show what the files alone decide, which `verdicts` works out. A display need not call it."""


class Silence:
    """Shows nothing."""

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Show that one step (`intake`, `build`, a scenario's name) is now in `state`."""

    def early(self, verdicts: Callable[[], tuple[EarlyVerdict, ...]]) -> None:
        """Show what the files alone decide, which `verdicts` works out. A display need not call it."""
