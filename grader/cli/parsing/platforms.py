"""The forms of `grader export` for platforms that students hand in to."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from grader.cli.parsing.base import Adder
from grader.cli.parsing.exit_codes import EXPORT_EXIT_CODES
from grader.cli.parsing.options import sandbox_option


def add_platforms(add: Adder) -> None:
    """Add `export gradescope` and `export prairielearn`."""
    gradescope = add("gradescope", "write an autograder's zip for Gradescope", "export_gradescope")
    _lab(gradescope)
    gradescope.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="where it goes; - is stdout (default: ./<lab>-gradescope.zip)",
    )
    gradescope.add_argument(
        "--minutes",
        metavar="N",
        type=_up_to(40),
        default=10,
        help="the assignment's time limit at Gradescope, at most 40 (default: 10)",
    )
    _judging(gradescope)

    prairielearn = add(
        "prairielearn", "write a question with an external grader for PrairieLearn", "export_prairielearn"
    )
    _lab(prairielearn)
    prairielearn.add_argument(
        "--out",
        metavar="DIR|ZIP",
        type=Path,
        help="a new folder, or a zip (default: ./<lab>-prairielearn)",
    )
    prairielearn.add_argument(
        "--image",
        metavar="NAME",
        default="ros-lab-grader",
        help="what the image is called where PrairieLearn gets it (default: ros-lab-grader)",
    )
    prairielearn.add_argument(
        "--minutes", metavar="N", type=_up_to(10), default=10, help="the time limit, at most 10 (default: 10)"
    )
    _judging(prairielearn)


def _lab(parser: argparse.ArgumentParser) -> None:
    parser.epilog = EXPORT_EXIT_CODES
    parser.add_argument("lab", metavar="LAB|FILE", help="a lab's id or a rubric's file; see grader labs")


def _judging(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--assume-executable",
        action="store_true",
        help="where an upload has lost the file modes, scripts count as executable (default: a person must look)",
    )
    sandbox_option(parser)


def _up_to(most: int) -> Callable[[str], int]:
    """2 to `most`: half a minute of it is not for grading."""

    def minutes(text: str) -> int:
        number = int(text) if text.isascii() and text.isdecimal() else 0
        if not 2 <= number <= most:
            raise argparse.ArgumentTypeError(f"{text!r} is not a number from 2 to {most}")
        return number

    return minutes
