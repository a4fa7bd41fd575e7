"""A course's gradebook: the labs stand where a lab's gradebook has criteria, so every form of it can be written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from grader import __version__
from grader.classes.course.standing import open_lab
from grader.classes.feedback.publish import published_rows, read_published
from grader.classes.gradebook import Book, Row
from grader.classes.gradebook.table import BookCriterion
from grader.classes.overrides import folder_key
from grader.classes.roster.entries import known_columns
from grader.classes.roster.table import read_table
from grader.errors import UsageError
from grader.judging.summary import round_half_up
from grader.model.batch import Entry
from grader.model.result import (
    CriterionResult,
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.verdict import Status
from grader.rubric.course import CourseFile
from grader.rubric.load import load_rubric

MAX_POINTS = 100.0
DIGITS = 2
LATE_DAYS = "late days"


@dataclass(frozen=True, kw_only=True)
class Marks:
    """One lab's rows by `folder_key` of the student's id; `drafts` where nothing of it is published."""

    name: str
    title: str
    max_points: float
    weight: float
    rows: Mapping[str, Row]
    drafts: bool


def marks_of(course: CourseFile, *, drafts: bool = False) -> tuple[Marks, ...]:
    """Return the marks of each lab of which there are any: what is published, or with `drafts` what is there now."""
    found = []
    for name, lab in course.course.labs.items():
        batch = open_lab(course, name)
        if batch is None:
            continue
        published = read_published(batch.path)
        by_drafts = drafts or not published.history
        rows = batch.rows() if by_drafts else published_rows(batch, published)
        rubric = load_rubric(course.rubric(name)).rubric
        found.append(
            Marks(
                name=name,
                title=rubric.title,
                max_points=rubric.max_points,
                weight=lab.weight,
                rows={folder_key(row.entry.id): row for row in rows},
                drafts=by_drafts,
            )
        )
    return tuple(found)


def students_of(course: CourseFile, marks: tuple[Marks, ...]) -> dict[str, Entry]:
    """Return all students by `folder_key`: those of the course's roster, or else all who are in a lab.

    Raises UsageError where the roster cannot be read.
    """
    in_labs = {key: row.entry for one in reversed(marks) for key, row in one.rows.items()}
    if course.course.roster is None:
        return in_labs
    path = course.beside(course.course.roster)
    if not path.is_file():
        raise UsageError(f"{path}: not found", hint=f"it is the roster in {course.path}")
    table = read_table(path)
    names = known_columns(table, path, ("id",))
    found = {}
    for row in table.rows:
        fields = {names[column]: value for column, value in row.fields.items() if column in names}
        if fields.get("id"):
            key = folder_key(fields["id"])
            known = in_labs.get(key) or Entry(id=fields["id"], source="")
            own = {name: fields[name] for name in ("name", "group") if fields.get(name)}
            found[key] = known.model_copy(update=own)
    return found


def book_of(course: CourseFile, marks: tuple[Marks, ...]) -> Book:
    """Return what the gradebook is about."""
    return Book(
        title=course.course.title,
        rubric_id="course",
        max_points=MAX_POINTS,
        criteria=tuple(BookCriterion(one.name, one.title, one.max_points) for one in marks),
        columns=(LATE_DAYS,) if course.course.late_days else (),
    )


def rows_of(course: CourseFile, marks: tuple[Marks, ...]) -> Iterator[Row]:
    """Yield a row for each student: each lab's points, and of all labs together 0 to 100, by their weights."""
    whole = sum(one.weight for one in marks)
    for key, entry in students_of(course, marks).items():
        labs = tuple(_lab(one, one.rows.get(key)) for one in marks)
        shares = (
            one.weight * lab.points / one.max_points if one.max_points else 0.0
            for one, lab in zip(marks, labs, strict=True)
        )
        results = [one.rows[key].result for one in marks if key in one.rows]
        used = sum(result.late.late_days_used for result in results if result.late)
        points = round_half_up(MAX_POINTS * sum(shares) / whole, DIGITS) if whole else 0.0
        settled = all(not lab.status.is_open for lab in labs)
        yield Row(
            entry=entry.model_copy(update={"extra": {**entry.extra, LATE_DAYS: str(used)}}),
            result=_result(entry, labs, points, settled=settled),
        )


def _lab(marks: Marks, row: Row | None) -> CriterionResult:
    """Return a lab's row as a criterion: open where it is not settled, not published, or not handed in at all."""
    result = row.result if row else None
    known = result is not None and result.status == "graded"
    return CriterionResult(
        id=marks.name,
        title=marks.title,
        check="",
        scenario=None,
        status=Status.PASS if known else Status.MANUAL,
        points=result.points if known and result else 0.0,
        max_points=marks.max_points,
        message="" if result else "not handed in",
        expected="",
        measured="",
        hint="",
        reproduce="",
        citations=(),
    )


def _result(
    entry: Entry, labs: tuple[CriterionResult, ...], points: float, *, settled: bool
) -> GradingResult:
    return GradingResult(
        submission=SubmissionInfo(id=entry.id, source="", commit=None, digest="", package=""),
        rubric=RubricInfo(id="course", version="", digest=""),
        status="graded" if settled else "inconclusive",
        points=points,
        max_points=MAX_POINTS,
        criteria=labs,
        environment=EnvironmentInfo(grader=__version__, ros="", python="", sandbox=""),
        timing=TimingInfo(wall_s=0.0, cpu_s=0.0, student_cpu_s=0.0),
    )
