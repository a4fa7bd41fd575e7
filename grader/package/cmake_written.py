"""Holds CMake's trace against the files as handed in: what was called has to be written there.

The build runs the package's own programs, and those can write into the trace too.
"""

from __future__ import annotations

import json
import posixpath
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

from cmake_parser import ast as nodes

from grader.model.package import Fault
from grader.package.cmake_syntax import commands_of
from grader.package.cmake_trace import split_lists
from grader.package.reading import read_markup

LINES_MAX = 20_000
FILES_BYTES_MAX = 400_000
"""Of all the files together that are parsed to hold the trace against them."""
_FILE_LIMIT_BYTES = 200_000
_BY_NAME = "cmake_language"
_FLOW = frozenset({"if", "elseif", "while", "foreach"})
_EXPANDED = frozenset("$@\\")

_Commands = dict[tuple[int, str], list[tuple[str, ...] | None]]
"""By line and name: the arguments, None where something in them is expanded."""


class Written(NamedTuple):
    """The trace as far as the files bear it out, and what of it was too much to be looked at, in words, or ""."""

    trace: bytes
    too_much: str = ""


def written_calls(trace: bytes, folder: Path, root: str) -> Written:
    """The trace without the calls that the package's files do not bear out: no command of that name at that line, or
    only with other arguments, where these are plain words.

    `folder` holds the package as handed in, `root` is where CMake saw it. A file that the parser cannot read through
    bears out everything, one that was not handed in nothing, and so does one that there is no more time for.
    """
    prefix = posixpath.normpath(root) + "/"
    files = _Files(folder)
    lines = trace.split(b"\n", LINES_MAX)
    too_many = f"CMake's trace has more than {LINES_MAX} lines" if len(lines) > LINES_MAX else ""
    kept = []
    for line in lines[:LINES_MAX]:
        call = _call(line)
        path = posixpath.normpath(call["file"]) if call else ""
        if (
            call is None
            or not path.startswith(prefix)
            or _fits(call, files.commands(path.removeprefix(prefix)))
        ):
            kept.append(line)
    return Written(b"\n".join(kept), too_many or files.too_much)


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


class _Files:
    """The commands of the package's files, each read once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._left_bytes = FILES_BYTES_MAX
        self._known: dict[str, _Commands | None] = {}
        self.too_much = ""

    def commands(self, path: str) -> _Commands | None:
        """None where the file cannot be read through."""
        if path not in self._known:
            self._known[path] = self._read(path)
        return self._known[path]

    def _read(self, path: str) -> _Commands | None:
        data = read_markup(self._folder, path)
        if isinstance(data, Fault):
            return {} if data.kind == "Missing" else None
        if len(data) > _FILE_LIMIT_BYTES:
            return None
        self._left_bytes -= len(data)
        if self._left_bytes < 0:
            self.too_much = f"CMake's files are more than {FILES_BYTES_MAX // 1000} kB together"
            return {}
        read = commands_of(data)
        found: _Commands = defaultdict(list)
        for command in read or ():
            found[command.line, command.identifier.lower()].append(_words(command))
        return None if read is None else found


def _fits(call: dict[str, Any], found: _Commands | None) -> bool:
    """`cmake_language(CALL name …)` is traced as a call of that name as well."""
    line, name = call["line"], call["cmd"].lower()
    if found is None or (line, _BY_NAME) in found:
        return True
    written = found.get((line, name), ())
    if name in _FLOW or None in written:
        return bool(written)
    return split_lists([a for a in call["args"] if isinstance(a, str)]) in written


def _words(command: nodes.Command) -> tuple[str, ...] | None:
    """The arguments as they are written; None where something in them is expanded."""
    words = [token for token in command.args if token.kind != "COMMENT"]
    if any(t.kind != "RAW" or _EXPANDED & set(t.value) for t in words):
        return None
    return split_lists([t.value for t in words])
