"""Commands as typed functions. Parser, help, man page, completion and reference pages are made from their signatures:

    @command("labs", group=INSTRUCTORS)
    def labs(*, as_json: JsonFlag = False) -> ExitCode:
        \"""List the labs that come with the grader.\"""

The first line of the docstring is the help. Each argument is keyword-only and annotated with its type and an Argument,
Option or Flag; its default is that of the signature. Nothing heavy is imported at the top of a module with commands,
since help and completion load all of them: a command imports what it runs inside `with loading():`.

What several commands share is here too: options, the kinds of values that options take, and the meanings of exit codes.
"""

from __future__ import annotations

import argparse
import gc
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

from grader.errors import ExitCode
from grader.intake.names import brief, is_package_name
from grader.model import SandboxMode

STUDENTS, INSTRUCTORS, REST = "For students", "For instructors", "More"
EXIT_CODES = """exit codes:
  0    passed: the pass mark is reached (by default every visible criterion)
  1    graded, below the pass mark
  2    the command line or a rubric is wrong
  3    could not be graded
  4    inconclusive: a criterion could not be judged
  130  interrupted
"""
Function = TypeVar("Function", bound=Callable[..., ExitCode])


class Argument(NamedTuple):
    """A positional argument. `value` is its name in the help; empty to show the choices."""

    value: str
    help: str = ""
    choices: tuple[str, ...] = ()


class Option(NamedTuple):
    """An option with a value, required if the signature has no default. With `repeated`, each use adds to a list."""

    flag: str
    value: str
    help: str
    parse: Callable[[str], object] | None = None
    repeated: bool = False
    choices: tuple[str, ...] = ()


class Flag(NamedTuple):
    """An option without a value."""

    flag: str
    help: str


Spec = Argument | Option | Flag
REQUIRED = object()
"""In place of a default where the signature has none."""


class Command(NamedTuple):
    """A command and the function that runs it. `name` has two words for a command of a group such as `rubric`.

    `notes` stand before the exit codes in the help. `runs_code` is set for commands that run what students wrote,
    `looks_at_host` for those that say whether these would work.
    """

    name: str
    run: Callable[..., ExitCode]
    group: str
    notes: str
    exit_codes: str
    runs_code: bool
    looks_at_host: bool

    @property
    def summary(self) -> str:
        """The first sentence of the function's docstring, with its full stop."""
        # one that is long goes on in the next line of the source, which is indented
        return (self.run.__doc__ or "").partition("\n\n")[0].replace("\n    ", " ")


COMMANDS: dict[str, Command] = {}
"""By name, in the order of the help."""


def command(
    name: str,
    *,
    group: str = REST,
    notes: str = "",
    exit_codes: str = EXIT_CODES,
    runs_code: bool = False,
    looks_at_host: bool = False,
) -> Callable[[Function], Function]:
    """Register a function as the command `name`."""

    def register(function: Function) -> Function:
        COMMANDS[name] = Command(name, function, group, notes, exit_codes, runs_code, looks_at_host)
        return function

    return register


def add_arguments(parser: argparse.ArgumentParser, function: Callable[..., ExitCode]) -> None:
    """Add every argument of a command's function to its parser."""
    # every argument is keyword-only, so all defaults are here
    defaults = function.__kwdefaults__ or {}
    for name, annotation in function.__annotations__.items():
        origin: object = get_origin(annotation)
        if origin is Annotated:
            kind, spec = get_args(annotation)
            _add(parser, name, kind, spec, defaults.get(name, REQUIRED))


def _add(parser: argparse.ArgumentParser, name: str, kind: object, spec: Spec, default: object) -> None:
    if isinstance(spec, Flag):
        parser.add_argument(spec.flag, action="store_true", dest=name, help=spec.help)
        return
    several = get_origin(kind) is Sequence
    parts = get_args(kind) if several or get_origin(kind) in {Union, UnionType} else (kind,)
    # what may be left out is `X | None`: only X is ever typed
    (plain,) = (part for part in parts if part is not NoneType)
    choices = spec.choices or (get_args(plain) if get_origin(plain) is Literal else ())
    how: dict[str, Any] = {
        "help": spec.help or None,
        "metavar": spec.value or None,
        "choices": choices or None,
    }
    # argparse compares choices with the text as it is typed
    if plain is not str and not choices:
        how["type"] = plain
    if isinstance(spec, Argument):
        nargs = "+" if several else None if default is REQUIRED else "?"
        parser.add_argument(name, nargs=nargs, default=None if default is REQUIRED else default, **how)
        return
    if spec.parse:
        how["type"] = spec.parse
    if default is REQUIRED:
        how["required"] = True
    elif several and spec.repeated:
        how |= {"action": "append", "default": []}  # argparse appends to a copy of it
    else:
        how["default"] = default
    if several and not spec.repeated:
        how["nargs"] = "+"
    parser.add_argument(spec.flag, dest=name, **how)


@contextmanager
def loading() -> Iterator[None]:
    """Hold Ctrl-C back for a moment: a compiled module that is interrupted while it loads panics. What is loaded stays,
    so that looking for garbage in between is for nothing."""
    gc.disable()
    try:
        with _block_signals():
            yield
    finally:
        gc.enable()


@contextmanager
def _block_signals() -> Iterator[None]:
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def package_name(text: str) -> str:
    """Parse a package's name, as it stands in some `package.xml`."""
    if not is_package_name(text.strip()):
        raise argparse.ArgumentTypeError(f"{brief(text)!r} cannot be a package's name")
    return text.strip()


