"""What CMake wrote by `--trace-expand --trace-format=json-v1`: one JSON object a line, perhaps cut short."""

from __future__ import annotations

import json
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from grader.model.package import CMakeCall
from grader.package.reading import printable

_LINE_LIMIT_BYTES = 1_000_000
_LINES_LIMIT = 500_000
_FILE_LIMIT_BYTES = 64_000_000
_CALLS_LIMIT = 20_000
_LETTERS_LIMIT = 4_000_000
_CMAKE_FILE = "CMakeLists.txt"
_SEPARATOR = re.compile(r"(?<!\\);")


def read_trace(trace: Path, names: tuple[str, ...], root: str | None = None) -> tuple[CMakeCall, ...]:
    """The calls of the package's own CMake files, in order, with paths relative to the package.

    `root` is the package's folder as CMake saw it. Without it, that is the folder of a traced
    `CMakeLists.txt` that has one of the `names`, or the only one there is. Empty where the trace has none,
    cannot be read, or is of a version other than 1.
    """
    calls = _calls(trace)
    root = posixpath.normpath(root) if root else _guessed_root(calls, names)
    if root is None:
        return ()
    prefix = root.rstrip("/") + "/"
    inside = tuple(
        call.model_copy(update={"file": call.file.removeprefix(prefix)})
        for call in calls
        if call.file.startswith(prefix)
    )
    return inside if any(call.file == _CMAKE_FILE for call in inside) else ()


def _guessed_root(calls: list[CMakeCall], names: tuple[str, ...]) -> str | None:
    folders = dict.fromkeys(
        posixpath.dirname(c.file) for c in calls if posixpath.basename(c.file) == _CMAKE_FILE
    )
    named = [f for f in folders if posixpath.basename(f) in names]
    if named:
        return named[0]
    return next(iter(folders)) if len(folders) == 1 else None


def _calls(trace: Path) -> list[CMakeCall]:
    calls: list[CMakeCall] = []
    letters = 0
    for entry in _entries(trace):
        version = entry.get("version")
        if isinstance(version, dict) and version.get("major") != 1:
            return []
        call = _call(entry)
        if call is not None:
            letters += sum(map(len, call.args)) + 100 * len(call.args)
            if letters > _LETTERS_LIMIT:
                break
            calls.append(call)
        if len(calls) >= _CALLS_LIMIT:
            break
    return calls


def _entries(trace: Path) -> Iterator[dict[str, Any]]:
    try:
        with trace.open("rb") as stream:
            read_bytes = 0
            for _ in range(_LINES_LIMIT):
                line = stream.readline(_LINE_LIMIT_BYTES)
                read_bytes += len(line)
                if not line or read_bytes > _FILE_LIMIT_BYTES:
                    return
                entry = _decoded(line)
                if isinstance(entry, dict):
                    yield entry
    except OSError:
        return


def _decoded(line: bytes) -> Any:  # noqa: ANN401 - whatever JSON holds
    try:
        return json.loads(line)
    except (ValueError, RecursionError):  # garbage between the lines, or the last one cut short
        return None


def _call(entry: dict[str, Any]) -> CMakeCall | None:
    name, args, file, line = (entry.get(key) for key in ("cmd", "args", "file", "line"))
    if not (isinstance(name, str) and isinstance(file, str) and isinstance(line, int) and line > 0):
        return None
    if not isinstance(args, list) or not all(isinstance(arg, str) for arg in args):
        return None
    return CMakeCall(
        name=printable(name).lower(),
        args=split_lists(args),
        file=posixpath.normpath(printable(file)),
        line=line,
    )


def split_lists(args: list[str]) -> tuple[str, ...]:
    """Arguments after expansion as CMake hands them on: a list `a;b` is two of them, an empty one is none."""
    parts = (part for arg in args for part in _SEPARATOR.split(arg))
    return tuple(printable(part.replace("\\;", ";")) for part in parts if part)
