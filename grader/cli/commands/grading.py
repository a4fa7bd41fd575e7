"""The commands for one submission and for recorded evidence."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from grader.cli.declare import (
    INSTRUCTORS,
    RUBRIC,
    SIGN_EXIT_CODES,
    VERIFY_EXIT_CODES,
    AllFlag,
    Argument,
    JsonFlag,
    Option,
    PackageOption,
    SandboxOption,
    command,
    count,
    loading,
)
from grader.errors import ExitCode, UsageError

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
