"""`grader check [PATH]`: the student's own look before handing in."""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from grader import pipeline
from grader.cli.display import open_progress
from grader.cli.handing_in import Inquiry, news, print_beside, print_standing
from grader.cli.outcome import exit_code, settled, staged_code, worst
from grader.cli.output import say, say_beside
from grader.cli.platform_support import nothing_runs, the_rest
from grader.cli.sandbox_report import say_unwalled
from grader.cli.select_rubric import Chosen, choose_all, only
from grader.cli.show import show
from grader.errors import ExitCode, UsageError
from grader.files import check_writable, temporary_folder
from grader.intake import safe_name
from grader.model.progress import Progress, Silence
from grader.model.result import GradingResult, Standing
from grader.report.terminal import open_console
from grader.report.view import hidden_ids, without_hidden
from grader.rubric.load import LoadedRubric, needs_ros
from grader.student.git_view import write_staged

if TYPE_CHECKING:
    from grader.model.submission import SandboxMode


def run(
    *,
    path: str = ".",
    rubric: str | None = None,
    static: bool = False,
    staged: bool = False,
    watch: bool = False,
    out: Path | None = None,
    sandbox: SandboxMode = "auto",
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
        files=out is not None,
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
    from grader.student.watch_screen import JsonLines, TerminalScreen  # noqa: PLC0415 - slow to load
    from grader.student.watching import Grading, watch  # noqa: PLC0415

    static, hidden = options.static_only, len(hidden_ids(rubric.rubric))

    def code(result: GradingResult) -> ExitCode:
        return exit_code(settled(result.criteria) if static else result.criteria, rubric.rubric)

    def progress(first: bool) -> AbstractContextManager[Progress]:
        return nullcontext(Silence()) if static else open_progress(early=first and not as_json)

    without = out.resolve() if out is not None else None
    name = Path(source).name
    screen = (
        JsonLines(sys.stdout)
        if as_json
        else TerminalScreen(name, rubric.rubric, sys.stdout, hidden=hidden, static=static)
    )
    with ExitStack() as stack:
        folder = without or stack.enter_context(temporary_folder("check"))
        grading = Grading(
            source=source, rubric=rubric, out=folder, options=options, progress=progress, code=code
        )
        return watch(grading, screen, without=without)
