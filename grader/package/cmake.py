"""`CMakeLists.txt` as CMake reads it where a trace is at hand, and by `cmake_parse` where none is.

A trace is what CMake writes by `--trace-expand --trace-format=json-v1`: one JSON object a line, perhaps cut short. The
build runs the package's own programs, and those can write into it too, so it is compared with the files as handed in.
"""

from __future__ import annotations

import json
import posixpath
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from cmake_parser import ast as nodes

from grader.model.file_fault import Fault
from grader.model.package import CMAKE, CMakeCall, CMakeFacts
from grader.package.cmake_parse import commands_of, parse_cmake
from grader.package.reading import printable, read_markup

# What steers CMake or only talks; everything else is a fact, and so is what a loop goes through.
_LEFT_OUT = frozenset(
    {
        *("if", "elseif", "else", "endif", "endforeach", "while", "endwhile", "block", "endblock"),
        *("function", "endfunction", "macro", "endmacro", "return", "break", "continue", "message"),
    },
)
_LINE_BYTES_MAX = 1_000_000
_TRACE_LINES_MAX = 500_000
_TRACE_BYTES_MAX = 64_000_000
_CALLS_MAX = 20_000
_CHARS_MAX = 4_000_000
# CMake keeps lists as text with `;` between the items; `\;` is a semicolon of an item
_SEPARATOR = re.compile(r"(?<!\\);")
LINES_MAX = 20_000
FILES_BYTES_MAX = 400_000
"""Of all the files together that are parsed to hold the trace against them."""
_SOURCE_BYTES_MAX = 200_000
_BY_NAME = "cmake_language"
_FLOW = frozenset({"if", "elseif", "while", "foreach"})
_EXPANDED = frozenset("$@\\")

_Commands = dict[tuple[int, str], list[tuple[str, ...] | None]]
"""By line and name: the arguments, None where something in them is expanded."""


def read_cmake(folder: Path, name: str) -> CMakeFacts | None:
    """Return the calls of the package's CMake files; None where there is no `CMakeLists.txt`.

    `name` is the package's name for variables that catkin sets.
    """
    facts = parse_cmake(folder, name)
    return facts and facts.model_copy(update={"calls": _without_left_out(facts.calls)})


def refine_cmake(
    facts: CMakeFacts, names: tuple[str, ...], *, trace: Path, root: str | None = None
) -> CMakeFacts:
    """Return the parser's `facts`, replaced by what CMake itself was told.

    `trace` is what CMake wrote by `--trace-expand --trace-format=json-v1`, `root` the package's folder as
    CMake saw it; without it, a folder that has one of the `names` is looked for. Where CMake gave up before
    the end of the file, the parser's calls from there on are kept. A trace without any call of the package
    changes nothing.
    """
    calls = read_trace(trace, names, root)
    if facts.source == "trace" or not calls:
        return facts
    # What stands below a fatal error was never traced
    reached = max(call.line for call in calls if call.file == CMAKE)
    # `return()` ends the file early on purpose: nothing below it is called
    returned = any(call.name == "return" for call in calls)
    stopped = not returned and facts.last_line is not None and reached < facts.last_line
    rest = tuple(c for c in facts.calls if stopped and c.file == CMAKE and c.line > reached)
    return CMakeFacts(
        file=facts.file,
        source="trace",
        calls=(*_without_left_out(calls), *rest),
        last_line=facts.last_line,
        stopped_line=reached if stopped else None,
        commented=facts.commented,
    )


def _without_left_out(calls: tuple[CMakeCall, ...]) -> tuple[CMakeCall, ...]:
    return tuple(call for call in calls if call.name not in _LEFT_OUT)


def read_trace(trace: Path, names: tuple[str, ...], root: str | None = None) -> tuple[CMakeCall, ...]:
    """Return the calls of the package's own CMake files, in order, with paths relative to the package.

    `root` is the package's folder as CMake saw it. Without it, that is the folder of a traced
    `CMakeLists.txt` that has one of the `names`, or the only one there is. Empty where the trace has none,
    cannot be read, or is of a version other than 1.
    """
    calls = _calls(trace)
    root = posixpath.normpath(root) if root else _guessed_root(calls, names)
    if root is None:
        return ()
    # With the slash, as `/ws/src/lab` is no folder of `/ws/src/lab_two`
    prefix = root.rstrip("/") + "/"
    inside = tuple(
        call.model_copy(update={"file": call.file.removeprefix(prefix)})
        for call in calls
        if call.file.startswith(prefix)
    )
    return inside if any(call.file == CMAKE for call in inside) else ()


def _guessed_root(calls: list[CMakeCall], names: tuple[str, ...]) -> str | None:
    folders = dict.fromkeys(posixpath.dirname(c.file) for c in calls if posixpath.basename(c.file) == CMAKE)
    named = [f for f in folders if posixpath.basename(f) in names]
    if named:
        return named[0]
    return next(iter(folders)) if len(folders) == 1 else None


