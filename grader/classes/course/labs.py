"""A course's labs: how far each is, the late days that each student has left, and one gradebook for all of them.

In the gradebook labs stand where a lab's gradebook has criteria, so every form of it can be written.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime

from grader import __version__
from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.feedback.publish import plan, published_rows, read_published
from grader.classes.feedback.send import SentLog
from grader.classes.gradebook import Book, Row
from grader.classes.gradebook.table import BookCriterion
from grader.classes.overrides import folder_key
from grader.classes.roster.entries import known_columns
from grader.classes.roster.table import read_table
from grader.errors import UsageError
from grader.judging.summary import round_half_up
from grader.model.batch import Entry, Roster
from grader.model.result import (
    NO_TIME,
    CriterionResult,
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
)
from grader.model.verdict import Status
from grader.rubric.course import CourseFile
from grader.rubric.load import load_rubric


@dataclass(frozen=True, kw_only=True)
class LabStatus:
    """One lab, in numbers of submissions. `to_settle` are those whose late days have changed since they were graded;
    `to_do` is the next command."""

    name: str
    title: str
    deadline: datetime | None
    submissions: int = 0
    graded: int = 0
    open: int = 0
    error: int = 0
    missing: int = 0
    published: int = 0
    changed: int = 0
    sent: int = 0
    to_settle: int = 0
    to_do: str = ""


def open_lab(course: CourseFile, name: str) -> BatchFolder | None:
    """Return the lab's results; None where nothing was graded so far. Raises UsageError for what no grader wrote."""
    folder = course.results(name)
    return open_batch(folder) if (folder / RUN).is_file() else None


def late_days_taken(course: CourseFile, name: str) -> Counter[str]:
    """Return by `folder_key` of the student's id what the labs before this one took, as numbers below 0."""
    used: Counter[str] = Counter()
    for earlier in course.course.labs:
        if earlier == name:
            break
        batch = open_lab(course, earlier)
        for row in batch.rows() if batch else ():
            if row.result.late is not None:
                used[folder_key(row.entry.id)] -= row.result.late.late_days_used
    return used


def with_late_days(roster: Roster, course: CourseFile, name: str) -> Roster:
    """Return the roster with the late days that each student can use for this lab."""
    days = course.course.late_days
    if days is None:
        return roster
    used = late_days_taken(course, name)
    most = days.budget if days.per_lab is None else days.per_lab

    def left(entry: Entry) -> int:
        return max(0, min(most, days.budget + used[folder_key(entry.id)]))

    entries = tuple(entry.model_copy(update={"late_days": left(entry)}) for entry in roster.entries)
    return roster.model_copy(update={"entries": entries})


def status_of(course: CourseFile) -> Iterator[LabStatus]:
    """Yield how far each lab is, in the course's order."""
    for name in course.course.labs:
        yield _status(course, name)


def _status(course: CourseFile, name: str) -> LabStatus:
    loaded = load_rubric(course.rubric(name))
    rubric = loaded.rubric
    batch = open_lab(course, name)
    if batch is None:
        grade = f"grader course grade {course.path} {name}"
        roster = course.lab(name).roster
        to_do = grade if roster else "give it a roster in the course file"
        return LabStatus(name=name, title=rubric.title, deadline=rubric.deadline, to_do=to_do)
    counts, published = batch.run.counts, read_published(batch.path)
    states = Counter(step.state for step in plan(batch, published))
    log = SentLog(batch.path, course.course.feedback or "")
    last = [history[-1] for history in published.history.values()]
    now = with_late_days(Roster(file="", entries=batch.run.entries), course, name).entries
    found = LabStatus(
        name=name,
        title=rubric.title,
        deadline=rubric.deadline,
        submissions=counts.submissions,
        graded=counts.graded,
        open=counts.inconclusive,
        error=counts.error,
        missing=counts.missing,
        published=len(last),
        changed=states["changed"],
        sent=sum(log.state(one) == "sent" for one in last),
        to_settle=sum(
            one.late_days != two.late_days for one, two in zip(batch.run.entries, now, strict=True)
        ),
    )
    if loaded.digest != batch.run.rubric.digest:
        return replace(found, to_do=f"grader regrade {batch.path} (its rubric has changed since)")
    return _with_next_step(course, batch, found, ready=states["new"] + states["changed"])


def _with_next_step(course: CourseFile, batch: BatchFolder, found: LabStatus, *, ready: int) -> LabStatus:
    steps = {
        f"grader course grade {course.path} {found.name}": found.missing or found.to_settle,
        f"grader review {batch.path}": found.open,
        f"grader course publish {course.path} {found.name}": ready
        or (course.course.feedback and found.sent < found.published),
    }
    to_do = next((command for command, wanted in steps.items() if wanted), "")
    return replace(found, to_do=to_do)


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
        timing=NO_TIME,
    )
