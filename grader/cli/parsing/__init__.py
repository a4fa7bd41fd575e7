"""What the command line can say. Imports nothing heavy: `--help` is quick."""

from __future__ import annotations

import argparse

from grader.cli.parsing.authoring import add_authoring
from grader.cli.parsing.base import Adder, Parser, common_options
from grader.cli.parsing.ci import add_ci
from grader.cli.parsing.classes import add_classes
from grader.cli.parsing.evidence import add_evidence
from grader.cli.parsing.exit_codes import EXIT_CODES
from grader.cli.parsing.formats import add_formats
from grader.cli.parsing.grading import add_grading
from grader.cli.parsing.setting_up import add_setting_up
from grader.cli.parsing.version import VersionAction


def build_parser() -> argparse.ArgumentParser:
    """The whole command line. Each command sets `module`, and its options are its function's keywords."""
    common = common_options()
    parser = Parser(
        prog="grader",
        description="Grades introductory ROS 1 labs.",
        epilog=EXIT_CODES,
        parents=[common],
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--version", action=VersionAction, help="show the versions of grader, Python and ROS, and exit"
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True, title="commands", parser_class=Parser)
    adder = Adder(commands, common)
    for add_group in (
        add_grading,
        add_ci,
        add_classes,
        add_evidence,
        add_authoring,
        add_formats,
        add_setting_up,
    ):
        add_group(adder)
    return parser
