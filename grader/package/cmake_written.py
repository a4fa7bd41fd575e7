"""Holds CMake's trace against the files as handed in: what was called has to be written there.

The build runs the package's own programs, and those can write into the trace too.
"""

from __future__ import annotations

import json
import posixpath
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import Any

from cmake_parser import ast as nodes

from grader.model.package import Fault
from grader.package.cmake_syntax import commands_of
from grader.package.cmake_trace import split_lists
from grader.package.reading import read_markup

_FILE_LIMIT_BYTES = 200_000
_BY_NAME = "cmake_language"
_FLOW = frozenset({"if", "elseif", "while", "foreach"})
_EXPANDED = frozenset("$@\\")

_Commands = dict[tuple[int, str], list[nodes.Command]]


def written_calls(trace: bytes, folder: Path, root: str) -> bytes:
    """The trace without the calls that the package's files do not bear out: no command of that name at that line, or
    only with other arguments, where these are plain words.

    `folder` holds the package as handed in, `root` is where CMake saw it. A file that the parser cannot read through
    bears out everything, one that was not handed in nothing.
    """
    prefix = posixpath.normpath(root) + "/"
    commands = cache(lambda path: _commands(folder, path))
    kept = []
    for line in trace.splitlines(keepends=True):
        call = _call(line)
        path = posixpath.normpath(call["file"]) if call else ""
        if call is None or not path.startswith(prefix) or _fits(call, commands(path.removeprefix(prefix))):
            kept.append(line)
    return b"".join(kept)


def _call(line: bytes) -> dict[str, Any] | None:
    """An entry that names a call, None for whatever else is in the trace."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):  # cut short, or not CMake's
        return None
    wanted = {"file": str, "cmd": str, "line": int, "args": list}
    if isinstance(entry, dict) and all(isinstance(entry.get(key), kind) for key, kind in wanted.items()):
        return entry
    return None


def _commands(folder: Path, path: str) -> _Commands | None:
    """By line and name; None where the file cannot be read through."""
    data = read_markup(folder, path)
    if isinstance(data, Fault):
        return {} if data.kind == "Missing" else None
    found: _Commands = defaultdict(list)
    read = commands_of(data) if len(data) <= _FILE_LIMIT_BYTES else None
    for command in read or ():
        found[command.line, command.identifier.lower()].append(command)
    return None if read is None else found


def _fits(call: dict[str, Any], found: _Commands | None) -> bool:
    """`cmake_language(CALL name …)` is traced as a call of that name as well."""
    line, name = call["line"], call["cmd"].lower()
    if found is None or (line, _BY_NAME) in found:
        return True
    return any(_same_words(command, call["args"], name) for command in found.get((line, name), ()))


def _same_words(command: nodes.Command, args: list[Any], name: str) -> bool:
    """Whether the arguments are those that are written, as far as nothing in them is expanded."""
    words = [token for token in command.args if token.kind != "COMMENT"]
    if name in _FLOW or any(t.kind != "RAW" or _EXPANDED & set(t.value) for t in words):
        return True
    return split_lists([t.value for t in words]) == split_lists([a for a in args if isinstance(a, str)])
