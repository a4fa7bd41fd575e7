"""A course (`course.yaml`): late days over all its labs, attempts, how far each lab is, and one gradebook for all.

A course and its labs' folders come in; rosters with late days, a status and rows of a gradebook go out. In the
gradebook labs stand where a lab's gradebook has criteria, so every form of it can be written. How a lab is graded and
published is not its business: each lab is a class like any other.

Of several attempts of one student, each is graded as a class of its own, and what counts becomes the lab's result:
roster → rounds (all first attempts, all second ones, …) → a batch each, in `.attempts/<n>/` → which counts → the lab's
folder.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from grader import __version__
from grader.classes.batch.folder import RUN, BatchFolder, open_batch, write_run
from grader.classes.batch.renew_results import Settler, rewrite
from grader.classes.batch.run import hold_folder, ids_of, write_books
from grader.classes.feedback.publish import plan, published_rows, read_published
from grader.classes.feedback.send import SentLog
from grader.classes.gradebook import Book, GradebookRow
from grader.classes.gradebook.table import BookCriterion
from grader.classes.overrides import FILE as OVERRIDES
from grader.classes.overrides import read_overrides
from grader.classes.roster.entries import known_columns, read_table
from grader.errors import UsageError
from grader.files import make_folder
from grader.intake.names import folder_key
from grader.judging.settle import settle, unsettled
from grader.judging.summary import round_half_up, total_fields
from grader.model.batch import Entry, Roster
from grader.model.result import (
    NO_TIME,
    Attempts,
    CriterionResult,
    EnvironmentInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
)
from grader.model.verdict import Status
from grader.results import read_result
from grader.rubric.course import Counts, CourseFile
from grader.rubric.load import LoadedRubric, load_rubric
from grader.rubric.model import Rubric


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
    """Return by `folder_key` of the student's id how many late days the labs before this one took."""
    used: Counter[str] = Counter()
    for earlier in course.course.labs:
        if earlier == name:
            break
        batch = open_lab(course, earlier)
        for row in batch.rows() if batch else ():
            if row.result.late is not None:
                used[folder_key(row.entry.id)] += row.result.late.late_days_used
    return used


def with_late_days(roster: Roster, course: CourseFile, name: str) -> Roster:
    """Return the roster with the late days that each student can use for this lab."""
    days = course.course.late_days
    if days is None:
        return roster
    used = late_days_taken(course, name)
    most = days.budget if days.per_lab is None else days.per_lab

    def left(entry: Entry) -> int:
        return max(0, min(most, days.budget - used[folder_key(entry.id)]))

    entries = tuple(entry.model_copy(update={"late_days": left(entry)}) for entry in roster.entries)
    return roster.model_copy(update={"entries": entries})


def status_of(course: CourseFile, name: str) -> LabStatus:
    """Return how far the lab is."""
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
    # first of all: what the labs say now is not by today's rubric
    if loaded.digest != batch.run.rubric.digest:
        return replace(found, to_do=f"grader regrade {batch.path} (its rubric has changed since)")
    return _with_next_step(course, batch, found, ready=states["new"] + states["changed"])


def _with_next_step(course: CourseFile, batch: BatchFolder, found: LabStatus, *, ready: int) -> LabStatus:
    steps = {  # in the order in which they are done
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
class LabMarks:
    """One lab's rows by `folder_key` of the student's id; `drafts` where nothing of it is published."""

    name: str
    title: str
    max_points: float
    weight: float
    rows: Mapping[str, GradebookRow]
    drafts: bool


def marks_of(course: CourseFile, *, drafts: bool = False) -> tuple[LabMarks, ...]:
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
            LabMarks(
                name=name,
                title=rubric.title,
                max_points=rubric.max_points,
                weight=lab.weight,
                rows={folder_key(row.entry.id): row for row in rows},
                drafts=by_drafts,
            )
        )
    return tuple(found)


def students_of(course: CourseFile, marks: tuple[LabMarks, ...]) -> dict[str, Entry]:
    """Return all students by `folder_key`: those of the course's roster, or else all who are in a lab.

    Raises UsageError where the roster cannot be read.
    """
    # Backwards, so that of a student who is in several labs the first lab's entry stays.
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


