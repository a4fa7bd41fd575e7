"""Which values fit where: by what the help calls them, for nearly all of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import partial

from grader.cli.completing.labs import explained, lab_ids, mistakes, mutants
from grader.cli.completing.paths import paths
from grader.cli.parsing.walk import value_of

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
    "MUTANT": mutants,
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
