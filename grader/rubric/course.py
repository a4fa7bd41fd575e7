"""`course.yaml`: the labs of a course, with what the course sets for each of them in place of its rubric.

`course.yaml#lab1` stands for the rubric of that lab, with the course's deadline and late policy, wherever a rubric can
be named.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from grader.errors import RubricError, UsageError
from grader.model.record import Record
from grader.model.version import COURSE
from grader.rubric.fault_words import model_faults
from grader.rubric.find import SUFFIXES
from grader.rubric.model import Deadline, Late
from grader.rubric.scenario import Name
from grader.rubric.yaml_lines import Fault, Form, Source, as_map, read_source
from grader.wording import did_you_mean

FORM = Form(what="a course file", usual="a course file is a few kilobytes", times=frozenset({"deadline"}))
MARK = "#"
Counts = Literal["best", "last", "by-criterion"]


class LateDays(Record):
    """Days that each student may be late without losing anything, over all labs of the course."""

    budget: Annotated[int, Field(ge=0, le=1000)]
    """How many days, in all labs together."""
    per_lab: Annotated[int, Field(ge=0, le=1000)] | None = None
    """At most so many for one lab; null: as many as are left."""


class CourseLab(Record):
    """One lab of a course. Paths are from the course file's folder."""

    rubric: str
    """A lab's id, or a rubric's file."""
    roster: str | None = None
    """What `grader batch` takes as its roster; null: nothing is graded by the course file."""
    results: str | None = None
    """The folder of results; null: `results/` and the lab's name."""
    deadline: Deadline | None = None
    """The deadline, in place of the rubric's."""
    late: Late | None = None
    """What being late costs, in place of the course's."""
    weight: Annotated[float, Field(ge=0)] = 1.0
    """The lab's share of the course's grade, compared with the other labs."""
    attempts: Counts | None = None
    """The roster may have several rows for a student, and this says which of them counts: the one with the most
    points, the last one, or for each criterion its best one. Null: each student is there once."""


class Course(Record):
    """The labs of a course."""

    schema_: Annotated[Literal["grader.course/1"], Field(alias="schema")] = "grader.course/1"
    """The version of the format; a file without it is read as version 1."""
    title: str
    """What people read."""
    roster: str | None = None
    """A table of all students, `id` and perhaps `name` and `group`: who is in the course's gradebook. Null: everyone
    who is in a lab."""
    late: Late | None = None
    """What being late costs, in place of the rubrics'."""
    late_days: LateDays | None = None
    """Days that may be late without a loss; null: none."""
    feedback: Literal["folder", "moodle", "canvas", "email", "git", "github", "gitlab"] | None = None
    """How `grader course publish` returns the reports; null: it only publishes."""
    labs: Annotated[dict[Name, CourseLab], Field(min_length=1)]
    """The labs by name, in the order in which they are due."""


@dataclass(frozen=True)
class CourseFile:
    """A course and its file."""

    course: Course
    path: Path

    def lab(self, name: str) -> CourseLab:
        """Return the lab of that name. Raises UsageError."""
        if name not in self.course.labs:
            near = did_you_mean(name, self.course.labs)
            raise UsageError(
                f'{self.path}: there is no lab "{name}"{near}', hint=f"labs: {', '.join(self.course.labs)}"
            )
        return self.course.labs[name]

    def rubric(self, name: str) -> str:
        """Return what stands for the lab's rubric, with the course's terms."""
        return f"{self.path}{MARK}{name}"

    def beside(self, path: str) -> Path:
        """Return a path that is written in the course file."""
        return self.path.parent / path

    def results(self, name: str) -> Path:
        """Return the folder of the lab's results."""
        return self.beside(self.lab(name).results or f"results/{name}")

    def late(self, name: str) -> Late | None:
        """Return what being late costs in this lab, None where its rubric says so."""
        return self.lab(name).late or self.course.late


def load_course(path: Path) -> CourseFile:
    """Return the course in that file. Raises RubricError with every fault that it has."""
    source = read_source(path, str(path), FORM)
    if newer := COURSE.newer(as_map(source.data).get("schema")):
        raise RubricError([source.fault(("schema",), newer)])
    faults = [*source.faults, *model_faults(Course, source.data), *_cross_faults(source)]
    if faults:
        raise RubricError(source.in_order(faults), hint="grader schema course lists what it may contain")
    return CourseFile(Course.from_data(source.data), path)


def split_name(name: str) -> tuple[Path, str] | None:
    """Return the course file and the lab of `course.yaml#lab1`; None where it names no lab of a course."""
    file, mark, lab = str(name).rpartition(MARK)
    return (Path(file), lab) if mark and Path(file).suffix in SUFFIXES else None


def _cross_faults(source: Source) -> Iterator[Fault]:
    data = as_map(source.data)
    labs = {name: as_map(lab) for name, lab in as_map(data.get("labs")).items()}
    folders: dict[str, str] = {}
    for name, lab in labs.items():
        # As a path: `a/` and `a` are one folder.
        folder = str(Path(str(lab.get("results") or f"results/{name}")))
        if folders.setdefault(folder, name) != name:
            yield ("labs", name, "results"), f"{folder} is the folder of {folders[folder]} already"
        if data.get("late_days") and not (lab.get("late") or data.get("late")):
            message = "late days need a rule for what later work costs: late: {lost: 100} for nothing at all"
            yield ("labs", name), message
