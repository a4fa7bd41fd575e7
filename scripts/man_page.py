"""The man page grader(1), written from the parser of the command line when a wheel is built (`hatch_build.py`).

Imports nothing but the standard library and the parser. roff is the language that `man` reads.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from grader import __version__
from grader.cli.declare import EXIT_CODES
from grader.cli.main import build_parser, commands, options, value_of

ABOUT = (
    (
        "grades the packages of an introductory ROS 1 lab: it builds a submission in a fresh catkin workspace, runs "
        "its nodes under a roscore of its own inside a sandbox, records every message, and judges the recording "
        "against a rubric. The same recording and rubric always give the same verdicts."
    ),
    "The files of a package are judged on any machine. Running nodes takes Linux with ROS 1: see grader doctor.",
)
"""Paragraphs; the first continues after the program's name."""

ENVIRONMENT = {
    "GRADER_ROS_SETUP": "the setup.bash of the ROS 1 to use, or none, to use no ROS. Without it, the grader looks in "
    "/opt/ros, then for Debian's packages, then in the active conda environment.",
    "GITHUB_TOKEN, GITLAB_TOKEN": "credentials for submissions that are fetched from there. They are never stored.",
    "GRADER_GIT_HOST, GRADER_GIT_TOKEN, GRADER_GIT_USER": "the same for another host.",
    "XDG_CACHE_HOME": "the folder that contains grader's cache, instead of ~/.cache.",
    "XDG_RUNTIME_DIR": "where gradings that run at the same time coordinate.",
}

FILES = {
    "~/.cache/grader": "mirrors of fetched repositories, and what CMake found out about this machine. May be deleted "
    "at any time.",
    "DIR/SUBMISSION/result.json": "the result, for programs; report.html beside it is for people, and evidence/ "
    "contains the recordings.",
}

EXAMPLES = {
    "grader check": "Students, in the folder of their package, before they submit it.",
    "grader grade submission.zip --rubric leeds-comp3631-lab1 --out results": "Grade one submission.",
    "grader batch roster.csv --rubric leeds-comp3631-lab1 --out results": "Grade a class; the same command continues "
    "where it was stopped.",
    "grader judge results --rubric my-rubric.yaml": "Judge recordings again by a changed rubric, without ROS.",
}

SEE_ALSO = ("bwrap(1)", "git(1)")

ESCAPES = {
    "\\": r"\(rs",
    "-": r"\-",
    "'": r"\(aq",
    "`": r"\(ga",
    "^": r"\(ha",
    "~": r"\(ti",
    '"': r"\(dq",
}


def man_page() -> str:
    """Return the page in roff. It has no date, so that the same sources always give the same page."""
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
    notes, _, codes = (parser.epilog or "").partition("exit codes")
    if codes and f"exit codes{codes}" != EXIT_CODES:
        yield ".PP"
        yield "Its exit codes:"
        yield from _exit_codes(codes)
    if notes:
        title, *rows = notes.strip().splitlines()
        yield ".PP"
        yield text(title[0].upper() + title[1:])
        for name, _, meaning in (row.strip().partition(" ") for row in rows):
            yield from entry(bold(name), text(meaning.strip()))


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


def text(words: str) -> str:
    """Return words so that nothing in them is taken for a request or an escape sequence."""
    escaped = "".join(_escaped(character) for character in words)
    return rf"\&{escaped}" if escaped.startswith(".") else escaped


def bold(words: str) -> str:
    """Return words that are typed as they stand."""
    return rf"\fB{text(words)}\fR"


def italic(words: str) -> str:
    """Return the name of a value that the reader fills in."""
    return rf"\fI{text(words)}\fR"


def entry(tag: str, *paragraphs: str) -> list[str]:
    """Return the lines of a tag and its indented paragraphs, all of them roff already."""
    lines = [".TP", tag]
    for index, paragraph in enumerate(paragraphs):
        lines += [".IP", paragraph] if index else [paragraph]
    return lines


def example(command: str) -> list[str]:
    """Return the lines of an indented command, which are not filled. A paragraph must follow."""
    return [".IP", ".nf", bold(command), ".fi"]


def _escaped(character: str) -> str:
    if character in ESCAPES:
        return ESCAPES[character]
    return character if character.isascii() else rf"\[u{ord(character):04X}]"
