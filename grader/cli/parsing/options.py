"""Options that several commands have, and the kinds of values that options take."""

from __future__ import annotations

import argparse
from pathlib import Path


def rubric_option(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add --rubric: a lab's id or a file."""
    parser.add_argument("--rubric", metavar="ID|FILE", required=required, help="see grader labs")


def out_option(parser: argparse.ArgumentParser, text: str, *, required: bool = False) -> None:
    """Add --out: a folder."""
    parser.add_argument("--out", metavar="DIR", type=Path, required=required, help=text)


def sandbox_option(parser: argparse.ArgumentParser) -> None:
    """Add --sandbox."""
    parser.add_argument(
        "--sandbox",
        choices=("auto", "require", "none"),
        default="auto",
        help="shut the student's code in: where possible, always, or not at all",
    )


def json_option(parser: argparse.ArgumentParser) -> None:
    """Add --json, as the keyword `as_json`."""
    parser.add_argument("--json", action="store_true", dest="as_json", help="print JSON")


def percent(text: str) -> float:
    """1 to 100, with or without its sign."""
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = 0.0
    if not 1 <= number <= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage from 1 to 100")
    return number


def port(text: str) -> int:
    """0 (any) to 65535."""
    number = int(text) if text.isascii() and text.isdecimal() else -1
    if not 0 <= number <= 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port from 1 to 65535")
    return number


def count(text: str) -> int:
    """1 to 64."""
    number = int(text) if text.isdecimal() else 0
    if not 1 <= number <= 64:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 64")
    return number
