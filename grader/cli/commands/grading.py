"""The commands that a bare `grader` shows first, those of students; then those for one submission and for recorded
evidence.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.cli.declare import (
    INSTRUCTORS,
    RUBRIC,
    SIGN_EXIT_CODES,
    STATIC,
    STUDENTS,
    VERIFY_EXIT_CODES,
    AllFlag,
    Argument,
    Flag,
    JsonFlag,
    Option,
    PackageOption,
    SandboxOption,
    command,
    count,
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


DEFAULT_OUT = Path("grader-results")
PACKAGE = Option("--package", "NAME", "the package, if there are several")
RESULTS = Argument("RESULT", "result.json, the folder that it is in, or a folder of such folders")


@command("grade", group=INSTRUCTORS, runs_code=True)
def grade(
    *,
    source: Annotated[
        str, Argument("SOURCE", "a folder, a .zip or .tar.*, a git URL (also with @ref), or a .bag")
    ],
    rubric: Annotated[str, RUBRIC],
    out: Annotated[
        Path | None,
        Option("--out", "DIR", "write results to DIR/<submission id>/ (default: ./grader-results)"),
    ] = None,
    submission_id: Annotated[str | None, Option("--id", "NAME", "the submission's id")] = None,
    package: PackageOption = None,
    sandbox: SandboxOption = "auto",
    full: AllFlag = False,
    as_json: JsonFlag = False,
) -> ExitCode:
    """Grade one submission: a folder, an archive, a git URL or a recording."""
    with loading():
        from grader import pipeline
        from grader.cli.display import open_progress, show
        from grader.cli.host_support import warn_without_sandbox
        from grader.files import check_writable
        from grader.intake.open import is_recording
        from grader.rubric.load import load_rubric
    loaded = load_rubric(rubric)
    folder = out or DEFAULT_OUT
    check_writable(folder)
    options = pipeline.GradeOptions(sandbox=sandbox, submission_id=submission_id, package=package or "")
    # a recording was made elsewhere: nothing runs
    if not is_recording(Path(source)):
        warn_without_sandbox(sandbox, loaded)
    # with stdout in a file, all that counts is the report at the end
    with open_progress(early=sys.stdout.isatty() and not as_json) as progress:
        result = pipeline.grade(source, loaded, folder, options, progress)
    return show(result, loaded.rubric, folder / result.submission.id, as_json=as_json, full=full)


@command("record", runs_code=True)
def record(
    *,
    source: Annotated[str, Argument("SOURCE", "a submission, as for grader grade")],
    rubric: Annotated[str | None, RUBRIC] = None,
    package: Annotated[str | None, PACKAGE] = None,
    script: Annotated[Sequence[str], Option("--script", "FILE", "a script to run", repeated=True)] = (),
    launch: Annotated[Sequence[str], Option("--launch", "FILE", "a launch file to run", repeated=True)] = (),
    seconds: Annotated[float, Option("--seconds", "N", "how long (default: 10)")] = 10.0,
    out: Annotated[Path, Option("--out", "DIR", "write evidence to DIR/<submission id>/evidence/")],
    sandbox: SandboxOption = "auto",
) -> ExitCode:
    """Record evidence without grading.

    The rubric's scenarios are recorded, or one made of the scripts and launch files.
    """
    if rubric is not None and (script or launch):
        raise UsageError("give --rubric, or --script and --launch, not both")
    if rubric is None and not (script or launch):
        raise UsageError("nothing to run", hint="give --rubric, or --script FILE, or --launch FILE")
    with loading():
        from grader import pipeline
        from grader.cli.display import open_progress
        from grader.cli.host_support import warn_without_sandbox
        from grader.cli.output import say
        from grader.cli.select_rubric import only_package, rubric_to_record
        from grader.files import check_writable
        from grader.rubric.load import load_rubric
    if rubric is not None:
        loaded = load_rubric(rubric)
    else:
        loaded = rubric_to_record(package or only_package(source), script, launch, seconds)
    check_writable(out)
    options = pipeline.GradeOptions(sandbox=sandbox, package=package or "")
    warn_without_sandbox(sandbox)
    with open_progress() as progress:
        files = pipeline.record(source, loaded, out, options, progress)
    for file in files:
        say(str(file))
    return ExitCode.PASSED


@command("judge")
def judge(
    *,
    evidence: Annotated[
        Sequence[Path],
        Argument(
            "EVIDENCE",
            ".mcap, .bag and .db3 files, folders of them, or a folder of results with every submission",
        ),
    ],
    rubric: Annotated[str, RUBRIC],
    out: Annotated[str, Option("--out", "FILE", "write the criteria as JSON (default: -, stdout)")] = "-",
    jobs: Annotated[
        int | None, Option("--jobs", "N", "how many submissions at a time (default: one per core)", count)
    ] = None,
) -> ExitCode:
    """Judge recorded evidence again, without ROS."""
    with loading():
        from grader.classes.batch.renew_results import submissions_in
        from grader.cli.results import judge_evidence, judge_submissions
        from grader.portable import cores
        from grader.rubric.load import load_rubric
    loaded = load_rubric(rubric)
    several = submissions_in(evidence)
    if several:
        return judge_submissions(several, loaded, out, jobs or cores())
    return judge_evidence(evidence, loaded, out)


@command("inspect")
def inspect(
    *, file: Annotated[Path, Argument("FILE", "an .mcap, .bag or .db3 file")], as_json: JsonFlag = False
) -> ExitCode:
    """Show what is in an evidence file or a bag: rates, gaps, nodes."""
    with loading():
        from grader.cli.output import say_json
        from grader.cli.results import print_inspection
        from grader.evidence.inspect import inspect_file
    inspection = inspect_file(file)
    if as_json:
        say_json(inspection.model_dump(mode="json"))
    else:
        print_inspection(inspection, sys.stdout)
    return ExitCode.PASSED


@command("verify", exit_codes=VERIFY_EXIT_CODES)
def verify(
    *,
    results: Annotated[Sequence[Path], RESULTS],
    rubric: Annotated[str | None, RUBRIC] = None,
    allowed_signers: Annotated[
        Path | None,
        Option("--allowed-signers", "FILE", "the SSH keys that may sign, as in git's allowed_signers file"),
    ] = None,
    against: Annotated[
        Path | None,
        Option("--against", "RESULT", "compare one result, a student's own, with the official one instead"),
    ] = None,
) -> ExitCode:
    """Judge the evidence of results again, and name what does not fit.

    That may be the rubric, the result, the evidence or the signature. Without a rubric, the lab with the result's id is
    taken.
    """
    with loading():
        from grader.cli.results import compare_results, verify_results
    if against is not None:
        if len(results) > 1 or rubric is not None or allowed_signers is not None:
            raise UsageError("--against compares two results, and takes no other option")
        return compare_results(results[0], against)
    return verify_results(results, rubric, allowed_signers)


@command("sign", exit_codes=SIGN_EXIT_CODES)
def sign(
    *,
    results: Annotated[Sequence[Path], RESULTS],
    key: Annotated[
        Path, Option("--key", "FILE", "an SSH key, as git signs with; a .pub file if ssh-agent has it")
    ],
) -> ExitCode:
    """Sign results and their evidence with an SSH key."""
    with loading():
        from grader.cli.output import say
        from grader.results import RESULT, load_result
        from grader.verification import result_folders
        from grader.verification import sign as sign_folder
    for folder in result_folders(list(results)):
        # it raises for what is no result: that is not to be signed
        load_result(folder / RESULT)
        sign_folder(folder, key)
        say(f"{folder}: signed")
    return ExitCode.PASSED
