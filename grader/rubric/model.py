"""A rubric's records. Units are in the names; `grader rubric schema` exports them as a JSON Schema."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from pathlib import PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, AwareDatetime, Field, PrivateAttr
from typing_extensions import Self

from grader.model.record import Record
from grader.model.repair import DEFAULT_SHARES, RepairKind
from grader.rubric.made_up import MadeUp, Value
from grader.rubric.scenario import FOLDER_PATTERN, PACKAGE_PATTERN, Name, Scenario, Start

Share = Annotated[float, Field(ge=0, le=1)]
YEARS = range(2000, 3000)
LATE_DAYS_MAX = 3660


def _of_these_times(time: datetime) -> datetime:
    if time.year not in YEARS:
        raise ValueError(f"must be a time of the years {YEARS[0]} to {YEARS[-1]}")
    return time


Deadline = Annotated[AwareDatetime, AfterValidator(_of_these_times)]


class Criterion(Record):
    """One line of the report. Give one of `points`, `bonus` and `penalty`."""

    id: Name
    """The criterion's name in results, for programs and people."""
    title: str
    """What the student reads."""
    points: Annotated[float, Field(ge=0)] = 0.0
    """Of the rubric's 100; 0 is advice."""
    bonus: Annotated[float, Field(gt=0)] | None = None
    """Added to them if the check passes; if not, this costs nothing."""
    penalty: Annotated[float, Field(gt=0)] | None = None
    """Taken off if the check fails; the total is never less than 0."""
    check: str
    """The check that judges it, or `manual` if a person awards the points."""
    package: str | None = None
    """Which of the lab's packages it judges, if students hand in several; null: that of the process that
    `with` names, or of all the processes of its scenario, else the first."""
    parameters: Annotated[dict[str, Any], Field(alias="with", default_factory=dict)]
    """The check's own parameters."""
    scenario: Name | None = None
    """The run that it is judged by."""
    requires: tuple[Name, ...] = ()
    """Criteria that explain why there may be nothing to judge here: this one is then `blocked`."""
    visibility: Literal["visible", "hidden"] = "visible"
    """Whether students see it."""
    hint: str = ""
    """What to do, in place of the check's own hint."""
    reproduce: str = ""
    """A command with which students can see it themselves, or a sentence with its commands in backticks."""

    @property
    def extra(self) -> float:
        """What it can change beside the rubric's 100 points: a bonus, or minus a penalty."""
        return self.bonus or -(self.penalty or 0.0)


class ManualParams(Record):
    """What a criterion that a person decides is about."""

    files: Annotated[
        tuple[Annotated[str, Field(min_length=1, max_length=200)], ...], Field(max_length=20)
    ] = ()
    """The files that `grader review` shows beside it, by name, path or pattern (`scripts/*.py`); none: all programs."""


class Group(Record):
    """Criteria whose points are awarded together."""

    criteria: Annotated[tuple[Name, ...], Field(min_length=1)]
    """The ids of the criteria."""
    points: Annotated[float, Field(gt=0)] | None = None
    """What the group is worth; the points of its criteria are then their weights in it. Null: each has its
    own points."""
    best: Annotated[int, Field(ge=1)] | None = None
    """How many of its criteria count, those with the most points; then all have to be worth the same."""


class Gate(Record):
    """A criterion without which the whole is worth less."""

    criterion: Name
    """The criterion that has to be reached: it neither fails nor is blocked."""
    at_most: Annotated[float, Field(ge=0)]
    """The most points that the whole is worth without it."""


class Late(Record):
    """What being late costs: `lost` percent for each `per` that has begun since the deadline."""

    lost: Annotated[float, Field(ge=0, le=100)]
    """Percent that are lost for each `per`."""
    of: Literal["reached", "possible"] = "reached"
    """Of the points that were reached, or of all the rubric's points."""
    per: Literal["day", "hour"] = "day"
    """For each day or each hour."""
    grace_minutes: Annotated[float, Field(ge=0, le=LATE_DAYS_MAX * 24 * 60)] = 0.0
    """A submission this long after the deadline is still in time."""
    cap: Annotated[float, Field(ge=0, le=100)] = 100.0
    """The most percent that are lost."""
    cut_off_days: Annotated[float, Field(ge=0, le=LATE_DAYS_MAX)] | None = None
    """Later than this after the deadline nothing counts; null: always something."""


class Needs(Record):
    """What a lab needs of the machine."""

    ros: tuple[str, ...] = ()
    """ROS packages."""
    apt: tuple[str, ...] = ()
    """Debian packages."""
    pip: tuple[str, ...] = ()
    """Modules of ROS's Python, by their names on PyPI."""


