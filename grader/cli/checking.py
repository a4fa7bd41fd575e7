"""`grader check [PATH]`: the student's own look before handing in."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from grader import pipeline
from grader.cli.display import open_progress
from grader.cli.outcome import exit_code, settled, staged_code, worst
from grader.cli.output import say, say_beside
from grader.cli.host_support import nothing_runs, the_rest
from grader.cli.host_support import say_unwalled
from grader.cli.select_rubric import Chosen, choose_all, only
from grader.cli.outcome import show
from grader.errors import ExitCode, UsageError
from grader.files import check_writable
from grader.intake import safe_name
from grader.model.git_status import Standing
from grader.model.progress import Silence
from grader.model.result import GradingResult
from grader.report.hidden import hidden_ids, without_hidden
from grader.report.terminal import open_console
from grader.rubric.load import LoadedRubric
from grader.rubric.needs import needs_ros
from grader.student.git_status import write_staged
from grader.temporary import temporary_folder
import threading
from collections.abc import Iterator
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.text import Text
from grader.cli.output import say_beside
from grader.model.git_status import Point, Standing
from grader.report.terminal import emit
from grader.report.text import line
from grader.student.git_status import ask, standing, surroundings

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode
    from grader.student.watching.loop import Shown


def run(
    *,
    path: str = ".",
    rubric: str | None = None,
    static: bool = False,
    staged: bool = False,
    watch: bool = False,
    out: Path | None = None,
    sandbox: Mode = "auto",
    as_json: bool = False,
) -> ExitCode:
    """Grade the package at `path` with hidden criteria left out; with `static`, from its files alone.

    Where packages of several labs are there, one after the other. `staged` looks at git's index instead of the disk,
    and gives the code of a hook: what fails, fails it, and nothing else. With `watch`, again whenever a file of it is
    saved, until Ctrl-C.
    """
    if staged and (watch or not static):
        raise UsageError("--staged goes with --static, and not with --watch", hint="add --static")
    chosen = choose_all(Path(path), rubric)
    if watch or as_json:
        only(chosen)
    if watch and not Path(chosen[0].source).is_dir():
        raise UsageError(
            f"{path} is no folder, so nothing is saved in it", hint="watch your package's folder"
        )
    if out is not None:
        check_writable(out)
    options = pipeline.GradeOptions(
        sandbox=sandbox,
        submission_id=None,
        static_only=static,
        keep_hidden=False,
        files=watch or out is not None,
    )
    running = [one.rubric for one in chosen if not static and needs_ros(one.rubric)]
    if running:
        say_unwalled(sandbox)
    if watch:
        _tell(chosen[0])
        source = str(Path(chosen[0].source).resolve())
        return _watch(source, chosen[0].rubric, options, out=out, as_json=as_json)
    several, told = len(chosen) > 1, set[str]()
    return worst(
        _check(one, options, out, as_json=as_json, staged=staged, several=several, told=told)
        for one in chosen
    )


def _tell(chosen: Chosen) -> None:
    """What was chosen, before anything else is said."""
    if chosen.words:
        say_beside(chosen.words)


def _check(
    chosen: Chosen,
    options: pipeline.GradeOptions,
    out: Path | None,
    *,
    as_json: bool,
    staged: bool,
    several: bool,
    told: set[str],
) -> ExitCode:
    """One package. What git's state has `told` already, for another one, is not said again."""
    _tell(chosen)
    static, rubric = options.static_only, chosen.rubric.rubric
    if several and chosen.package is not None:
        options = replace(options, submission_id=safe_name(chosen.package.resolve().name))
        say("")
    with ExitStack() as stack:
        own = stack.enter_context(temporary_folder("check"))
        source = chosen.source
        if staged:
            source = str(
                write_staged(_package(chosen), own / "index", index=os.environ.get("GIT_INDEX_FILE", ""))
            )
            options = replace(options, submission_id=safe_name(_package(chosen).resolve().name))
        unrun = "--static" if static else nothing_runs() if needs_ros(chosen.rubric) else ""
        inquiry = Inquiry(chosen.package, own / "git") if chosen.package is not None else None
        folder = out or own
        early = not (as_json or unrun)
        with nullcontext(Silence()) if staged else open_progress(early=early) as progress:
            result = pipeline.grade(source, chosen.rubric, folder, options, progress)
        shown = without_hidden(result, rubric)
        kept = folder / result.submission.id if out is not None else None
        standing = inquiry.result() if inquiry is not None else Standing()
        if as_json:
            shown = shown.model_copy(update={"standing": standing})
        hidden = len(hidden_ids(rubric))
        code = show(shown, rubric, kept, hidden=hidden, as_json=as_json, static=static, unrun=unrun)
        for words in () if static or not unrun else the_rest():
            (say_beside if as_json else say)(words)
        if as_json:
            print_beside(standing)
        else:
            print_standing(news(standing, told), open_console(sys.stdout))
        graded = shown.status != "error"
        return staged_code(shown.criteria, rubric) if staged and graded else code


