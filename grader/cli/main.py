"""`grader`: the parser of the whole command line, what goes through it, and the exit code.

Imports nothing heavy: `--help` is quick.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from io import TextIOWrapper
from itertools import groupby, takewhile
from types import FrameType
from typing import Any, NoReturn

import grader.cli.commands  # noqa: F401 - fills COMMANDS
from grader import __version__
from grader.cli.declare import (
    COMMANDS,
    EXIT_CODES,
    INSTRUCTORS,
    REST,
    STUDENTS,
    Command,
    add_arguments,
    loading,
)
from grader.cli.output import guarded
from grader.errors import ExitCode, UsageError
from grader.wording import did_you_mean, join_words


def run(argv: Sequence[str]) -> int:
    """Run one command line and return its exit code. Prints its errors itself; raises nothing."""
    _prepare_streams()
    _prepare_signals()
    if not sys.warnoptions:  # Python's warnings about a student's code quote it, and are of no use here
        warnings.simplefilter("ignore")
    return guarded(lambda: _dispatch(argv), debug="--debug" in argv)


def _dispatch(argv: Sequence[str]) -> int:
    if not argv:
        print(f"usage: grader COMMAND ...\n\n{overview()}\nSee grader COMMAND --help.", file=sys.stderr)
        return ExitCode.USAGE
    try:
        first = next((word for word in argv if not word.startswith("-")), "")
        options = vars(build_parser(first).parse_args(argv))
    except SystemExit as done:  # --help and --version end this way
        return int(done.code or 0)
    options.pop("debug", None)
    command: Command = options.pop("command")
    runs_code = command.runs_code and not options.get("static")
    with loading():
        if runs_code and sys.platform == "linux":
            inherited = import_module("grader.arena.inherited_limits")
            # before more is loaded: short limits would end that without a word
            inherited.make_room(begin=True)
        if runs_code or command.looks_at_host:
            scope = import_module("grader.arena.control_groups")
    if runs_code or command.looks_at_host:
        scope.enter_scope()
    return int(command.run(**options))


def _prepare_streams() -> None:
    """Escape characters that the terminal's encoding lacks; let a closed stream swallow everything."""
    for name in ("stdout", "stderr"):
        # a program that was started with `>&-` has no such stream
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_WRONLY)
            setattr(sys, name, os.fdopen(descriptor, "w", encoding="utf-8"))
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper):
            with suppress(ValueError):  # it is closed
                stream.reconfigure(errors="backslashreplace")


def _prepare_signals() -> None:
    """Make SIGTERM clean up as SIGINT does, and keep SIGINT alive under a shell's `&`.

    The grader waits for its children and gets every signal, even if its parent ignores or blocks some.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _interrupt)
        if sys.platform != "win32":
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, ())


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


GROUPS = {
    "course": "Grade and publish a course of several labs",
    "rubric": "Write, check and test rubrics",
    "overrides": "Work with what people decided about a class",
    "export": "Write evidence as a bag, or an autograder for Gradescope or PrairieLearn",
}
"""Commands that have commands of their own."""
WIDTH = 12


class Parser(argparse.ArgumentParser):
    """argparse, but an error is a UsageError: one line, a suggestion where a word is mistyped, and exit code 2."""

    overview = False
    given: tuple[str, ...] = ()

    def error(self, message: str) -> NoReturn:
        """Raise UsageError. An option that is not known comes first: what else is missing may follow from it."""
        for word in self.given:
            name = word.partition("=")[0]
            if name.startswith("--") and name not in self._option_string_actions:
                meant = did_you_mean(name, self._option_string_actions) or self._without_option(name)
                meant = meant or (" (a lab is given by --rubric)" if self._is_lab(name) else "")
                message = f"unrecognized arguments: {word}{meant}"
                break
        raise UsageError(message, hint=f"see {self.prog} --help")

    def _without_option(self, name: str) -> str:
        """Return how an argument is given that the command takes without an option; "" where there is none of it."""
        for action in self._get_positional_actions():
            words = re.findall(r"[a-z]+", f"{action.metavar} {action.help}".lower())
            if name.strip("-") in words:
                return f" (write {action.metavar} without an option: {self.prog} {action.metavar})"
        return ""

    def _is_lab(self, word: str) -> bool:
        """Return whether a command that takes a lab by an option is given it otherwise: by another one, or by none."""
        from grader.rubric.find import named_labs  # noqa: PLC0415 - slow to load

        return "--rubric" in self._option_string_actions and (word == "--lab" or named_labs(word) != [])

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse as argparse does, but each command refuses what it does not know itself."""
        before_command = self._subparsers is not None
        # of `grader` itself, only what stands before the command: the rest is the command's to refuse
        self.given = tuple(
            takewhile(lambda word: word != "--" and not (before_command and word[:1] != "-"), args or ())
        )
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            lab = next(filter(self._is_lab, rest), "")
            meant = f" (write --rubric {lab})" if lab else ""
            self.error(f"unrecognized arguments: {' '.join(rest)}{meant}")
        return found, rest

    def format_help(self) -> str:
        """Return the help; that of `grader` itself lists the commands by who uses them."""
        if not self.overview:
            return super().format_help()
        formatter = self._get_formatter()
        formatter.add_usage(self.usage, self._actions, self._mutually_exclusive_groups)
        formatter.add_text(self.description)
        formatter.add_text(overview())
        formatter.start_section("options")
        formatter.add_arguments([action for action in self._actions if action.option_strings])
        formatter.end_section()
        formatter.add_text(self.epilog)
        return formatter.format_help()

    def _check_value(self, action: argparse.Action, value: Any) -> None:  # noqa: ANN401 - as argparse
        if action.choices is None or value in action.choices:
            return
        choices = [str(choice) for choice in action.choices]
        near = did_you_mean(str(value), choices)
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001 - argparse has no public way
            of = self.prog.partition(" ")[2]
            few = f", which has {join_words(choices)}" if of else ""
            raise UsageError(
                f'there is no command "{f"{of} {value}".strip()}"{near}', hint=f"see {self.prog} --help{few}"
            )
        raise argparse.ArgumentError(
            action, f"invalid choice: {value!r}{near}; choose from {', '.join(choices)}"
        )


