"""What the commands for a class and for a course do: grade, review, write gradebooks, compare."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from grader.classes.batch.folder import RUN, BatchFolder, open_batch
from grader.classes.batch.job import Executor, LocalExecutor
from grader.classes.batch.run import RESULTS, BatchOptions, run_batch
from grader.classes.course import (
    LabStatus,
    attempt_folder,
    book_of,
    combine,
    marks_of,
    rounds,
    rows_of,
    status_of,
    with_late_days,
)
from grader.classes.feedback.forms import FORMS, SendSettings
from grader.classes.feedback.publish import publication_remarks, published_rows, read_published
from grader.classes.feedback.send import Recipients as WantedFeedback
from grader.classes.gradebook import write_gradebook
from grader.classes.gradebook.table import Book, GradebookFormat, GradebookRow
from grader.classes.roster import Local, Roster, read_roster
from grader.classes.roster.exports import is_download, unpack_download
from grader.classes.similarity.sources import PLACE, percent, stretches
from grader.cli import publishing
from grader.cli.class_display import open_class_display, print_batch
from grader.cli.declare import STDOUT
from grader.cli.host_support import require_room, warn_without_sandbox
from grader.cli.output import say, say_beside, say_json
from grader.errors import ExitCode, GraderError, UsageError
from grader.files import temporary_folder
from grader.model import SandboxMode
from grader.model.batch import BatchRun, Pair, Similarity
from grader.portable import cores
from grader.report.terminal import emit, open_console
from grader.report.text import line
from grader.rubric.course import load_course, split_name
from grader.rubric.load import PIN, LoadedRubric, load_rubric, needs_ros, split_pin
from grader.wording import first_few, plural

if TYPE_CHECKING:
    from grader.classes.review.session import ReviewSession

JOBS_PER_CORE = 4
"""Most of a grading's time is spent waiting for what the student's nodes send."""


def grade_class(
    roster: Roster,
    rubric: str,
    loaded: LoadedRubric,
    options: BatchOptions,
    exchange: str | None,
    *,
    as_json: bool,
) -> ExitCode:
    """Grade a class by the value of `--rubric`, print what came of it, and return the exit code."""
    if of_course := split_name(split_pin(rubric)[0]):
        roster = with_late_days(roster, load_course(of_course[0]), of_course[1])
    if needs_ros(loaded) and not (options.static_only or options.cluster):
        require_room(gradings=options.jobs)
        warn_without_sandbox(options.sandbox, loaded)
    for fault in roster.faults:
        say_beside(f"roster: {fault}")
    with open_class_display() as watcher:
        chosen = executor(options, exchange)
        try:
            folder = run_batch(
                roster, rubric_source(rubric), loaded, options, executor=chosen, watcher=watcher
            )
        except KeyboardInterrupt:
            # it may be too early for a `run.json`
            with suppress(GraderError):
                counts = open_batch(options.out).run.counts
                done = counts.submissions - counts.missing
                say_beside(f"{done} of {counts.submissions} done; the same command continues")
            raise
    print_batch(folder, as_json=as_json)
    return exit_code(folder.run)


def rubric_source(rubric: str) -> str:
    """Return the value of `--rubric` so that it is found again from any folder."""
    name, pin = split_pin(rubric)
    of_course = split_name(name)
    path = of_course[0] if of_course else Path(name)
    if not path.is_file():
        return rubric
    return f"{path.absolute()}{f'#{of_course[1]}' if of_course else ''}{PIN if pin else ''}{pin}"


def exit_code(run: BatchRun) -> ExitCode:
    """Return the exit code of the worst submission."""
    counts = run.counts
    if counts.error or counts.missing:
        return ExitCode.NOT_GRADED
    if counts.inconclusive:
        return ExitCode.INCONCLUSIVE
    return ExitCode.PASSED if counts.passed == counts.submissions else ExitCode.BELOW_PASS_MARK


def default_jobs(rubric: LoadedRubric, *, static: bool) -> int:
    """Return how many submissions are graded at a time."""
    return cores() if static or not rubric.rubric.scenarios else cores() * JOBS_PER_CORE


def allowed_folders(folders: Sequence[Path], *, remote_only: bool) -> Local:
    """Return which paths of this machine a roster may name. Raises UsageError."""
    if folders and remote_only:
        raise UsageError("--remote-only forbids what --allow-local allows", hint="leave out one of them")
    for folder in folders:
        if not folder.is_dir():
            raise UsageError(f"--allow-local {folder}: there is no such folder", hint="give a folder")
    return Local(folders=tuple(folder.absolute() for folder in folders), remote_only=remote_only)


def read_listed(path: Path, out: Path, local: Local) -> Roster:
    """Return the roster at `path`; a platform's download is unpacked into `out` first."""
    return read_roster(unpack_download(path, out) if is_download(path) else path, local)