def _package(chosen: Chosen) -> Path:
    if chosen.package is None:
        raise UsageError(f"there is no package in {chosen.source}", hint="leave out --staged")
    return chosen.package


def _watch(
    source: str, rubric: LoadedRubric, options: pipeline.GradeOptions, *, out: Path | None, as_json: bool
) -> ExitCode:
    from grader.student.watching.grading import Grading  # noqa: PLC0415 - nobody else needs what this loads
    from grader.student.watching.kept import Kept  # noqa: PLC0415
    from grader.student.watching.loop import Watched, watch  # noqa: PLC0415
    from grader.student.watching.saves import WatchedFolders  # noqa: PLC0415
    from grader.student.watching.snapshot import take_picture  # noqa: PLC0415

    static = options.static_only

    def code(result: GradingResult) -> ExitCode:
        return exit_code(settled(result.criteria) if static else result.criteria, rubric.rubric)

    without = out.resolve() if out is not None else None
    with ExitStack() as stack:
        grading = Grading(
            source=source,
            rubric=rubric,
            out=without or stack.enter_context(temporary_folder("check")),
            options=options,
            progress=lambda first: (
                nullcontext(Silence()) if static else open_progress(early=first and not as_json)
            ),
            code=code,
        )
        watched = Watched(
            folder=Path(source),
            look=lambda: take_picture(source, rubric.rubric.package, without=without),
            grade=grading,
            without=without,
            runs=not static,
        )
        kept = Kept(stack.enter_context(temporary_folder("check")), rubric.rubric)
        saves = stack.enter_context(WatchedFolders())
        return watch(watched, saves, kept, _shown(Path(source), rubric, static=static, as_json=as_json))


def _shown(folder: Path, rubric: LoadedRubric, *, static: bool, as_json: bool) -> Shown:
    from grader.student.watching.shown import JsonShown, ScreenShown  # noqa: PLC0415 - as above

    if as_json:
        return JsonShown(sys.stdout)
    hidden = len(hidden_ids(rubric.rubric))
    return ScreenShown(folder.name, rubric.rubric, sys.stdout, hidden=hidden, static=static)


# [cli.handing_in] Says how what was checked stands to what will be marked. Git is asked beside the grading, and holds nobody up.

TITLE = "What is marked is what is pushed. It differs from what was checked:"
REMARKS = "Handing in"
LIMIT = 300
PATIENCE_S = 10.0


class Inquiry:
    """Asks git about the package in `package`, in a thread that ends with the program."""

    def __init__(self, package: Path, base: Path) -> None:
        self._package, self._base = package, base
        self._around = surroundings(os.environ, Path.cwd())
        self._found = Standing()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    def result(self) -> Standing:
        """What there is to say; nothing where git does not come back."""
        self._thread.join(PATIENCE_S)
        return self._found

    def _ask(self) -> None:
        self._found = standing(ask(self._package, self._base), self._around)


def news(found: Standing, told: set[str]) -> Standing:
    """What is not among the texts that were `told` already; it is from now on."""
    points = tuple(point for point in found.points if point.text not in told)
    summary = found.summary if found.summary not in told else ""
    told |= {found.summary, *(point.text for point in points)}
    return Standing(points=points, summary=summary)


def print_standing(found: Standing, console: Console) -> None:
    """Print it below a report."""
    emit(console, _parts(found, console.encoding))


def print_beside(found: Standing) -> None:
    """Print it to stderr, where stdout is for a program."""
    for point in found.points:
        say_beside(point.text)


def _parts(found: Standing, encoding: str) -> Iterator[RenderableType]:
    if found.summary:
        yield Text(f"\n{_fitted(found.summary, encoding)}", "dim")
    differing = [point for point in found.points if not point.remark]
    remarks = [point for point in found.points if point.remark]
    for title, points in ((TITLE, differing), (REMARKS, remarks)):
        if points:
            yield Text(f"\n{title}", "bold")
        for point in points:
            yield from _point(point, encoding)


def _point(point: Point, encoding: str) -> Iterator[RenderableType]:
    yield Padding(Text(_fitted(point.text, encoding)), (0, 0, 0, 2))
    for command in filter(None, point.mend.split(" && ")):
        yield Padding(Text(_fitted(command, encoding), "bold"), (0, 0, 0, 6))


def _fitted(text: str, encoding: str) -> str:
    return line(text, LIMIT).encode(encoding, "backslashreplace").decode(encoding)
