"""Tells a shell what may be typed next."""

from __future__ import annotations

import argparse
from typing import Any

import argcomplete

from grader.cli.completing.choosing import completer_of
from grader.cli.parsing import build_parser
from grader.cli.parsing.walk import commands, options


def answer() -> None:
    """Tell the shell that asks (by the environment) what fits, and end the process."""
    argcomplete.autocomplete(completing_parser(), always_complete_options=False)


def completing_parser() -> argparse.ArgumentParser:
    """The parser, in which each value says what may stand in its place."""
    parser = build_parser()
    for command in commands(parser):
        for action in options(command):
            if action.nargs != 0 and action.choices is None:
                completed: Any = action
                completed.completer = completer_of(command.prog, action)
    return parser
