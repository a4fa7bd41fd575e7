"""What several commands share: options, the kinds of values that options take, and the meanings of exit codes."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Annotated

from grader.cli.declare import Flag, Option
from grader.intake.names import brief, is_package_name
from grader.model.sandbox_mode import SandboxMode


def package_name(text: str) -> str:
    """Parse a package's name, as it stands in some `package.xml`."""
    if not is_package_name(text.strip()):
        raise argparse.ArgumentTypeError(f"{brief(text)!r} cannot be a package's name")
    return text.strip()


RUBRIC = Option(
    "--rubric", "ID|FILE", "a lab's id, a rubric's file or https:// address; #sha256:DIGEST behind it pins it"
)
SandboxOption = Annotated[
    SandboxMode, Option("--sandbox", "", "run students' code in a sandbox: if possible, always, or never")
]
AllFlag = Annotated[bool, Flag("--all", "list all criteria with what was measured, not only what was lost")]
JsonFlag = Annotated[bool, Flag("--json", "print JSON")]
PackageOption = Annotated[
    str | None,
    Option("--package", "NAME", "grade this package, whatever the lab calls it", package_name),
]
STATIC = Flag("--static", "check the files only and run nothing")
BATCH_FOLDER = "the --out of `grader batch`"

CLASS_EXIT_CODES = """exit codes, that of the worst submission:
  0    all passed
  1    all graded, not all passed
  2    the command line, the roster, the rubric or overrides.yaml is wrong
  3    some could not be graded
  4    some are inconclusive, or wait for a person
  130  interrupted: run the same command to continue
"""
MERGE_EXIT_CODES = """exit codes:
  0    all decisions stand there now
  1    there are conflicts: all other decisions stand there now
  2    the command line, or one of the files, is wrong
  3    the file cannot be written
"""
MUTANTS_EXIT_CODES = """exit codes:
  0    the correct package gets full marks, and every mutant loses what it must and no more
  1    it does not, or a mutant survives, or a criterion is worth points that no mutant loses
  2    the command line, the rubric or the mutants file is wrong
  3    nothing could be graded here
  130  interrupted
"""
PUBLISH_EXIT_CODES = """exit codes:
  0    everything is published, or was before
  2    the command line is wrong, or the rubric has changed
  3    some could not be published, or could not be graded
  4    some stay drafts: they are inconclusive, or wait for a person
  130  interrupted: run the same command to continue
"""
FEEDBACK_EXIT_CODES = """exit codes:
  0    everything is sent, or was before
  2    the command line is wrong, or nothing is published
  3    some could not be sent: they are named
  130  interrupted: run the same command to continue
"""
REQUESTS_EXIT_CODES = """exit codes:
  0    every question is listed
  2    the command line is wrong
  3    a repository could not be read: it is named
  130  interrupted
"""
VERIFY_EXIT_CODES = """exit codes:
  0    the evidence gives what the result says, and nothing else is wrong
  1    something does not fit: result, evidence, rubric or signature; or with --against: something differs
  2    the command line, the rubric or the file of allowed signers is wrong
  3    it cannot be verified: a result cannot be read, or says that nothing was graded
  130  interrupted
"""
SIGN_EXIT_CODES = """exit codes:
  0    signed
  2    the command line is wrong, or the key cannot be used
  3    a result or its evidence cannot be read
  130  interrupted
"""
REPORT_EXIT_CODES = """exit codes:
  0    written, whatever the result is
  2    the command line or a rubric is wrong
  3    a result cannot be read, or cannot be shown in this form
  130  interrupted
"""
EXPORT_EXIT_CODES = """exit codes:
  0    written
  2    the command line or the rubric is wrong, or the grader is not installed
  130  interrupted
"""


def percent(text: str) -> float:
    """Parse 1 to 100, with or without a percent sign."""
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = 0.0
    if not 1 <= number <= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage from 1 to 100")
    return number


def port(text: str) -> int:
    """Parse a port; 0 means any free one."""
    return _whole(text, 0, 65535, f"{text!r} is not a port from 1 to 65535")


def count(text: str) -> int:
    """Parse 1 to 64."""
    return _whole(text, 1, 64, f"{text!r} is not a number from 1 to 64")


def minutes(most: int) -> Callable[[str], int]:
    """Return a parser of 2 to `most` minutes: half a minute of a time limit is not for grading."""
    return lambda text: _whole(text, 2, most, f"{text!r} is not a number from 2 to {most}")


def _whole(text: str, least: int, most: int, otherwise: str) -> int:
    number = int(text) if text.isascii() and text.isdecimal() else -1
    if not least <= number <= most:
        raise argparse.ArgumentTypeError(otherwise)
    return number