class Rubric(Record):
    """A lab."""

    schema_: Annotated[Literal["grader.rubric/1"], Field(alias="schema")] = "grader.rubric/1"
    """The version of the format; a file without it is read as version 1."""
    id: Name
    """The lab's name: `leeds-comp3631-lab1`."""
    title: str
    """What people read."""
    version: str
    """The rubric's own version, as text."""
    package_: Annotated[str | Annotated[tuple[str, ...], Field(min_length=1)], Field(alias="package")]
    """The name of the package that students hand in; of several, `[lab_msgs, lab_nodes]`, the first is the main one,
    without which nothing is graded."""
    handout: str = ""
    """Where the handout is, or what it is called."""
    pass_mark: Annotated[float, Field(ge=0)] | None = None
    """In points; null: every visible criterion has to be reached."""
    digits: Annotated[int, Field(ge=0, le=3)] = 1
    """How many decimals points keep."""
    checks: str | None = None
    """A Python file beside the rubric with checks of the instructor's own."""
    deadline: Deadline | None = None
    """When it is due, with a time zone; null: it has no deadline."""
    late: Late | None = None
    """What being late costs; null: nothing."""
    repairs: Annotated[dict[RepairKind, Share], Field(default_factory=dict)]
    """Shares by kind of repair: what is judged on a copy with such a repair earns that share of its points; 0 switches
    the repair off."""
    fixes: Literal["offered", "none"] = "offered"
    """With `none`, `grader check --fix` repairs nothing: students are to find it themselves."""
    packages: tuple[Annotated[str, Field(pattern=PACKAGE_PATTERN)], ...] = ()
    """Folders beside the rubric, each a ROS package of the course: nodes, messages, launch files."""
    starter: Annotated[str, Field(pattern=FOLDER_PATTERN)] | None = None
    """A folder beside the rubric with the files that the course hands out; if a criterion is lost and its
    file is still unchanged, the report says so."""
    needs: Annotated[Needs, Field(default_factory=Needs)]
    """What else the machine has to have."""
    groups: Annotated[dict[Name, Group], Field(default_factory=dict)]
    """Criteria whose points are awarded together, by the group's name."""
    gates: tuple[Gate, ...] = ()
    """Criteria without which the whole is worth less."""
    made_up: Annotated[dict[Name, MadeUp], Field(default_factory=dict)]
    """Values that are made up for each submission, by the names that scenarios and criteria use."""
    scenarios: dict[Name, Scenario]
    """The runs, by name."""
    criteria: Annotated[tuple[Criterion, ...], Field(min_length=1)]
    """What is judged, in the order of the report."""
    _written: dict[str, Any] = PrivateAttr(default_factory=dict)
    _values: dict[str, Value] = PrivateAttr(default_factory=dict)

    @property
    def written(self) -> dict[str, Any]:
        """Its data as the file has them, where it makes values up."""
        return self._written

    @property
    def values(self) -> dict[str, Value]:
        """The made-up values that stand in it; none where they are samples."""
        return self._values

    def remember(self, written: Mapping[str, Any], values: Mapping[str, Value]) -> Self:
        """Keep what it was made of; return it."""
        self._written, self._values = dict(written), dict(values)
        return self

    def with_types_of(self, package: str) -> Self:
        """Return the rubric for a package that has another name than the lab's: its own messages and services have that
        name too, `my_lab/State` in place of `lab/State`."""
        if package in {"", self.package}:
            return self
        own = re.compile(rf"{re.escape(self.package)}/(?=[A-Z]\w*$)")

        def renamed(part: Any) -> Any:  # noqa: ANN401 - any part of a rubric
            if isinstance(part, Mapping):
                return {key: renamed(value) for key, value in part.items()}
            if isinstance(part, list | tuple):
                return type(part)(renamed(value) for value in part)
            return own.sub(f"{package}/", part) if isinstance(part, str) else part

        plain = {name: one.model_dump(exclude_unset=True) for name, one in self.scenarios.items()}
        written = (plain, [c.parameters for c in self.criteria])
        # The same object, so that `LoadedRubric.of_submission` sees that nothing has changed.
        if renamed(written) == written:
            return self
        update = {
            "scenarios": {name: Scenario.model_validate(renamed(one)) for name, one in plain.items()},
            "criteria": tuple(
                c.model_copy(update={"parameters": renamed(c.parameters)}) for c in self.criteria
            ),
        }
        return self.model_copy(update=update).remember(renamed(self.written), self.values)

    @property
    def package(self) -> str:
        """The package that students hand in; of several, the main one."""
        return self.package_names[0]

    @property
    def package_names(self) -> tuple[str, ...]:
        """The packages that students hand in, the main one first."""
        return (self.package_,) if isinstance(self.package_, str) else self.package_

    def package_of(self, one: Criterion | Start) -> str:
        """Return the name of the package that a criterion judges, or that a start's files are of."""
        if one.package is not None or isinstance(one, Start) or isinstance(self.package_, str):
            return one.package or self.package
        found = {self.package_of(start) for start in self.starts_of(one)}
        return found.pop() if len(found) == 1 else self.package

    def starts_of(self, criterion: Criterion) -> list[Start]:
        """Return what of the student's its run starts: the process that it names, or all."""
        scenario = self.scenarios.get(criterion.scenario or "")
        starts = [s for s in scenario.start if s.program is None] if scenario is not None else []
        process = str(criterion.parameters.get("process")).partition("/")[0]
        return [s for s in starts if s.name == process] or starts

    def share_of(self, kind: RepairKind) -> float:
        """Return the share of its points, 0 to 1, that a criterion earns on a copy with such a repair."""
        return self.repairs.get(kind, DEFAULT_SHARES[kind])

    @property
    def launch_commands(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The launch files that scenarios start with arguments, and these: `robot:=tb3`.

        They are in the rubric's order, so that the same files give the same evidence.
        """
        starts = (start for scenario in self.scenarios.values() for start in scenario.start)
        named = ((PurePosixPath(s.launch).name, s.args) for s in starts if s.launch)
        given = ((name, tuple(word for word in args if ":=" in word)) for name, args in named)
        return tuple(dict.fromkeys((name, args) for name, args in given if args))

    @property
    def max_points(self) -> float:
        """The most points that can be reached, without bonuses."""
        worth = {c.id: c.points for c in self.criteria}
        # Of a group that counts its best, all criteria are worth the same (`consistency.py`).
        uncounted = sum(
            worth.get(name, 0.0) for g in self.groups.values() if g.best for name in g.criteria[g.best :]
        )
        # A sum of floats is off by a hair: 0.1 + 0.2 is not 0.3.
        return round(sum(worth.values()) - uncounted, 6)
