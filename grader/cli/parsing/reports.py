"""The command that writes reports."""

from __future__ import annotations

import argparse
from pathlib import Path

from grader.cli.parsing.exit_codes import REPORT_EXIT_CODES
from grader.cli.parsing.options import rubric_option
from grader.report.forms import FORMS


def add_report(report: argparse.ArgumentParser) -> None:
    """Add its options to the command `report`."""
    report.epilog = REPORT_EXIT_CODES
    report.add_argument(
        "folder",
        metavar="DIR",
        type=Path,
        help="a submission's folder of results, or the --out of `grader batch`",
    )
    rubric_option(report, required=False)
    report.add_argument(
        "--form", choices=tuple(FORMS), default="", help="this one alone (default: all files of DIR)"
    )
    report.add_argument("--out", metavar="FILE", default="", help="where that one goes (default: -, stdout)")
    report.add_argument(
        "--prefix",
        metavar="PATH",
        help="the package's folder in the repository, for lines of files (default: looked for here)",
    )
    report.add_argument("--student", action="store_true", help="leave hidden criteria out of that one")
    report.add_argument(
        "--anonymous", metavar="FILE", type=Path, help="write the class's page without names there, too"
    )
