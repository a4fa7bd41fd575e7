"""Goes through the parser, for what is written from it: the man page, the completion of a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator


def commands(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """The parser of every command that can be run, in the order of `--help`; `prog` is how it is called."""
    below = list(_below(parser))
    if not below:
        yield parser
    for each in below:
        yield from commands(each)


def options(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """What the command takes beside `--help` and further commands: its positional arguments, then its options."""
    taken = [action for action in parser._actions if not _is_other(action)]  # noqa: SLF001 - argparse has no public way
    yield from (action for action in taken if not action.option_strings)
    yield from (action for action in taken if action.option_strings)


def value_of(action: argparse.Action) -> str:
    """What an option's value, or a positional argument, is called in its help; empty where it takes none."""
    if action.nargs == 0:
        return ""
    if action.metavar is None and action.choices is not None:
        return f"{{{','.join(map(str, action.choices))}}}"
    return str(action.metavar or action.dest)


def _below(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    for action in parser._actions:  # noqa: SLF001 - as above
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001 - as above
            yield from action.choices.values()


def _is_other(action: argparse.Action) -> bool:
    other = (argparse._HelpAction, argparse._SubParsersAction)  # noqa: SLF001 - as above
    return isinstance(action, other) or action.help == argparse.SUPPRESS
