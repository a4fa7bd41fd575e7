"""The commands for other programs: platforms that students submit to, CI systems, editors and shells."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from grader.cli.declare import (
    EXPORT_EXIT_CODES,
    INSTRUCTORS,
    STDOUT,
    Argument,
    Flag,
    Option,
    PackageOption,
    SandboxOption,
    command,
    loading,
    minutes,
)
from grader.errors import ExitCode
from grader.model import SandboxMode
from grader.model.version import ALL

if TYPE_CHECKING:
    from grader.integrations.platform_exports import BundleSettings

Shell = Literal["bash", "zsh", "fish"]
FORMATS = tuple(one.short for one in ALL)
LAB = Argument("LAB|FILE", "a lab's id or a rubric's file; see grader labs")
ASSUME_EXECUTABLE = Flag(
    "--assume-executable",
    "treat scripts as executable if an upload has lost the file modes (default: a person must look)",
)
CI_VARIABLES = """variables, all optional:
  GRADER_LAB        a lab's id or a rubric's file (default: the lab for packages of that name)
  GRADER_PATH       the package's folder (default: .)
  GRADER_PACKAGE    the name of the package to grade, whatever the lab calls it (default: the lab's)
  GRADER_PASS_MARK  points, or a percentage of the visible points: 60% (default: the rubric's)
  GRADER_FAIL_ON    any of below-pass-mark, not-graded, inconclusive (default: all), or never
  GRADER_STATIC     true: check the files only and run nothing
  GRADER_SANDBOX    auto (default), require or none
  GRADER_ATTEMPTS   how many runs are graded at most, by the CI system's own count (default: all)
  GRADER_OUT        where the results go (default: grader-results)

"""


@command("export gradescope", group=INSTRUCTORS, exit_codes=EXPORT_EXIT_CODES)
def export_gradescope(
    *,
    lab: Annotated[str, LAB],
    out: Annotated[
        Path | None,
        Option("--out", "FILE", "where to write it; - is stdout (default: ./<lab>-gradescope.zip)"),
    ] = None,
    minutes: Annotated[
        int,
        Option(
            "--minutes",
            "N",
            "the assignment's time limit at Gradescope, at most 40 (default: 10)",
            minutes(40),
        ),
    ] = 10,
    assume_executable: Annotated[bool, ASSUME_EXECUTABLE] = False,
    package: PackageOption = None,
    sandbox: SandboxOption = "auto",
) -> ExitCode:
    """Write an autograder's zip for Gradescope."""
    with loading():
        from grader.cli.output import say
        from grader.files import atomic_write
        from grader.integrations.platform_exports import gradescope_autograder
        from grader.rubric.load import load_rubric
    rubric = load_rubric(lab)
    settings = _settings(minutes, package, sandbox, assume_executable=assume_executable)
    data = gradescope_autograder(rubric, settings)
    if str(out) == STDOUT:
        sys.stdout.buffer.write(data)
        return ExitCode.PASSED
    name = f"{rubric.rubric.id}-gradescope.zip"
    target = out / name if out is not None and out.is_dir() else out or Path(name)
    atomic_write(target, data, public=True)
    say(f"{target}: upload it under Configure Autograder, with Ubuntu 22.04 as the base image")
    return ExitCode.PASSED


@command("export prairielearn", group=INSTRUCTORS, exit_codes=EXPORT_EXIT_CODES)
def export_prairielearn(
    *,
    lab: Annotated[str, LAB],
    out: Annotated[
        Path | None, Option("--out", "DIR|ZIP", "a new folder, or a zip (default: ./<lab>-prairielearn)")
    ] = None,
    image: Annotated[
        str,
        Option("--image", "NAME", "the image's name where PrairieLearn gets it (default: ros-lab-grader)"),
    ] = "ros-lab-grader",
    minutes: Annotated[
        int, Option("--minutes", "N", "the time limit, at most 10 (default: 10)", minutes(10))
    ] = 10,
    assume_executable: Annotated[bool, ASSUME_EXECUTABLE] = False,
    package: PackageOption = None,
    sandbox: SandboxOption = "auto",
) -> ExitCode:
    """Write a question with an external grader for PrairieLearn."""
    with loading():
        from grader.cli.output import say
        from grader.integrations.platform_exports import prairielearn_question, write_question
        from grader.rubric.load import load_rubric
    rubric = load_rubric(lab)
    settings = _settings(minutes, package, sandbox, assume_executable=assume_executable)
    target = out or Path(f"{rubric.rubric.id}-prairielearn")
    write_question(prairielearn_question(rubric, settings, image), target)
    say(f"{target}: add question/ to your course's questions, and build {image} from image/")
    return ExitCode.PASSED


def _settings(
    minutes: int, package: str | None, sandbox: SandboxMode, *, assume_executable: bool
) -> "BundleSettings":
    with loading():
        from grader.integrations.platform_exports import BundleSettings
    modes: Literal["lost", "granted"] = "granted" if assume_executable else "lost"
    return BundleSettings(rubric="", minutes=minutes, sandbox=sandbox, modes=modes, package=package or "")


@command("export bag", group=INSTRUCTORS)
def export_bag(
    *,
    evidence: Annotated[Path, Argument("EVIDENCE", "a recording, or a folder of them")],
    out: Annotated[
        Path | None, Option("--out", "FILE", "the bag, or a folder (default: this folder)")
    ] = None,
    everything: Annotated[bool, Flag("--all", "include the grader's own records, as JSON text")] = False,
) -> ExitCode:
    """Write recorded evidence as a ROS 1 bag."""
    with loading():
        from grader.cli.results import export_bags
    export_bags(evidence, out, everything=everything)
    return ExitCode.PASSED


@command("ci", notes=CI_VARIABLES, runs_code=True)
def ci(
    *, system: Annotated[Literal["github", "gitlab"], Argument("", "the CI system that runs the job")]
) -> ExitCode:
    """Check a package in a CI job, and report to the CI system.

    It grades as `grader check` does; GRADER_FAIL_ON says when the job fails.
    """
    with loading():
        from grader.cli.ci_job import run_job
    return run_job(system)


@command("schema")
def schema(
    *,
    name: Annotated[
        str | None,
        Argument("NAME", f"{', '.join(FORMATS)} (default: list them with their versions)", FORMATS),
    ] = None,
) -> ExitCode:
    """Print the JSON Schema of a format that the grader writes or reads."""
    with loading():
        from grader.cli.output import say, say_json
        from grader.report.file_formats import FORMATS as KNOWN
        from grader.report.file_formats import schema_of
    if name is not None:
        say_json(schema_of(name))
        return ExitCode.PASSED
    width = max(map(len, KNOWN))
    for known in KNOWN.values():
        # `is_` is the format with its version: the name, and at most nine characters
        say(f"{known.name:{width}}  {known.is_!s:{width + 9}}  {known.where}".replace("`", ""))
    return ExitCode.PASSED


@command("completion")
def completion(*, shell: Annotated[Shell, Argument("SHELL", "bash, zsh or fish")]) -> ExitCode:
    """Print what a shell loads to complete commands, options and names."""
    with loading():
        from grader.cli.completion import script
        from grader.cli.output import say_document
    say_document(lambda _: script(shell))
    return ExitCode.PASSED