def _calls(trace: Path) -> list[CMakeCall]:
    calls: list[CMakeCall] = []
    letters = 0
    for entry in _entries(trace):
        version = entry.get("version")
        # Another major version may name its keys otherwise
        if isinstance(version, dict) and version.get("major") != 1:
            return []
        call = _call(entry)
        if call is not None:
            # An argument takes memory even if it is empty
            letters += sum(map(len, call.args)) + 100 * len(call.args)
            if letters > _CHARS_MAX:
                break
            calls.append(call)
        if len(calls) >= _CALLS_MAX:
            break
    return calls


def _entries(trace: Path) -> Iterator[dict[str, Any]]:
    try:
        with trace.open("rb") as stream:
            read_bytes = 0
            for _ in range(_TRACE_LINES_MAX):
                line = stream.readline(_LINE_BYTES_MAX)
                read_bytes += len(line)
                if not line or read_bytes > _TRACE_BYTES_MAX:
                    return
                yield _decode(line)
    except OSError:
        return


def _decode(line: bytes) -> dict[str, Any]:
    """Return an entry of the trace; an empty one where the line holds none."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):  # garbage between the lines, or the last one cut short
        return {}
    return entry if isinstance(entry, dict) else {}


def _is_call(entry: dict[str, Any]) -> bool:
    wanted = {"file": str, "cmd": str, "line": int, "args": list}
    return all(isinstance(entry.get(key), kind) for key, kind in wanted.items())


def _call(entry: dict[str, Any]) -> CMakeCall | None:
    if not _is_call(entry) or entry["line"] <= 0 or not all(isinstance(arg, str) for arg in entry["args"]):
        return None
    name, file = printable(entry["cmd"]).lower(), posixpath.normpath(printable(entry["file"]))
    return CMakeCall(name=name, args=split_lists(entry["args"]), file=file, line=entry["line"])


def split_lists(args: list[str]) -> tuple[str, ...]:
    """Return arguments after expansion as CMake hands them on: a list `a;b` is two of them, an empty one is none."""
    parts = (part for arg in args for part in _SEPARATOR.split(arg))
    return tuple(printable(part.replace("\\;", ";")) for part in parts if part)


class Written(NamedTuple):
    """The trace as far as the files bear it out, and what of it was too much to be looked at, in words, or ""."""

    trace: bytes
    too_much: str = ""


def written_calls(trace: bytes, folder: Path, root: str) -> Written:
    """Return the trace without the calls that the package's files do not bear out: no command of that name at that
    line, or only with other arguments, where these are plain words.

    `folder` holds the package as handed in, `root` is where CMake saw it. A file that the parser cannot read through
    bears out everything, one that was not handed in nothing, and so does one that there is no more time for.
    """
    prefix = posixpath.normpath(root) + "/"
    files = _Files(folder)
    lines = trace.split(b"\n", LINES_MAX)
    too_many = f"CMake's trace has more than {LINES_MAX} lines" if len(lines) > LINES_MAX else ""
    kept = []
    for line in lines[:LINES_MAX]:
        call = _decode(line)
        path = posixpath.normpath(call["file"]) if _is_call(call) else ""
        # Only the package's own files are at hand here; catkin's are left as they are
        if not path.startswith(prefix) or _fits(call, files.commands(path.removeprefix(prefix))):
            kept.append(line)
    return Written(b"\n".join(kept), too_many or files.too_much)


class _Files:
    """The commands of the package's files, each read once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._left_bytes = FILES_BYTES_MAX
        self._known: dict[str, _Commands | None] = {}
        self.too_much = ""

    def commands(self, path: str) -> _Commands | None:
        """Return the file's commands; None where it cannot be read through."""
        if path not in self._known:
            self._known[path] = self._read(path)
        return self._known[path]

    def _read(self, path: str) -> _Commands | None:
        data = read_markup(self._folder, path)
        if isinstance(data, Fault):
            return {} if data.kind == "Missing" else None
        if len(data) > _SOURCE_BYTES_MAX:
            return None
        # A limit for each file is not enough: a package may have any number of them
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
    # CMake expands the words of conditions and of variables: only that the command is there can be compared
    if name in _FLOW or None in written:
        return bool(written)
    return split_lists([a for a in call["args"] if isinstance(a, str)]) in written


def _words(command: nodes.Command) -> tuple[str, ...] | None:
    """Return the arguments as they are written; None where something in them is expanded."""
    words = [token for token in command.args if token.kind != "COMMENT"]
    # Quotes, `$`, `@` and escapes: CMake shows what became of them, and not how they were written
    if any(t.kind != "RAW" or _EXPANDED & set(t.value) for t in words):
        return None
    return split_lists([t.value for t in words])