class VersionAction(argparse.Action):
    """Prints a line for the grader (`grader X.Y.Z`), one for Python and one for ROS, and ends the command."""

    def __init__(self, option_strings: Sequence[str], dest: str, **rest: Any) -> None:  # noqa: ANN401 - as argparse
        super().__init__(option_strings, dest, nargs=0, default=argparse.SUPPRESS, **rest)

    def __call__(self, parser: argparse.ArgumentParser, *_rest: object) -> NoReturn:
        """Raise SystemExit with code 0."""
        from grader.cli.output import say  # noqa: PLC0415 - `--help` does without

        say(f"grader {__version__}")
        say(f"Python {platform.python_version()} ({sys.executable})")
        say(_ros())
        parser.exit()


def _ros() -> str:
    """Return which ROS 1 the grader would use here; what is wrong with it is for `grader doctor` to explain."""
    from grader.errors import GraderError  # noqa: PLC0415 - as above

    try:
        from grader.ros_env import find_ros  # noqa: PLC0415 - as above

        ros = find_ros()
    except (GraderError, ImportError, OSError) as error:
        return f"ROS 1 not usable: {error}"
    return f"ROS 1 {ros.label}" if ros else "ROS 1 not found"


def build_parser(first: str = "") -> argparse.ArgumentParser:
    """Return the parser. What it parses has `command`, and the arguments of that command's function.

    Where a command or a group is called `first`, the parser knows no other: to build all takes longer than to parse.
    """
    common = Parser(add_help=False)
    common.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show tracebacks of errors"
    )
    alike: dict[str, Any] = {
        "parents": [common], "allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter
    }  # fmt: skip
    parser = Parser(prog="grader", description="Grades introductory ROS 1 labs.", epilog=EXIT_CODES, **alike)
    parser.overview = True
    parser.add_argument(
        "--version", action=VersionAction, help="show the versions of grader, Python and ROS, and exit"
    )
    places = {"": parser.add_subparsers(metavar="COMMAND", required=True, title="commands")}
    known = _ordered_commands()
    for command in [c for c in known if c.name.partition(" ")[0] == first] or known:
        group, _, name = command.name.rpartition(" ")
        if group not in places:
            text = GROUPS[group]
            parent = places[""].add_parser(
                group, help=text, description=f"{text}.", epilog=EXIT_CODES, **alike
            )
            places[group] = parent.add_subparsers(metavar="COMMAND", required=True, title="commands")
        below = places[group].add_parser(
            name,
            help=command.summary.removesuffix("."),
            description=command.summary,
            epilog=command.notes + command.exit_codes,
            **alike,
        )
        below.set_defaults(command=command)
        add_arguments(below, command.run)
    return parser


def overview() -> str:
    """Return one line for each command: first those of students, then those of instructors, then the others."""
    lines: list[str] = []
    for title, commands_of in groupby(_ordered_commands(), key=lambda command: command.group):
        lines += ["", f"{title}:"] if lines else [f"{title}:"]
        texts = {
            c.name.partition(" ")[0]: GROUPS.get(c.name.partition(" ")[0], c.summary) for c in commands_of
        }
        lines += [f"  {name:{WIDTH}}{text.removesuffix('.')}" for name, text in texts.items()]
    return "\n".join(lines) + "\n"


def commands(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Return the parser of every command that can be run, in the order of `--help`; `prog` is how it is called."""
    groups = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001 - no public way
    below = [each for action in groups for each in action.choices.values()]
    if not below:
        yield parser
    for each in below:
        yield from commands(each)


def options(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Return what a command takes beside `--help` and further commands: positional arguments, then options."""
    other = (argparse._HelpAction, argparse._SubParsersAction)  # noqa: SLF001 - argparse has no public way
    shown = [a for a in parser._actions if a.help != argparse.SUPPRESS]  # noqa: SLF001 - as above
    taken = [action for action in shown if not isinstance(action, other)]
    yield from (action for action in taken if not action.option_strings)
    yield from (action for action in taken if action.option_strings)


def value_of(action: argparse.Action) -> str:
    """Return what the help calls the value of an option or positional argument, or "" if it takes none."""
    if action.nargs == 0:
        return ""
    if action.metavar is None and action.choices is not None:
        return f"{{{','.join(map(str, action.choices))}}}"
    return str(action.metavar or action.dest)


def _ordered_commands() -> list[Command]:
    order = (STUDENTS, INSTRUCTORS, REST)
    return sorted(COMMANDS.values(), key=lambda command: order.index(command.group))