def with_package(roster: Roster, package: str) -> Roster:
    """Return the roster with `package` in every row that names none."""
    entries = (e if e.package else e.model_copy(update={"package": package}) for e in roster.entries)
    return roster.model_copy(update={"entries": tuple(entries)})


def executor(options: BatchOptions, exchange: str | None) -> Executor:
    """Return the processes of this machine, or the cluster. Raises UsageError."""
    if not options.cluster:
        given = {"--exchange": exchange is not None, "--cluster-insecure": options.cluster_insecure}
        for flag in (name for name, there in given.items() if there):
            raise UsageError(f"{flag} goes with --cluster", hint="leave it out")
        return LocalExecutor(options.jobs)
    from grader.classes.cluster.executor import ClusterExecutor  # noqa: PLC0415 - an extra

    return ClusterExecutor(
        options.cluster,
        options.out,
        exchange,
        insecure=options.cluster_insecure,
        say=lambda text: say_beside(f"cluster: {text}"),
    )


ENDINGS: dict[GradebookFormat, str] = {"csv": ".csv", "jsonl": ".jsonl", "xlsx": ".xlsx"}
COLUMNS = ("lab", "due", "graded", "open", "not graded", "published", "sent")


@dataclass(frozen=True, kw_only=True)
class WantedBook:
    """What the command line says of a gradebook. `wide`: with a column for each criterion of a class, or each lab of a
    course."""

    form: GradebookFormat
    out: str
    template: Path | None
    column: str
    wide: bool
    drafts: bool


def grade_lab(
    path: Path,
    name: str,
    *,
    jobs: int | None,
    only: Sequence[str],
    allow_local: Sequence[Path],
    static: bool,
    sandbox: SandboxMode,
    as_json: bool,
) -> ExitCode:
    """Grade one lab of a course, print what came of it, and return the exit code."""
    course = load_course(path)
    lab, source = course.lab(name), course.rubric(name)
    loaded = load_rubric(source)
    if lab.roster is None:
        raise UsageError(f"{path}: {name} has no roster", hint="name it there: roster: lab1.csv")
    out, local = course.results(name), allowed_folders(allow_local, remote_only=False)
    roster = read_listed(course.beside(lab.roster), out, local)

    def options(folder: Path) -> BatchOptions:
        return BatchOptions(
            out=folder,
            jobs=jobs or default_jobs(loaded, static=static),
            sandbox=sandbox,
            static_only=static,
            only=only,
            allow_local=tuple(str(one) for one in local.folders),
        )

    if lab.attempts is None:
        return grade_class(roster, source, loaded, options(out), None, as_json=as_json)
    graded: list[BatchFolder] = []
    for number, attempts in enumerate(rounds(roster), start=1):
        say_beside(f"attempt {number}: {plural(len(attempts.entries), 'submission')}")
        # only what counts in the end is printed as JSON
        grade_class(attempts, source, loaded, options(attempt_folder(out, number)), None, as_json=False)
        graded.append(open_batch(attempt_folder(out, number)))
    whole = combine(out, graded, loaded, lab.attempts)
    print_batch(whole, as_json=as_json)
    return exit_code(whole.run)