def book_of(course: CourseFile, marks: tuple[LabMarks, ...]) -> Book:
    """Return what the gradebook is about."""
    return Book(
        title=course.course.title,
        rubric_id="course",
        max_points=MAX_POINTS,
        criteria=tuple(BookCriterion(one.name, one.title, one.max_points) for one in marks),
        columns=(LATE_DAYS,) if course.course.late_days else (),
    )


def rows_of(course: CourseFile, marks: tuple[LabMarks, ...]) -> Iterator[GradebookRow]:
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
        yield GradebookRow(
            entry=entry.model_copy(update={"extra": {**entry.extra, LATE_DAYS: str(used)}}),
            result=_result(entry, labs, points, settled=settled),
        )


def _lab(marks: LabMarks, row: GradebookRow | None) -> CriterionResult:
    """Return a lab's row as a criterion: open where it is, not published, or not handed in at all."""
    result = row.result if row else None
    graded = result if result is not None and result.status == "graded" else None
    return CriterionResult.unmeasured(
        id=marks.name,
        title=marks.title,
        status=Status.PASS if graded else Status.MANUAL,
        points=graded.points if graded else 0.0,
        max_points=marks.max_points,
        message="" if result else "not handed in",
    )


def _result(
    entry: Entry, labs: tuple[CriterionResult, ...], points: float, *, settled: bool
) -> GradingResult:
    return GradingResult(
        submission=SubmissionInfo.unopened(entry.id),
        rubric=RubricInfo(id="course", version="", digest=""),
        status="graded" if settled else "inconclusive",
        points=points,
        max_points=MAX_POINTS,
        criteria=labs,
        environment=EnvironmentInfo(grader=__version__, ros="", python="", sandbox=""),
        timing=NO_TIME,
    )


FOLDER = ".attempts"


class Attempt(NamedTuple):
    """Which one it is, counted from 1, its row of the roster, its result, and the folder that has it."""

    number: int
    entry: Entry
    result: GradingResult
    folder: Path


def rounds(roster: Roster) -> tuple[Roster, ...]:
    """Return a roster of all first attempts, one of all second ones, and so on; of one student, by the time that the
    roster gives, else by the order of rows."""
    by_student: dict[str, list[Entry]] = {}
    for entry in (*roster.entries, *roster.again):
        by_student.setdefault(folder_key(entry.id), []).append(entry)
    for entries in by_student.values():
        if all(entry.submitted_at for entry in entries):
            # as moments: the texts of times in several zones have another order
            entries.sort(key=lambda entry: entry.submitted_at.timestamp() if entry.submitted_at else 0.0)
    first_id = {key: entries[0].id for key, entries in by_student.items()}
    allowed = {entry.where for entry in roster.again}
    # to stand in the roster twice is a fault only where there are no attempts
    faults = tuple(fault for fault in roster.faults if fault.where not in allowed)
    most = max(map(len, by_student.values()), default=1)
    found = []
    for number in range(most):
        these = tuple(
            # one id in all batches, so that a student's attempts lie in folders of the same name
            entries[number].model_copy(update={"id": first_id[key]})
            for key, entries in by_student.items()
            if len(entries) > number
        )
        update = {"entries": these, "again": (), "faults": () if number else faults}
        found.append(roster.model_copy(update=update))
    return tuple(found)


def attempt_folder(out: Path, number: int) -> Path:
    """Return the folder of the batch that grades all attempts of that number, counted from 1."""
    return out / FOLDER / str(number)


def combine(out: Path, batches: Sequence[BatchFolder], rubric: LoadedRubric, counts: Counts) -> BatchFolder:
    """Make the lab's results of what counts of each student's attempts, with what people decided; return its folder.

    Raises UsageError for faulty overrides, Busy if a batch works there, OutputError.
    """
    make_folder(out)
    with hold_folder(out):
        run = batches[0].run
        settler = Settler(rubric.rubric, read_overrides(out / OVERRIDES, rubric.rubric, ids_of(run)))
        folder, known = BatchFolder(out, run), _by_student(batches)
        entries = tuple(
            _bring(folder, known[key], rubric, settler, counts)
            if (key := folder_key(entry.id)) in known
            else entry
            for entry in run.entries
        )
        now = run.model_copy(update={"entries": entries, "state": batches[-1].run.state})
        write_run(out, now)
        return write_books(BatchFolder(out, now), rubric.rubric, now.state, 0)


