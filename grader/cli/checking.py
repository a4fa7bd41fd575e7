"""What `grader check` does with the packages that were chosen: grade them, or watch one, without hidden criteria.

The command line comes in, a report on stdout and an exit code go out. Before the losses stands how the package differs
from what is pushed; git is asked about that in a thread beside the grading, and never holds it up.
"""

from __future__ import annotations

import os
import shlex
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field, replace
from itertools import groupby
from pathlib import Path

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from grader import pipeline
from grader.cli.display import REPORT, exit_code, judged_criteria, open_progress, show, staged_code, worst
from grader.cli.host_support import how_to_run_nodes, warn_without_sandbox, why_nothing_runs
from grader.cli.output import say, say_beside
from grader.cli.select_rubric import Chosen, only
from grader.errors import ExitCode, HostError, OutputError, UsageError
from grader.files import atomic_write, check_writable, temporary_folder
from grader.intake.gitdir import write_staged
from grader.intake.names import safe_name
from grader.model.result import GitStatus, GradingResult, Point, Progress, Silence
from grader.report.losses import arrange
from grader.report.terminal import fit_encoding, open_console
from grader.report.text import line
from grader.report.view import hidden_ids, without_hidden
from grader.rubric.find import named_labs
from grader.rubric.load import needs_ros
from grader.student.git_status import advise, read_environment

TITLE = "Only pushed work is marked. These changes aren't pushed yet:"
REMARKS = "Before you submit"
LINE_CHARS = 300
KEPT = ".grader"
GIT_TIMEOUT_S = 10.0


@dataclass(frozen=True, kw_only=True)
class CheckSession:
    """What all packages of one command line share. `out` is None if the results are only shown; `told` holds what was
    said about git's state already, for another package."""

    options: pipeline.GradeOptions
    out: Path | None
    as_json: bool
    staged: bool
    several: bool
    full: bool = False
    told: set[str] = field(default_factory=set)


def check_packages(path: str, chosen: Sequence[Chosen], check: CheckSession, *, watch: bool) -> ExitCode:
    """Check the packages chosen for `path` one after the other, or watch the only one. Return the worst exit code."""
    if watch or check.as_json:
        only(chosen)
    if watch and not Path(chosen[0].source).is_dir():
        raise UsageError(
            f"{path} is not a folder, so it cannot be watched", hint="watch your package's folder"
        )
    if check.out is not None:
        check_writable(check.out)
    if not check.options.static_only and any(needs_ros(one.rubric) for one in chosen):
        warn_without_sandbox(check.options.sandbox)
    if watch:
        say_choice(chosen[0])
        return watch_package(chosen[0], check)
    return worst(check_package(one, check) for one in chosen)


def say_choice(chosen: Chosen) -> None:
    """Say what was chosen, before anything else is said."""
    if chosen.words:
        say_beside(chosen.words)


def check_package(chosen: Chosen, check: CheckSession) -> ExitCode:
    """Grade one package and print its report."""
    say_choice(chosen)
    options = check.options
    # else all would be called like the folder that was given, and `--out` would keep the last one alone
    if check.several and chosen.package is not None:
        options = replace(options, submission_id=safe_name(chosen.package.resolve().name))
        say("")
    with temporary_folder("check") as own:
        source = chosen.source
        if check.staged:
            package = _package(chosen)
            # git tells a hook which index the commit is made of: `git commit -a` has one of its own
            source = str(write_staged(package, own / "index", index=os.environ.get("GIT_INDEX_FILE", "")))
            options = replace(options, submission_id=safe_name(package.resolve().name))
        static = options.static_only
        unrun = "--static" if static else why_nothing_runs() if needs_ros(chosen.rubric) else ""
        report = None if check.as_json or check.staged or static or check.out else report_place(chosen)
        # a report to keep needs the files that a mere check does without
        options = replace(options, files=options.files or report is not None)
        inquiry = GitInquiry(chosen.package, own / "git") if chosen.package is not None else None
        folder = check.out or own
        early = not (check.as_json or unrun)
        with nullcontext(Silence()) if check.staged else open_progress(early=early) as progress:
            result = pipeline.grade(source, chosen.rubric, folder, options, progress)
        kept = folder / result.submission.id
        if report is not None and (kept / REPORT).is_file():
            keep_report(kept / REPORT, report)
        found = inquiry.result() if inquiry is not None else GitStatus()
        return _print_check(result, chosen, check, found, unrun=unrun, folder=kept, report=report)


def _print_check(
    result: GradingResult,
    chosen: Chosen,
    check: CheckSession,
    found: GitStatus,
    *,
    unrun: str,
    folder: Path,
    report: Path | None,
) -> ExitCode:
    """Print the report, what git lacks and what to do next."""
    rubric, static = chosen.rubric.rubric, check.options.static_only
    shown = without_hidden(result, rubric)
    if check.as_json:
        shown = shown.model_copy(update={"standing": found})
    code = show(
        shown,
        rubric,
        folder if check.out is not None else None,
        hidden=len(hidden_ids(rubric)),
        as_json=check.as_json,
        static=static,
        unrun=unrun,
        remarks=() if check.as_json else list(_remarks(found, check)),
        full=check.full,
    )
    for words in () if static or not unrun else how_to_run_nodes():
        (say_beside if check.as_json else say)(words)
    for point in found.points if check.as_json else ():
        say_beside(point.text)
    if not (check.as_json or check.staged):
        for words in _what_next(shown, chosen, report if report is not None and report.is_file() else None):
            say(words)
    graded = shown.status != "error"
    return staged_code(shown.criteria, rubric) if check.staged and graded else code