def publish_lab(path: Path, name: str, *, dry_run: bool, author: str | None) -> ExitCode:
    """Publish one lab, send it by the course's form of feedback, and return the worse exit code of both."""
    course = load_course(path)
    folder = course.results(name)
    published = publishing.publish(
        folder, (), dry_run=dry_run, show_hidden=False, author=author, as_json=False
    )
    form = course.course.feedback
    if form is None or dry_run:
        return published
    settings = SendSettings(folder=folder, told=say_beside)
    sent = publishing.send(folder, FORMS[form], settings, WantedFeedback(), drafts=False, dry_run=False)
    return sent if sent is not ExitCode.PASSED else published


def print_status(path: Path, *, as_json: bool) -> ExitCode:
    """Print how far each lab is, and what to do next."""
    course = load_course(path)
    found = [status_of(course, name) for name in course.course.labs]
    if as_json:
        say_json([{**asdict(one), "deadline": one.deadline and one.deadline.isoformat()} for one in found])
        return ExitCode.PASSED
    table = Table(*COLUMNS, box=None, pad_edge=False)
    for one in found:
        table.add_row(*_cells(one))
    # titles and names are no markup of rich's
    console = Console(markup=False, emoji=False, highlight=False)
    console.print(table)
    for one in found:
        if one.to_settle:
            say(f"{one.name}: late days have changed for {one.to_settle} since they were graded")
        if one.to_do:
            say(f"{one.name}: {one.to_do}")
    return ExitCode.PASSED


def _cells(one: LabStatus) -> tuple[str, ...]:
    due = f"{one.deadline:%Y-%m-%d %H:%M %Z}" if one.deadline else "-"
    changed = f" ({one.changed} changed)" if one.changed else ""
    graded = f"{one.graded} of {one.submissions}" if one.submissions else "-"
    counts = (str(one.open), str(one.error + one.missing), f"{one.published}{changed}", str(one.sent))
    return (one.name, due, graded, *counts)


def write_course_gradebook(path: Path, wanted: WantedBook) -> ExitCode:
    """Write the course's gradebook; what a person has to know about it goes to stderr."""
    course = load_course(path)
    marks = marks_of(course, drafts=wanted.drafts)
    if not marks:
        raise UsageError(
            f"{path}: none of its labs has been graded so far", hint=f"grader course status {path} lists them"
        )
    suffix = wanted.template.suffix if wanted.template else ENDINGS.get(wanted.form, f"-{wanted.form}.csv")
    usual = path.with_name(f"gradebook{suffix}")
    publish = f"grader course publish {course.path}"
    more = (
        f"{one.name}: these are drafts: none of it is published yet ({publish} {one.name})"
        for one in marks
        if one.drafts and not wanted.drafts
    )
    return _write_book(book_of(course, marks), rows_of(course, marks), usual, wanted, more)


def write_class_gradebook(folder: Path, wanted: WantedBook) -> ExitCode:
    """Write the gradebook of what is published; of a class of which nothing is published, of results as they are now.

    What a person has to know about it goes to stderr.
    """
    batch, published = open_batch(folder), read_published(folder)
    by_drafts = wanted.drafts or not published.history
    name = Path(
        RESULTS if wanted.form == "jsonl" else f"gradebook{ENDINGS.get(wanted.form, f'-{wanted.form}.csv')}"
    )
    if not by_drafts and wanted.form in {"csv", "jsonl"}:  # the batch writes its own, of drafts
        name = name.with_stem(f"{name.stem}-published")
    if wanted.template:  # Blackboard's tab-separated tables end in .xls
        name = name.with_suffix(wanted.template.suffix)
    rows = batch.rows() if by_drafts else published_rows(batch, published)
    more = () if wanted.drafts else publication_remarks(batch, published)
    return _write_book(batch.book(), rows, folder / name, wanted, more)


