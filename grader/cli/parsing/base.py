"""The parser of every command, and how commands are added to it."""

from __future__ import annotations

import argparse
from typing import NoReturn

from grader.cli.parsing.exit_codes import EXIT_CODES
from grader.errors import UsageError


class Parser(argparse.ArgumentParser):
    """argparse, with its errors as ours: one line and exit code 2."""

    def error(self, message: str) -> NoReturn:
        """Raise UsageError."""
        raise UsageError(message, hint=f"see {self.prog} --help")


def common_options() -> Parser:
    """The options that every command has."""
    common = Parser(add_help=False)
    common.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show tracebacks of errors"
    )
    return common


class Adder:
    """Adds commands that are made alike, with `--debug` and the exit codes."""

    def __init__(self, commands: argparse._SubParsersAction[Parser], common: Parser) -> None:
        self.commands = commands
        self.common = common

    def __call__(self, name: str, text: str, module: str = "") -> argparse.ArgumentParser:
        """Add the command `name` that `grader.cli.commands.<module>` runs; its options are for the caller to add."""
        parser = self.commands.add_parser(
            name,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog=EXIT_CODES,
            parents=[self.common],
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.set_defaults(module=module or name)
        return parser
