"""Which values fit where: by what the help calls them, for nearly all of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import partial
from grader.cli.parsing.walk import value_of
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any
import yaml
from grader.rubric.find import rubric_ids, rubrics_folder
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
import argcomplete
from grader.cli.parsing import build_parser
from grader.cli.parsing.walk import commands, options
from argcomplete.shell_integration import shellcode


Completer = Callable[..., Mapping[str, str]]
RUBRICS = (".yaml", ".yml")
ARCHIVES = (".bag", ".mcap", ".tar", ".tar.bz2", ".tar.gz", ".tar.xz", ".tgz", ".zip")
RECORDINGS = (".bag", ".mcap")
WHICH = {
    "failed": "those that could not be graded, or have no result",
    "inconclusive": "those with something that could not be judged",
    "changed": "those of which the submission, the rubric or the grader is another one now",
}


def nothing(**_asked: object) -> dict[str, str]:
    """Where nobody can know what somebody will write: a name, a number, an address."""
    return {}


def _either(*completers: Completer) -> Completer:
    def both(**asked: object) -> dict[str, str]:
        return {value: said for each in completers for value, said in each(**asked).items()}

    return both


def _words(words: Mapping[str, str], **_asked: object) -> Mapping[str, str]:
    return words


FOLDERS = partial(paths, endings=())
ANY = partial(paths, endings=None)
BY_VALUE: dict[str, Completer] = {
    "ADDRESS": nothing,
    "DIR": FOLDERS,
    "DIR|ZIP": partial(paths, endings=(".zip",)),
    "EVIDENCE": partial(paths, endings=RECORDINGS),
    "FILE": ANY,
    "ID|FILE": _either(lab_ids, partial(paths, endings=RUBRICS)),
    "LAB": lab_ids,
    "LAB|FILE": _either(lab_ids, partial(paths, endings=RUBRICS)),
    "MUTANT": operators,
    "N": nothing,
    "NAME": nothing,
    "PATH": ANY,
    "PERCENT": nothing,
    "ROSTER|FOLDER": partial(paths, endings=(".csv",)),
    "SOLUTION": partial(paths, endings=ARCHIVES),
    "SOURCE": partial(paths, endings=ARCHIVES),
    "TIME": nothing,
    "URL": nothing,
    "WHICH": partial(_words, WHICH),
}
"""By the name in capitals."""

SPECIAL: dict[tuple[str, str], Completer] = {
    ("grader explain", "name"): explained,
    ("grader example", "mistake"): mistakes,
    ("grader record", "script"): partial(paths, endings=(".py",)),
    ("grader record", "launch"): partial(paths, endings=(".launch",)),
    ("grader rubric validate", "files"): partial(paths, endings=RUBRICS),
}
"""By command and keyword, where the name in capitals does not tell."""


def completer_of(command: str, action: argparse.Action) -> Completer:
    """What offers the values of one option or positional argument of a command."""
    return SPECIAL.get((command, action.dest)) or BY_VALUE.get(value_of(action), nothing)


# [cli.completing.labs] What is known of labs: their ids, their criteria, the mistakes that their packages are tested with.
#
# Read from the files as YAML alone. To load rubrics properly takes longer than somebody waits for a key.

SAID_CHARS = 80


def lab_ids(**_asked: object) -> dict[str, str]:
    """The labs that come with the grader, each with its title."""
    return {lab: _line(_read(_shipped(lab)).get("title")) for lab in rubric_ids()}


def explained(*, prefix: str, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """What `grader explain` knows: criteria with their titles, with their lab before them once one is begun; checks."""
    rubric = getattr(parsed_args, "rubric", None)
    if rubric:
        path = _shipped(rubric) if rubric in rubric_ids() else Path(rubric)
        return {**_checks(), **dict(_criteria(path))}
    if "/" in prefix:
        lab = prefix.partition("/")[0]
        return {f"{lab}/{name}": title for name, title in _criteria(_shipped(lab))}
    criteria = {name: title for lab in rubric_ids() for name, title in _criteria(_shipped(lab))}
    labs = {f"{lab}/": "a criterion of this lab" for lab in rubric_ids()}
    return {**_checks(), **criteria, **labs}


def operators(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """The operators that the mutants of the named lab are made with."""
    return dict.fromkeys(sorted(set(_mutants(str(getattr(parsed_args, "rubric", ""))))), "")


def mistakes(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """Those operators of the named lab that make one mutant only: the mistake has the operator's name, too."""
    counted = Counter(_mutants(str(getattr(parsed_args, "lab", ""))))
    return {name: "" for name, times in sorted(counted.items()) if times == 1}


def _checks() -> dict[str, str]:
    from grader.checks import CHECKS  # noqa: PLC0415 - most completions do without

    return {check.name: _line(check.title) for check in CHECKS.values()}


def _criteria(path: Path) -> Iterator[tuple[str, str]]:
    """Those that students may know of."""
    for criterion in _entries(path, "criteria"):
        if criterion.get("visibility", "visible") == "visible":
            yield str(criterion.get("id", "")), _line(criterion.get("title"))


def _mutants(lab: str) -> Iterator[str]:
    if lab in rubric_ids():
        for mutant in _entries(rubrics_folder() / "mutants" / f"{lab}.yaml", "mutants"):
            yield str(mutant.get("operator", ""))


def _shipped(lab: str) -> Path:
    return rubrics_folder() / f"{lab}.yaml"


def _entries(path: Path, key: str) -> list[dict[str, Any]]:
    entries = _read(path).get(key)
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _read(path: Path) -> dict[str, Any]:
    """What the file says; empty where it cannot be read, as nothing may be said while somebody types."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        data = yaml.load(path.read_bytes(), loader)  # noqa: S506 - either of them is a safe one
    except (OSError, ValueError, yaml.YAMLError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def _line(words: object) -> str:
    return " ".join(str(words or "").split())[:SAID_CHARS]


# [cli.completing.paths] Files and folders, in each shell alike.

def paths(*, prefix: str, endings: Sequence[str] | None, **_asked: object) -> dict[str, str]:
    """Folders, with a `/` behind them, and files with one of the endings: None for all files, `()` for none."""
    folder, _, begun = prefix.rpartition("/")
    shown = f"{folder}/" if "/" in prefix else ""
    found: dict[str, str] = {}
    with suppress(OSError, ValueError, RuntimeError):  # not readable, no such user
        for entry in _entries_paths(Path(shown or ".").expanduser()):
            if not entry.name.startswith(begun) or (entry.name.startswith(".") and not begun.startswith(".")):
                continue
            if entry.is_dir():
                found[f"{shown}{entry.name}/"] = ""
            elif endings is None or entry.name.lower().endswith(tuple(endings)):
                found[f"{shown}{entry.name}"] = ""
    return found


def _entries_paths(folder: Path) -> Iterator[os.DirEntry[str]]:
    with os.scandir(folder) as entries:
        yield from sorted(entries, key=lambda entry: entry.name)


# [cli.completing.answer] Tells a shell what may be typed next.

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


# [cli.completing.script] What a shell loads to complete `grader`.

def script(shell: str) -> str:
    """The script for `bash`, `zsh` or `fish`. It asks the installed grader at each key, so it never grows old."""
    return shellcode(["grader"], shell=shell).strip() + "\n"