def _by_student(batches: Sequence[BatchFolder]) -> dict[str, list[Attempt]]:
    found: dict[str, list[Attempt]] = {}
    for number, batch in enumerate(batches, start=1):
        for entry in batch.run.entries:
            result = batch.earlier(entry)
            if result is not None:
                one = Attempt(number, entry, result, batch.folder_of(entry))
                found.setdefault(folder_key(entry.id), []).append(one)
    return found


def _bring(
    folder: BatchFolder, attempts: Sequence[Attempt], rubric: LoadedRubric, settler: Settler, counts: Counts
) -> Entry:
    """Put the chosen attempt's evidence and the reports of what counts into the student's folder, unless they are there
    already; return that attempt's row of the roster."""
    lab = rubric.rubric
    one = counting_attempt(attempts, counts, lab)
    target = folder.folder_of(one.entry)
    earlier = read_result(target)
    automatic = unsettled(counting_result(attempts, one, counts, lab), lab)
    now = settler.settle(automatic, one.entry.id, one.result.handed_in, earlier or automatic)
    if now != earlier:
        rewrite(target, now, lab, rubric.docs, of=one.folder)
    return one.entry


def counting_attempt(attempts: Sequence[Attempt], counts: Counts, rubric: Rubric) -> Attempt:
    """Return the attempt that counts; of several with as many points the first, which took the fewest late days. One
    that could not be graded counts only where none could.

    By criterion, it is the one up to which the best of each criterion comes to most, after what it costs that this one
    was late: what a late attempt earned is not had at the price of an earlier one.
    """
    graded = [one for one in attempts if one.result.status != "error"] or attempts
    if counts == "last":
        return graded[-1]

    def points(one: Attempt) -> float:
        if counts == "best":
            return one.result.points
        best = _best_so_far(attempts, one, rubric)
        return settle(best, rubric, overrides={}, handed_in=one.result.handed_in).points

    return max(graded, key=lambda one: (points(one), -one.number))


def counting_result(
    attempts: Sequence[Attempt], chosen: Attempt, counts: Counts, rubric: Rubric
) -> GradingResult:
    """Return the automatic result that counts, with what became of all attempts.

    By criterion, each one is taken from the attempt in which it earned most, and says from which.
    """
    points = tuple(one.result.points if one.result.status != "error" else None for one in attempts)
    result = _best_so_far(attempts, chosen, rubric) if counts == "by-criterion" else chosen.result
    told = Attempts(counts=counts, chosen=chosen.number, points=points)
    return result.model_copy(update={"attempts": told})


def _best_so_far(attempts: Sequence[Attempt], last: Attempt, rubric: Rubric) -> GradingResult:
    """Return an attempt's result with the best of each criterion in it and in the attempts before."""
    until = [one for one in attempts if one.number <= last.number]
    judged = [(one.number, {c.id: c for c in unsettled(one.result, rubric).criteria}) for one in until]
    automatic = unsettled(last.result, rubric)
    criteria = tuple(_best(c, judged) for c in automatic.criteria)
    return automatic.model_copy(update={"criteria": criteria, **total_fields(rubric, criteria)})


def _best(
    criterion: CriterionResult, attempts: Sequence[tuple[int, dict[str, CriterionResult]]]
) -> CriterionResult:
    """Return the criterion as the attempt has it that earned most for it, the later one of two that earned as much."""
    known = [(number, criteria[criterion.id]) for number, criteria in attempts if criterion.id in criteria]
    better = [(n, one) for n, one in known if not one.status.is_open and one.points > criterion.points]
    if not better:
        return criterion
    number, best = max(better, key=lambda one: (one[1].points, one[0]))
    return best.model_copy(update={"message": f"in attempt {number}: {best.message}".rstrip(": ")})
