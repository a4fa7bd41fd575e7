"""The commands that a bare `grader` shows first: those of students."""

import sys
from pathlib import Path
from typing import Annotated

from grader.cli.declare import (
    RUBRIC,
    STATIC,
    STUDENTS,
    AllFlag,
    Argument,
    Flag,
    JsonFlag,
    Option,
    PackageOption,
    SandboxOption,
    command,
    loading,
)
from grader.errors import ExitCode, UsageError

PATH = Argument("PATH", "your package's folder (default: this folder)")
STAGED = Flag(
    "--staged", "with --static, for a pre-commit hook: check what git has staged, exit 1 if it fails"
)
WATCH = Flag("--watch", "stay, and check again whenever you save a file, until Ctrl-C")
FIX = Flag("--fix", "show how to repair modes, line ends, tabs and misspelt names, and do it if you agree")
DRY_RUN = Flag("--dry-run", "with --fix: only show it, and exit 1 if a file would change")
YES = Flag("--yes", "with --fix: do not ask")
OUT = Option("--out", "DIR", "keep the results in DIR/<submission id>/ (default: only show them)")


@command("check", group=STUDENTS, runs_code=True)
def check(
    *,
    path: Annotated[str, PATH] = ".",
    rubric: Annotated[str | None, RUBRIC] = None,
    package: PackageOption = None,
    static: Annotated[bool, STATIC] = False,
    staged: Annotated[bool, STAGED] = False,
    watch: Annotated[bool, WATCH] = False,
    fix: Annotated[bool, FIX] = False,
    dry_run: Annotated[bool, DRY_RUN] = False,
    yes: Annotated[bool, YES] = False,
    out: Annotated[Path | None, OUT] = None,
    sandbox: SandboxOption = "auto",
    full: AllFlag = False,
    as_json: JsonFlag = False,
) -> ExitCode:
    """Check your own package before you submit it.

    Hidden criteria are left out. If there are packages of several labs, they are checked one after the other.
    """
    if staged and (watch or not static):
        raise UsageError("--staged goes with --static, and not with --watch", hint="add --static")
    if (dry_run or yes) and not fix:
        raise UsageError("--dry-run and --yes go with --fix", hint="add --fix")
    if fix and (staged or watch or as_json):
        raise UsageError("--fix goes with none of --staged, --watch and --json", hint="fix first")
    with loading():
        from grader.cli.checking import CheckSession, check_packages
        from grader.cli.select_rubric import choose_all
        from grader.pipeline import GradeOptions
        from grader.rubric.load import checkout_around
    options = GradeOptions(
        sandbox=sandbox,
        package=package or "",
        static_only=static,
        keep_hidden=False,
        files=watch or out is not None,
        repository=checkout_around(Path(path)),
    )
    chosen = choose_all(Path(path), rubric, package or "")
    if fix:
        from grader.cli.fixing import fix_packages

        wrong = fix_packages(chosen, dry_run=dry_run, yes=yes)
        if dry_run:
            return ExitCode.BELOW_PASS_MARK if wrong else ExitCode.PASSED
    session = CheckSession(
        options=options, out=out, as_json=as_json, staged=staged, several=len(chosen) > 1, full=full
    )
    return check_packages(path, chosen, session, watch=watch)


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
def doctor(*, rubric: Annotated[str | None, RUBRIC] = None, as_json: JsonFlag = False) -> ExitCode:
    """Show what works on this machine, and how to fix what does not.

    With a rubric, also which ROS packages it needs, and whether they are here. The exit code is NOT_GRADED if
    something is missing.
    """
    with loading():
        from grader.cli import host_support as machine
        from grader.cli.output import say_json
        from grader.rubric.load import load_rubric
    loaded = load_rubric(rubric) if rubric is not None else None
    rows = (*machine.diagnose(), *(machine.diagnose_rubric(loaded) if loaded is not None else ()))
    if as_json:
        say_json([row.for_json() for row in rows])
    else:
        machine.print_rows(rows, sys.stdout)
    return ExitCode.NOT_GRADED if any(row.state == "missing" for row in rows) else ExitCode.PASSED