def _write_book(
    book: Book, rows: Iterable[GradebookRow], usual: Path, wanted: WantedBook, more: Iterable[str]
) -> ExitCode:
    """Write a gradebook to `--out`, else to its usual place, and print its remarks and `more` on stderr."""
    target = Path(wanted.out) if wanted.out else usual
    if wanted.template and wanted.out != STDOUT and target.exists() and target.samefile(wanted.template):
        raise UsageError(f"{target} is the template itself", hint="give another name with --out")
    # a file that is written whole goes to stdout, or nothing does
    with temporary_folder("gradebook") as temporary:
        place = Path(temporary, usual.name) if wanted.out == STDOUT else target
        remarks = write_gradebook(
            book,
            rows,
            place,
            wanted.form,
            per_criterion=wanted.wide,
            template=wanted.template,
            column=wanted.column,
        )
        for remark in (*remarks, *more):
            say_beside(f"{wanted.form}: {remark}")
        if wanted.out == STDOUT:
            with place.open("rb") as written:
                shutil.copyfileobj(written, sys.stdout.buffer)
        else:
            say(str(target))
    return ExitCode.PASSED


def reviewer(named: str | None) -> str:
    """Return who reviews: the name given, else git's. Raises UsageError for what is not a name."""
    from grader.classes.review.cards import Wrong, author_of  # noqa: PLC0415 - only `grader review` has its library
    from grader.host_programs import git_user  # noqa: PLC0415

    try:
        return author_of(git_user() if named is None else named)
    except Wrong as error:
        raise UsageError(f"--author: {error}") from error


def serve_review(review: ReviewSession, *, port: int, author: str, no_browser: bool) -> ExitCode:
    """Serve the review's page until Ctrl-C. Raises UsageError where the share has no submission."""
    from grader.classes.review.serve import browser, serve  # noqa: PLC0415 - as above

    folder = review.path
    if not review.items():
        raise UsageError(f"{folder}: no submission is in this share", hint="see --group, --marker and --of")
    with ExitStack() as stack:

        def opened(address: str) -> None:
            tried = stack.enter_context(browser(address, wanted=not no_browser))
            say(f"{'Opening' if tried else 'Open'} {address}")
            say("Only this machine can reach it, and only at this address. Press Ctrl-C to end it.")
            sys.stdout.flush()  # a program that reads it from a pipe needs the address now

        def ending(left: int) -> None:
            if left:
                reports = plural(left, "report")
                say(f"Writing {reports}. Decisions are kept: Ctrl-C again leaves it to the next review.")
                sys.stdout.flush()

        done = serve(review, port=port, author=author, opened=opened, ending=ending)
    if done:
        say("Ended. Everything is saved and written.")
        return ExitCode.PASSED
    trouble = review.background.trouble
    say(f"Ended. Your decisions are in overrides.yaml, but the gradebook is not written: {trouble}")
    say(f"  hint: once that is fixed, grader regrade {folder} writes it")
    return ExitCode.NOT_GRADED


NAME_CHARS = 22
PATH_CHARS = 40
TEXT_CHARS = 300
PAIRS_SHOWN = 50
IDS_SHOWN = 20
HARMLESS = "For a person to look at: no mark depends on it, and similarity alone proves nothing."


def print_similarity(
    similarity: Similarity, names: Mapping[str, str], written: Sequence[Path], stream: IO[str]
) -> None:
    """Print the pairs that are alike, and the files that were `written`."""
    console = open_console(stream)
    emit(console, _report(similarity, names))
    emit(console, [Text(f"Written: {line(str(path), TEXT_CHARS)}") for path in written])


