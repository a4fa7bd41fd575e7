"""The man page grader(1), written from the parser of the command line. Imports nothing but the standard library."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from grader import __version__
from grader.cli.manual.roff import bold, entry, example, italic, text
from grader.cli.manual.sections import ABOUT, ENVIRONMENT, EXAMPLES, FILES, SEE_ALSO
from grader.cli.parsing import build_parser
from grader.cli.parsing.exit_codes import EXIT_CODES
from grader.cli.parsing.walk import commands, options, value_of


def man_page() -> str:
    """The page in roff. It bears no date, so that the same sources always give the same page."""
    parser = build_parser()
    lines = [
        f'.TH GRADER 1 "" "ros-lab-grader {__version__}" "User Commands"',
        ".ad l",
        ".nh",
        ".SH NAME",
        rf"grader \- {text('grade introductory ROS 1 labs')}",
        ".SH SYNOPSIS",
        *_synopsis(parser),
        ".SH DESCRIPTION",
        f"{bold('grader')} {text(ABOUT[0])}",
        *(line for paragraph in ABOUT[1:] for line in (".PP", text(paragraph))),
        ".SH COMMANDS",
        *(line for command in commands(parser) for line in _command(command)),
        ".SH OPTIONS OF EVERY COMMAND",
        *(line for action in options(parser) for line in _option(action)),
        *entry(f"{bold('-h')}, {bold('--help')}", text("show a command's help and exit")),
        ".SH EXIT STATUS",
        *_exit_codes(EXIT_CODES),
        *_table("ENVIRONMENT", ENVIRONMENT),
        *_table("FILES", FILES),
        ".SH EXAMPLES",
        *_examples(),
        ".SH SEE ALSO",
        text(", ".join(SEE_ALSO)),
    ]
    return "\n".join(lines) + "\n"


def _synopsis(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield f"{bold(parser.prog)} {italic('COMMAND')} [{italic('OPTION')}]..."
    yield ".br"
    yield f"{bold(parser.prog)} {italic('COMMAND')} {bold('--help')}"
    yield ".br"
    yield f"{bold(parser.prog)} {bold('--version')}"


def _command(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield f'.SS "{text(parser.prog)}"'
    usage = [_usage(action) for action in options(parser) if action.dest != "debug"]
    yield " ".join([bold(parser.prog), *usage])
    yield ".PP"
    yield text(parser.description or "")
    for action in options(parser):
        if action.dest != "debug" and action.help:
            yield from _option(action)
    if parser.epilog and parser.epilog != EXIT_CODES:
        yield ".PP"
        yield "Its exit codes:"
        yield from _exit_codes(parser.epilog)


def _usage(action: argparse.Action) -> str:
    words = " ".join(
        [*(bold(name) for name in action.option_strings[:1]), *([_value(action)] if _value(action) else [])]
    )
    optional = not action.required or action.nargs in {"?", "*"}
    return f"[{words}]" if optional else words


def _value(action: argparse.Action) -> str:
    name = value_of(action)
    if not name:
        return ""
    breakable = italic(name).replace(",", r",\:")
    return breakable + ("..." if action.nargs in {"+", "*"} else "")


def _option(action: argparse.Action) -> list[str]:
    names = ", ".join(bold(name) for name in action.option_strings)
    tag = " ".join(part for part in (names, _value(action)) if part)
    return entry(tag, text((action.help or "").replace("%%", "%")))


def _exit_codes(epilog: str) -> Iterator[str]:
    for row in epilog.splitlines()[1:]:
        code, _, meaning = row.strip().partition(" ")
        yield from entry(bold(code), text(meaning.strip()))


def _examples() -> Iterator[str]:
    for index, (command, words) in enumerate(EXAMPLES.items()):
        if index:
            yield ".PP"
        yield text(words)
        yield from example(command)


def _table(title: str, rows: dict[str, str]) -> Iterator[str]:
    yield f".SH {title}"
    for name, words in rows.items():
        yield from entry(bold(name), text(words))
