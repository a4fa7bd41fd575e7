"""`commands.md` and `exit-codes.md`, made from the parser of the command line."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator

from grader.cli.declare import EXIT_CODES
from grader.cli.main import build_parser, commands, options, value_of
from scripts.reference.table import MADE, code, table

COMMANDS = f"""# Commands

Every command and its options, as `grader COMMAND --help` prints them. All have `--help` and `--debug` (show
tracebacks of errors). {MADE}
"""
CODES = f"""# Exit codes

Scripts read the exit code, people the last line of what is printed: both say the same. {MADE}

A fault of the machine or of the grader is never 1: only what was judged can be below the pass mark. A CI job that
fails with 3 or 4 has said nothing about the student's work.
"""
ROW = re.compile(r"^  (\d+)\s+(.*)$", re.MULTILINE)


def commands_page() -> str:
    """Every command as Markdown, in the order of `grader --help`."""
    parsers = list(commands(build_parser()))
    contents = [f"- [`{p.prog}`](#{_anchor(p)}): {_lower(p.description or '')}" for p in parsers]
    sections = (line for parser in parsers for line in _command(parser))
    return "\n".join([COMMANDS, *contents, "", *sections]).rstrip() + "\n"


def exit_codes_page() -> str:
    """What the codes mean: in general, and for the commands where they mean something else."""
    lines = [CODES, *table(("code", "means"), ROW.findall(EXIT_CODES))]
    for epilog, parsers in _by_codes().items():
        names = ", ".join(code(parser.prog) for parser in parsers)
        lines += [f"## {names}", "", *table(("code", "means"), ROW.findall(epilog))]
    return "\n".join(lines).rstrip() + "\n"


def _by_codes() -> dict[str, list[argparse.ArgumentParser]]:
    found: dict[str, list[argparse.ArgumentParser]] = {}
    for parser in commands(build_parser()):
        own = (parser.epilog or "").partition("exit codes")[2]
        if own and ROW.findall(own) != ROW.findall(EXIT_CODES):
            found.setdefault(own, []).append(parser)
    return found


def _command(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield from (f"## {parser.prog}", "", parser.description or "", "")
    usage = [_usage(action) for action in options(parser) if action.dest != "debug"]
    yield from ("```text", " ".join([parser.prog, *usage]), "```", "")
    rows = [
        (_names(action), (action.help or "") % {"default": action.default, "prog": parser.prog})
        for action in options(parser)
        if action.dest != "debug"
    ]
    yield from table(("argument", "meaning"), rows)
    before = (parser.epilog or "").partition("exit codes")[0].strip()
    if before:
        yield from ("```text", before, "```", "")


def _usage(action: argparse.Action) -> str:
    words = " ".join(filter(None, [*action.option_strings[:1], value_of(action)]))
    words += " ..." if action.nargs in {"+", "*"} else ""
    optional = not action.required or action.nargs in {"?", "*"}
    return f"[{words}]" if optional else words


def _names(action: argparse.Action) -> str:
    value = value_of(action)
    names = action.option_strings or [value]
    told = [f"{name} {value}".strip() if action.option_strings else name for name in names]
    return ", ".join(code(name) for name in told)


def _anchor(parser: argparse.ArgumentParser) -> str:
    return parser.prog.replace(" ", "-")


def _lower(text: str) -> str:
    text = text.rstrip(".")
    return text[:1].lower() + text[1:]
