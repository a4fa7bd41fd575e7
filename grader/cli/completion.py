"""What a shell offers when TAB is pressed: commands and options from the parser, and values that fit each argument.

The name of a value in the help tells which values these are, for nearly all of them. Labs are read as YAML alone:
loading rubrics properly takes longer than anyone waits for a key.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import argcomplete
from argcomplete.shell_integration import shellcode

from grader.cli.main import build_parser, commands, options, value_of

Completer = Callable[..., Mapping[str, str]]
"""Called with `prefix` and `parsed_args`; returns values, each with a description or ""."""
RUBRICS = (".yaml", ".yml")
ARCHIVES = (".bag", ".mcap", ".db3", ".tar", ".tar.bz2", ".tar.gz", ".tar.xz", ".tgz", ".zip")
RECORDINGS = (".bag", ".mcap", ".db3")
DESCRIPTION_CHARS = 80


def script(shell: str) -> str:
    """Return the script for `bash`, `zsh` or `fish`. It asks the installed grader at each key, so it never gets old."""
    return shellcode(["grader"], shell=shell).strip() + "\n"


def answer() -> None:
    """Tell the shell that asks (through the environment) what fits, and end the process."""
    argcomplete.autocomplete(completing_parser(), always_complete_options=False)


def completing_parser() -> argparse.ArgumentParser:
    """Return the parser with a completer for each value."""
    parser = build_parser()
    for command in commands(parser):
        for action in options(command):
            # what takes no value, or names its choices itself, needs no completer
            if action.nargs != 0 and action.choices is None:
                completed: Any = action
                completed.completer = completer_of(command.prog, action)
    return parser


def completer_of(command: str, action: argparse.Action) -> Completer:
    """Return what offers the values of an option or positional argument of a command."""
    return SPECIAL.get((command, action.dest)) or BY_VALUE.get(value_of(action), nothing)


def nothing(**_asked: object) -> dict[str, str]:
    """Offer nothing, for values that cannot be known: a name, a number, an address."""
    return {}


def paths(*, prefix: str, endings: Sequence[str] | None, **_asked: object) -> dict[str, str]:
    """Offer folders, with a `/` behind them, and files with one of the endings: None for all, `()` for no files."""
    folder, _, begun = prefix.rpartition("/")
    shown = f"{folder}/" if "/" in prefix else ""
    found: dict[str, str] = {}
    with suppress(OSError, ValueError, RuntimeError), os.scandir(Path(shown or ".").expanduser()) as entries:
        for entry in sorted(entries, key=lambda entry: entry.name):
            # hidden ones only once a dot is typed, as shells do it
            if not entry.name.startswith(begun) or (entry.name.startswith(".") and not begun.startswith(".")):
                continue
            if entry.is_dir():
                found[f"{shown}{entry.name}/"] = ""
            elif endings is None or entry.name.lower().endswith(tuple(endings)):
                found[f"{shown}{entry.name}"] = ""
    return found


def lab_ids(**_asked: object) -> dict[str, str]:
    """Offer the labs that come with the grader, each with its title."""
    return {lab: _description(_read(path).get("title")) for lab, path in _labs().items()}


def labs_and_rubrics(**asked: Any) -> dict[str, str]:  # noqa: ANN401 - passed on
    """Offer labs, folders and rubric files."""
    return {**lab_ids(), **paths(endings=RUBRICS, **asked)}


def selections(**_asked: object) -> dict[str, str]:
    """Offer the words that `grader batch --only` knows."""
    return {
        "failed": "those that could not be graded, or have no result",
        "inconclusive": "those with something that could not be judged",
        "changed": "those whose submission, rubric or grader has changed",
    }


def submissions(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """Offer the ids of the class in the folder that is named already, each with the student's name."""
    with suppress(OSError, ValueError, TypeError, AttributeError, KeyError):
        run = json.loads(Path(parsed_args.folder, "run.json").read_bytes())
        return {str(entry["id"]): _description(entry.get("name")) for entry in run["entries"]}
    return {}


