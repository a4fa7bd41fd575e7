"""How far each lab of a course is, and how many late days each student has left."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.feedback.publish import plan, read_published
from grader.classes.feedback.send import SentLog
from grader.classes.overrides import folder_key
from grader.model.batch import Entry, Roster
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
    rubric = load_rubric(course.rubric(name)).rubric
    batch = open_lab(course, name)
    if batch is None:
        grade = f"grader course grade {course.path} {name}"
        roster = course.lab(name).roster
        to_do = grade if roster else "give it a roster in the course file"
        return LabStatus(name=name, title=rubric.title, deadline=rubric.deadline, to_do=to_do)
    counts, published = batch.run.counts, read_published(batch.path)
    states = Counter(step.state for step in plan(batch, published))
    form = course.course.feedback
    log = SentLog(batch.path, form) if form else None
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
        sent=sum(log.state(one) == "sent" for one in last) if log else 0,
        to_settle=sum(
            one.late_days != two.late_days for one, two in zip(batch.run.entries, now, strict=True)
        ),
    )
    return _with_next_step(course, batch, found, ready=states["new"] + states["changed"])


def _with_next_step(course: CourseFile, batch: BatchFolder, found: LabStatus, *, ready: int) -> LabStatus:
    steps = {
        f"grader course grade {course.path} {found.name}": found.missing or found.to_settle,
        f"grader review {batch.path}": found.open,
        f"grader course publish {course.path} {found.name}": ready
        or (course.course.feedback and found.sent < found.published),
    }
    to_do = next((command for command, wanted in steps.items() if wanted), "")
    return LabStatus(**{**vars(found), "to_do": to_do})