def _package(chosen: Chosen) -> Path:
    if chosen.package is None:
        raise UsageError(f"there is no package in {chosen.source}", hint="leave out --staged")
    return chosen.package


def watch_package(chosen: Chosen, check: CheckSession) -> ExitCode:
    """Grade the package whenever one of its files is saved, until Ctrl-C."""
    from grader.student.watching import Grading, JsonLines, TerminalScreen, watch  # noqa: PLC0415 - slow to load

    static, rubric, source = check.options.static_only, chosen.rubric, Path(chosen.source).resolve()

    def code(result: GradingResult) -> ExitCode:
        return exit_code(judged_criteria(result.criteria) if static else result.criteria, rubric.rubric)

    def progress(first: bool) -> AbstractContextManager[Progress]:
        return nullcontext(Silence()) if static else open_progress(early=first and not check.as_json)

    without = check.out.resolve() if check.out is not None else None
    hidden = len(hidden_ids(rubric.rubric))
    screen = (
        JsonLines(sys.stdout)
        if check.as_json
        else TerminalScreen(source.name, rubric.rubric, sys.stdout, hidden=hidden, static=static)
    )
    with ExitStack() as stack:
        folder = without or stack.enter_context(temporary_folder("check"))
        grading = Grading(
            source=str(source),
            rubric=rubric,
            out=folder,
            options=check.options,
            progress=progress,
            code=code,
        )
        return watch(grading, screen, without=without)


class GitInquiry:
    """Asks git about the package in `package`, in a thread that ends with the program."""

    def __init__(self, package: Path, base: Path) -> None:
        self._package, self._base = package, base
        self._environment = read_environment(os.environ, Path.cwd())
        self._found = GitStatus()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    def result(self) -> GitStatus:
        """Return what git said; nothing if it does not answer in time."""
        self._thread.join(GIT_TIMEOUT_S)
        return self._found

    def _ask(self) -> None:
        self._found = advise(self._package, self._base, self._environment)


def report_place(chosen: Chosen) -> Path | None:
    """Return where the last report of a package is kept: `.grader/<its folder>/report.html` beside it."""
    beside = chosen.package or Path(chosen.source)
    if not beside.exists():
        return None  # a URL
    beside = beside.resolve()
    return beside.parent / KEPT / safe_name(beside.name) / REPORT


def keep_report(written: Path, place: Path) -> None:
    """Copy the report to its place, which git ignores; say so where it cannot be written."""
    folder = place.parent.parent
    # a link in a student's repository could let us write anywhere
    if folder.is_symlink() or place.parent.is_symlink() or place.is_symlink():
        say_beside(f"{place} is a link: no report is kept there")
        return
    try:
        # first, so that git never sees the report
        atomic_write(folder / ".gitignore", b"*\n")
        atomic_write(place, written.read_bytes())
    except (OutputError, HostError) as error:
        say_beside(error.message)


def _what_next(result: GradingResult, chosen: Chosen, report: Path | None) -> Iterator[str]:
    """Yield where the report is, and what explains the loss that costs most."""
    lab = chosen.rubric
    lost = arrange(result, lab.rubric).lost
    if report is not None:
        yield f"Report: {os.path.relpath(report) if report.is_relative_to(Path.cwd().parent) else report}"
    if lost:
        name = lost[0].criterion.id
        known = bool(named_labs(lab.rubric.id))
        yield f"Why: grader explain {f'{lab.rubric.id}/{name}' if known else f'{name} --rubric {lab.path}'}"
        yield "On each save: grader check --watch"


def _remarks(found: GitStatus, check: CheckSession) -> Iterator[RenderableType]:
    """Yield what git said and has not been said yet, for another package."""
    points = tuple(point for point in found.points if point.text not in check.told)
    summary = found.summary if found.summary not in check.told else ""
    check.told.update({found.summary, *(point.text for point in points)})
    yield from _parts(GitStatus(points=points, summary=summary), open_console(sys.stdout).encoding)


def _parts(found: GitStatus, encoding: str) -> Iterator[RenderableType]:
    if found.summary:
        yield Text(f"\n{_fit_encoding(found.summary, encoding)}", "dim")
    differing = [point for point in found.points if not point.remark]
    remarks = [point for point in found.points if point.remark]
    for title, points in ((TITLE, differing), (REMARKS, remarks)):
        if points:
            yield Text(f"\n{title}", "bold")
        for point in points:
            yield from _point(point, encoding)


def _point(point: Point, encoding: str) -> Iterator[RenderableType]:
    yield Padding(Text(_fit_encoding(point.text, encoding)), (0, 0, 0, 2))
    # each command of `a && b` on a line of its own, to be copied
    for is_between, words in groupby(shlex.split(point.fix), "&&".__eq__):
        if not is_between:
            yield Padding(Text(_fit_encoding(shlex.join(words), encoding), "bold"), (0, 0, 0, 6))


def _fit_encoding(text: str, encoding: str) -> str:
    return fit_encoding(line(text, LINE_CHARS), encoding)
