"""What a gradebook is made from."""

from __future__ import annotations

from typing import Literal, NamedTuple

from grader.model.batch import Entry
from grader.model.record import Record
from grader.model.result import GradingResult

Form = Literal["csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"]
FORMS: tuple[Form, ...] = ("csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard")


class Row(Record):
    """One submission of the roster and its result."""

    entry: Entry
    result: GradingResult


class BookCriterion(NamedTuple):
    id: str
    title: str
    max_points: float


class Book(Record):
    """What all rows share: the rubric's `title` and criteria, and the names of the roster's further columns."""

    title: str
    rubric_id: str
    max_points: float
    criteria: tuple[BookCriterion, ...] = ()
    columns: tuple[str, ...] = ()