def course_labs(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """Offer the labs of the course's file that is named already, each with its rubric."""
    from grader.errors import GraderError  # noqa: PLC0415 - a build needs only `script`
    from grader.rubric.course import load_course  # noqa: PLC0415 - as above

    with suppress(OSError, ValueError, TypeError, AttributeError, GraderError):
        labs = load_course(Path(parsed_args.course)).course.labs
        return {name: lab.rubric for name, lab in labs.items()}
    return {}


def explained(*, prefix: str, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """Offer what `grader explain` knows: checks, and criteria with their titles, after `LAB/` once that is typed."""
    rubric = getattr(parsed_args, "rubric", None)
    labs = _labs()
    if rubric:
        return {**_checks(), **dict(_criteria(labs.get(rubric, Path(rubric))))}
    if "/" in prefix:
        lab = prefix.partition("/")[0]
        return {f"{lab}/{name}": title for name, title in _criteria(labs.get(lab, Path(lab)))}
    criteria = {name: title for path in labs.values() for name, title in _criteria(path)}
    return {**_checks(), **criteria, **{f"{lab}/": "a criterion of this lab" for lab in labs}}


def mutants(*, parsed_args: argparse.Namespace, named: str, **_asked: object) -> dict[str, str]:
    """Offer the faulty packages of the lab that the argument `named` names."""
    path = _labs().get(str(getattr(parsed_args, named, "")))
    declared = _read(path.parent.parent / "fixtures" / path.name).get("mutants") if path else None
    found = declared.items() if isinstance(declared, dict) else ()
    return {
        str(name): _description(mutant.get("summary"))
        for name, mutant in found
        if isinstance(mutant, dict) and mutant.get("expect")
    }


BY_VALUE: dict[str, Completer] = {
    "ADDRESS": nothing,
    "COURSE": partial(paths, endings=RUBRICS),
    "DIR": partial(paths, endings=()),
    "DIR|ZIP": partial(paths, endings=(".zip",)),
    "EVIDENCE": partial(paths, endings=RECORDINGS),
    "FILE": partial(paths, endings=None),
    "RESULT": partial(paths, endings=(".json",)),
    "ID|FILE": labs_and_rubrics,
    "ID": submissions,
    "LAB": lab_ids,
    "LAB|FILE": labs_and_rubrics,
    "MUTANT": partial(mutants, named="rubric"),
    "N": nothing,
    "N|NAMES": nothing,
    "NAME": nothing,
    "OTHER": partial(paths, endings=()),
    "PATH": partial(paths, endings=None),
    "PERCENT": nothing,
    "ROSTER|FOLDER": partial(paths, endings=(".csv",)),
    "SOLUTION": partial(paths, endings=ARCHIVES),
    "SOURCE": partial(paths, endings=ARCHIVES),
    "TIME": nothing,
    "URL": nothing,
    "WHICH": selections,
}
"""By the name of the value in the help."""

SPECIAL: dict[tuple[str, str], Completer] = {
    ("grader explain", "name"): explained,
    ("grader example", "mistake"): partial(mutants, named="lab"),
    ("grader record", "script"): partial(paths, endings=(".py",)),
    ("grader record", "launch"): partial(paths, endings=(".launch",)),
    ("grader course grade", "lab"): course_labs,
    ("grader course publish", "lab"): course_labs,
    ("grader rubric validate", "files"): partial(paths, endings=RUBRICS),
}
"""By command and keyword, where the name of the value does not tell."""


def _labs() -> dict[str, Path]:
    from grader.rubric.find import known_labs  # noqa: PLC0415 - a build needs only `script`

    return {lab.id: lab.path for lab in known_labs()}


def _checks() -> dict[str, str]:
    from grader.checks import CHECKS  # noqa: PLC0415 - most completions do without

    return {check.name: _description(check.title) for check in CHECKS.values()}


def _criteria(path: Path) -> Iterator[tuple[str, str]]:
    """Return the criteria that students may know of."""
    entries = _read(path).get("criteria")
    for criterion in entries if isinstance(entries, list) else ():
        if isinstance(criterion, dict) and criterion.get("visibility", "visible") == "visible":
            yield str(criterion.get("id", "")), _description(criterion.get("title"))


def _read(path: Path) -> dict[str, Any]:
    """Return the content of the file, or {} if it cannot be read: no error may be shown while someone types."""
    import yaml  # noqa: PLC0415 - a build needs only `script`

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        data = yaml.load(path.read_bytes(), loader)  # noqa: S506 - either of them is a safe one
    except (OSError, ValueError, yaml.YAMLError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def _description(words: object) -> str:
    return " ".join(str(words or "").split())[:DESCRIPTION_CHARS]