def submissions_in(folder: Path) -> tuple[dict[str, Path], dict[str, str], dict[str, str]]:
    """Return the folders, names and groups of submissions by id: the batch's, or every folder with evidence in it."""
    if (folder / RUN).exists():
        batch = open_batch(folder)
        entries = batch.run.entries
        folders = {entry.id: batch.folder_of(entry) for entry in entries}
        return folders, {e.id: e.name for e in entries}, {e.id: e.group for e in entries}
    try:
        below = sorted(path for path in folder.iterdir() if path.joinpath(*PLACE).is_file())
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}", hint="give the --out of `grader batch`") from error
    if not below:
        raise UsageError(
            f"{folder} contains no submissions with evidence", hint="give the --out of `grader batch`"
        )
    return {path.name: path for path in below}, {}, {}


def starter_of(folder: Path) -> list[Path]:
    """Return the folder of the starter that the batch's rubric names, as far as the rubric is still there."""
    with suppress(GraderError):
        if (folder / RUN).exists():
            rubric = load_rubric(open_batch(folder).run.rubric_source)
            return [rubric.path.parent / rubric.rubric.starter] if rubric.rubric.starter else []
    return []


def _report(similarity: Similarity, names: Mapping[str, str]) -> Iterator[RenderableType]:
    count = len(similarity.pairs)
    what = "1 pair is" if count == 1 else f"{count or 'no'} pairs are"
    yield Text(f"{similarity.compared} submissions compared, {what} nearly the same.")
    yield Text(HARMLESS)
    if similarity.pairs:
        yield _table(similarity, names)
    yield from map(Text, _tail(similarity))


def _table(similarity: Similarity, names: Mapping[str, str]) -> Padding:
    """Return the table with each pair on two lines and more: how alike, then where."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in ("share", "lines", "submission", "where"):
        table.add_column(Text(name), justify="right" if name in {"share", "lines"} else "left", no_wrap=False)
    for pair in similarity.pairs[:PAIRS_SHOWN]:
        for row in _rows(pair, names):
            table.add_row(*(Text(cell) for cell in row))
        table.add_row()
    return Padding(table, (1, 0, 0, 0))


def _rows(pair: Pair, names: Mapping[str, str]) -> Iterator[tuple[str, str, str, str]]:
    """Yield the one, then the other."""
    for name, share, lines, where in (
        (pair.a, pair.similarity_a, pair.lines_a, [(m.file_a, m.lines_a) for m in pair.files]),
        (pair.b, pair.similarity_b, pair.lines_b, [(m.file_b, m.lines_b) for m in pair.files]),
    ):
        places = [f"{line(path, PATH_CHARS)}:{stretches(found)}" for path, found in where if found]
        shown = names.get(name) or name
        yield f"{percent(share)} %", str(lines), line(shown, NAME_CHARS), "\n".join(dict.fromkeys(places))


def _tail(similarity: Similarity) -> Iterator[str]:
    if len(similarity.pairs) > PAIRS_SHOWN:
        yield f"{len(similarity.pairs) - PAIRS_SHOWN} more pairs are in the files below."
    for group in similarity.clusters:
        if len(group) > 2:
            names = first_few([line(name, NAME_CHARS) for name in group], IDS_SHOWN)
            yield f"{len(group)} belong together: {names}"
    if similarity.same_group:
        count = similarity.same_group
        yield (
            "1 pair within a group is not listed."
            if count == 1
            else f"{count} pairs within a group are not listed."
        )
    if similarity.too_little:
        count, total = len(similarity.too_little), similarity.compared
        yield (
            f"{count} of {total} have fewer than {similarity.min_lines} lines of their own besides the starter code, "
            f"the tutorials and what most share: too few to compare."
        )
    for one in similarity.not_compared[:IDS_SHOWN]:
        place = line(f"{one.id}: {one.file}" if one.file else one.id, TEXT_CHARS)
        yield f"Not compared: {place}: {line(one.reason, TEXT_CHARS)}"
    if len(similarity.not_compared) > IDS_SHOWN:
        yield f"Not compared: {len(similarity.not_compared) - IDS_SHOWN} more"
    yield from (f"Note: {note}" for note in similarity.notes)