def percent(text: str) -> float:
    """Parse 1 to 100, with or without a percent sign."""
    try:
        number = float(text.removesuffix("%"))
    except ValueError:
        number = 0.0
    if not 1 <= number <= 100:
        raise argparse.ArgumentTypeError(f"{text!r} is not a percentage from 1 to 100")
    return number


def port(text: str) -> int:
    """Parse a port; 0 means any free one."""
    return _whole(text, 0, 65535, f"{text!r} is not a port from 1 to 65535")


def count(text: str) -> int:
    """Parse 1 to 64."""
    return _whole(text, 1, 64, f"{text!r} is not a number from 1 to 64")


def minutes(most: int) -> Callable[[str], int]:
    """Return a parser of 2 to `most` minutes: half a minute of a time limit is not for grading."""
    return lambda text: _whole(text, 2, most, f"{text!r} is not a number from 2 to {most}")


def _whole(text: str, least: int, most: int, otherwise: str) -> int:
    # `int` also takes other scripts' digits, and underscores
    number = int(text) if text.isascii() and text.isdecimal() else -1
    if not least <= number <= most:
        raise argparse.ArgumentTypeError(otherwise)
    return number


RUBRIC = Option(
    "--rubric", "ID|FILE", "a lab's id, a rubric's file or https:// address; #sha256:DIGEST after it pins it"
)
SandboxOption = Annotated[
    SandboxMode, Option("--sandbox", "", "run students' code in a sandbox: if possible, always, or never")
]
AllFlag = Annotated[bool, Flag("--all", "list all criteria with what was measured, not only what was lost")]
JsonFlag = Annotated[bool, Flag("--json", "print JSON")]
PackageOption = Annotated[
    str | None, Option("--package", "NAME", "grade this package, whatever the lab calls it", package_name)
]
JobsOption = Annotated[
    int | None, Option("--jobs", "N", "how many at a time (default: four per core, with --static one)", count)
]
OnlyOption = Annotated[
    Sequence[str],
    Option("--only", "WHICH", "failed, inconclusive, changed, or ids: grade these again, keep all others"),
]
LocalOption = Annotated[
    Sequence[Path],
    Option("--allow-local", "DIR",
           "let the roster name paths below DIR too, not only below its own folder; may be repeated", repeated=True),
]  # fmt: skip
BookForm = Annotated[
    Literal["csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"],
    Option("--form", "", "its format; canvas, moodle and blackboard import theirs"),
]
BookTemplate = Annotated[
    Path | None, Option("--template", "FILE", "the platform's own export, to be filled in with the points")
]
BookColumn = Annotated[str, Option("--column", "NAME", "the platform's name for the column of points")]
AuthorOption = Annotated[
    str | None, Option("--author", "NAME", "who publishes (default: git config user.name)")
]
DraftsFlag = Annotated[
    bool, Flag("--drafts", "take results as they are now, even if earlier ones are published")
]
STDOUT = "-"
STATIC = Flag("--static", "check the files only and run nothing")
BATCH_FOLDER = "the --out of `grader batch`"

CLASS_EXIT_CODES = """exit codes, that of the worst submission:
  0    all passed
  1    all graded, not all passed
  2    the command line, the roster, the rubric or overrides.yaml is wrong
  3    some could not be graded
  4    some are inconclusive, or wait for a person
  130  interrupted: run the same command to continue
"""
MERGE_EXIT_CODES = """exit codes:
  0    all decisions are in DIR now
  1    there are conflicts: all other decisions are in DIR now
  2    the command line, or one of the files, is wrong
  3    the file cannot be written
"""
MUTANTS_EXIT_CODES = """exit codes:
  0    the correct package gets full marks, and every mutant loses what it must and no more
  1    it does not, or a mutant survives, or a criterion has points that no faulty package loses
  2    the command line, the rubric or the mutants file is wrong
  3    nothing could be graded here
  130  interrupted
"""
PUBLISH_EXIT_CODES = """exit codes:
  0    everything is published, or was before
  2    the command line is wrong, or the rubric has changed
  3    some could not be published, or could not be graded
  4    some stay drafts: they are inconclusive, or wait for a person
  130  interrupted: run the same command to continue
"""
FEEDBACK_EXIT_CODES = """exit codes:
  0    everything is sent, or was before
  2    the command line is wrong, or nothing is published
  3    some could not be sent: they are named
  130  interrupted: run the same command to continue
"""
REQUESTS_EXIT_CODES = """exit codes:
  0    every question is listed
  2    the command line is wrong
  3    a repository could not be read: it is named
  130  interrupted
"""
VERIFY_EXIT_CODES = """exit codes:
  0    the evidence gives what the result says, and nothing else is wrong
  1    something does not fit: result, evidence, rubric or signature; or with --against: something differs
  2    the command line, the rubric or the file of allowed signers is wrong
  3    it cannot be verified: a result cannot be read, or says that nothing was graded
  130  interrupted
"""
SIGN_EXIT_CODES = """exit codes:
  0    signed
  2    the command line is wrong, or the key cannot be used
  3    a result or its evidence cannot be read
  130  interrupted
"""
REPORT_EXIT_CODES = """exit codes:
  0    written, whatever the result is
  2    the command line or a rubric is wrong
  3    a result cannot be read, or cannot be shown in this form
  130  interrupted
"""
EXPORT_EXIT_CODES = """exit codes:
  0    written
  2    the command line or the rubric is wrong, or the grader is not installed
  130  interrupted
"""
