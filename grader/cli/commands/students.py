"""The commands that a bare `grader` shows first: those of students."""

import sys
from pathlib import Path
from typing import Annotated

from grader.cli.declare import STUDENTS, Argument, Flag, Option, command, loading
from grader.cli.options import RUBRIC, STATIC, JsonFlag, PackageOption, SandboxOption
from grader.errors import ExitCode, UsageError


@command("check", group=STUDENTS, runs_code=True)
def check(
    *,
    path: Annotated[str, Argument("PATH", "your package's folder (default: this folder)")] = ".",
    rubric: Annotated[str | None, RUBRIC] = None,
    package: PackageOption = None,
    static: Annotated[bool, STATIC] = False,
    staged: Annotated[
        bool,
        Flag(
            "--staged", "with --static, for a pre-commit hook: check what git has staged, exit 1 if it fails"
        ),
    ] = False,
    watch: Annotated[
        bool, Flag("--watch", "stay, and check again whenever you save a file, until Ctrl-C")
    ] = False,
    out: Annotated[
        Path | None,
        Option("--out", "DIR", "keep the results in DIR/<submission id>/ (default: only show them)"),
    ] = None,
    sandbox: SandboxOption = "auto",
    as_json: JsonFlag = False,
) -> ExitCode:
    """Check your own package before you submit it.

    Hidden criteria are left out. If there are packages of several labs, they are checked one after the other.
    """
    if staged and (watch or not static):
        raise UsageError("--staged goes with --static, and not with --watch", hint="add --static")
    with loading():
        from grader import pipeline
        from grader.cli.checking import Check, check_package, say_choice, watch_package
        from grader.cli.host_support import warn_without_sandbox
        from grader.cli.outcome import worst
        from grader.cli.select_rubric import choose_all, only
        from grader.files import check_writable
        from grader.rubric.load import needs_ros
    chosen = choose_all(Path(path), rubric, package or "")
    if watch or as_json:
        only(chosen)
    if watch and not Path(chosen[0].source).is_dir():
        raise UsageError(
            f"{path} is not a folder, so it cannot be watched", hint="watch your package's folder"
        )
    if out is not None:
        check_writable(out)
    options = pipeline.GradeOptions(
        sandbox=sandbox,
        submission_id=None,
        package=package or "",
        static_only=static,
        keep_hidden=False,
        files=watch or out is not None,
    )
    if not static and any(needs_ros(one.rubric) for one in chosen):
        warn_without_sandbox(sandbox)
    if watch:
        say_choice(chosen[0])
        source = str(Path(chosen[0].source).resolve())
        return watch_package(source, chosen[0].rubric, options, out=out, as_json=as_json)
    checked = Check(options=options, out=out, as_json=as_json, staged=staged, several=len(chosen) > 1)
    return worst(check_package(one, checked) for one in chosen)


@command("explain", group=STUDENTS)
def explain(
    *,
    name: Annotated[str, Argument("NAME", "a check, a criterion, or LAB/criterion")],
    rubric: Annotated[str | None, RUBRIC] = None,
) -> ExitCode:
    """Explain a check or a criterion: what it measures, why it matters, how to fix it."""
    with loading():
        from grader.cli.explanation import print_explanation
    print_explanation(name, rubric)
    return ExitCode.PASSED


@command("doctor", group=STUDENTS, looks_at_host=True)
def doctor(*, as_json: JsonFlag = False) -> ExitCode:
    """Show what works on this machine, and how to fix what does not.

    The exit code is NOT_GRADED if something is missing.
    """
    with loading():
        from grader.cli import doctor as machine
        from grader.cli.output import say_json
    rows = machine.diagnose()
    if as_json:
        say_json([row.model_dump() for row in rows])
    else:
        machine.print_rows(rows, sys.stdout)
    return ExitCode.NOT_GRADED if any(row.state == "missing" for row in rows) else ExitCode.PASSED
