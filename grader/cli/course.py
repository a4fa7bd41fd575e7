"""What the commands for a course do and print."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from rich.console import Console
from rich.table import Table

from grader.classes.batch.folder import BatchFolder, open_batch
from grader.classes.batch.run import BatchOptions
from grader.classes.course.attempts import attempt_folder, combine, rounds
from grader.classes.course.labs import LabStatus, Marks, book_of, marks_of, rows_of, status_of
from grader.classes.feedback.forms import FORMS, Settings
from grader.classes.feedback.send import Wanted as WantedFeedback
from grader.classes.gradebook import write_gradebook
from grader.classes.gradebook.table import Form
from grader.classes.roster import read_roster
from grader.classes.roster.platforms import is_download, unpack_download
from grader.cli import batches, returning
from grader.cli.class_display import print_batch
from grader.cli.output import say, say_beside, say_json
from grader.errors import ExitCode, UsageError
from grader.model.sandbox_mode import SandboxMode
from grader.rubric.course import CourseFile, load_course
from grader.rubric.load import load_rubric
from grader.wording import plural

STDOUT = "-"
ENDINGS: dict[Form, str] = {"csv": ".csv", "jsonl": ".jsonl", "xlsx": ".xlsx"}
COLUMNS = ("lab", "due", "graded", "open", "not graded", "published", "sent")


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What the command line of `grader course grade` says."""

    jobs: int | None
    only: Sequence[str]
    allow_local: Sequence[Path]
    static: bool
    sandbox: SandboxMode
    as_json: bool


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What the command line of `grader course gradebook` says."""

    form: Literal["csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"]
    out: str
    template: Path | None
    column: str
    per_lab: bool
    drafts: bool


def grade_lab(path: Path, name: str, asked: Asked) -> ExitCode:
    """Grade one lab of a course, print what came of it, and return the exit code."""
    course = load_course(path)
    lab, source = course.lab(name), course.rubric(name)
    loaded = load_rubric(source)
    if lab.roster is None:
        raise UsageError(f"{path}: {name} has no roster", hint="name it there: roster: lab1.csv")
    out, listed = course.results(name), course.beside(lab.roster)
    local = batches.allowed_folders(asked.allow_local, remote_only=False)
    listed = unpack_download(listed, out) if is_download(listed) else listed
    roster = read_roster(listed, local)

    def options(folder: Path) -> BatchOptions:
        return BatchOptions(
            out=folder,
            jobs=asked.jobs or batches.default_jobs(loaded, static=asked.static),
            sandbox=asked.sandbox,
            static_only=asked.static,
            only=asked.only,
            allow_local=tuple(str(one) for one in local.folders),
        )

    if lab.attempts is None:
        return batches.grade_class(roster, source, loaded, options(out), None, as_json=asked.as_json)
    graded: list[BatchFolder] = []
    for number, attempts in enumerate(rounds(roster), start=1):
        say_beside(f"attempt {number}: {plural(len(attempts.entries), 'submission')}")
        batches.grade_class(
            attempts, source, loaded, options(attempt_folder(out, number)), None, as_json=False
        )
        graded.append(open_batch(attempt_folder(out, number)))
    whole = combine(out, graded, loaded, lab.attempts)
    print_batch(whole, as_json=asked.as_json)
    return batches.exit_code(whole.run)


def publish_lab(path: Path, name: str, *, dry_run: bool, author: str | None) -> ExitCode:
    """Publish one lab, send it by the course's form of feedback, and return the worse exit code of both."""
    course = load_course(path)
    folder = course.results(name)
    published = returning.publish(
        folder, (), dry_run=dry_run, show_hidden=False, author=author, as_json=False
    )
    form = course.course.feedback
    if form is None or dry_run:
        return published
    settings = Settings(folder=folder, told=say_beside)
    sent = returning.send(folder, FORMS[form], settings, WantedFeedback(), drafts=False, dry_run=False)
    return sent if sent is not ExitCode.PASSED else published


def print_status(path: Path, *, as_json: bool) -> ExitCode:
    """Print how far each lab is, and what to do next."""
    found = list(status_of(load_course(path)))
    if as_json:
        say_json([{**asdict(one), "deadline": one.deadline and one.deadline.isoformat()} for one in found])
        return ExitCode.PASSED
    table = Table(*COLUMNS, box=None, pad_edge=False)
    for one in found:
        table.add_row(*_cells(one))
    console = Console(markup=False, emoji=False, highlight=False)
    console.print(table)
    for one in found:
        if one.to_settle:
            say(f"{one.name}: late days have changed for {one.to_settle} since they were graded")
        if one.to_do:
            say(f"{one.name}: {one.to_do}")
    return ExitCode.PASSED


def _cells(one: LabStatus) -> Iterator[str]:
    due = f"{one.deadline:%Y-%m-%d %H:%M %Z}" if one.deadline else "-"
    changed = f" ({one.changed} changed)" if one.changed else ""
    yield from (
        one.name,
        due,
        f"{one.graded} of {one.submissions}" if one.submissions else "-",
        str(one.open),
    )
    yield from (str(one.error + one.missing), f"{one.published}{changed}", str(one.sent))


def write_gradebook_of(path: Path, wanted: Wanted) -> ExitCode:
    """Write the course's gradebook; what a person has to know about it goes to stderr."""
    course = load_course(path)
    marks = marks_of(course, drafts=wanted.drafts)
    if not marks:
        raise UsageError(
            f"{path}: no lab of it is graded so far", hint=f"grader course status {path} lists them"
        )
    suffix = wanted.template.suffix if wanted.template else ENDINGS.get(wanted.form, f"-{wanted.form}.csv")
    target = Path(wanted.out) if wanted.out else path.with_name(f"gradebook{suffix}")
    if wanted.template and wanted.out != STDOUT and target.exists() and target.samefile(wanted.template):
        raise UsageError(f"{target} is the template itself", hint="give another name with --out")
    with TemporaryDirectory(prefix="gradebook-") as temporary:
        place = Path(temporary, target.name) if wanted.out == STDOUT else target
        remarks = write_gradebook(
            book_of(course, marks),
            rows_of(course, marks),
            place,
            wanted.form,
            per_criterion=wanted.per_lab,
            template=wanted.template,
            column=wanted.column,
        )
        for remark in (*remarks, *_drafts(course, marks, drafts=wanted.drafts)):
            say_beside(f"{wanted.form}: {remark}")
        if wanted.out == STDOUT:
            with place.open("rb") as written:
                shutil.copyfileobj(written, sys.stdout.buffer)
        else:
            say(str(target))
    return ExitCode.PASSED


def _drafts(course: CourseFile, marks: Sequence[Marks], *, drafts: bool) -> Iterator[str]:
    for one in marks:
        if one.drafts and not drafts:
            command = f"grader course publish {course.path} {one.name}"
            yield f"{one.name}: these are drafts: nothing of it is published yet ({command})"
