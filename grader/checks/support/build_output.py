"""The first error in what a build printed, and the line of the package's own that it comes from."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

from grader.checks.support.scripts import path_in_package
from grader.checks.support.text import shown
from grader.model.package import PackageFacts
from grader.model.verdict import FileCitation

_CMAKE_ERROR = re.compile(
    r"^CMake Error(?: at (?P<file>[^:()]+):(?P<line>\d+)(?: \((?P<call>\w+)\))?)?:?\s*(?P<text>.*)"
)
_COMPILER_ERROR = re.compile(r"^(?P<file>[^:\s][^:]*):(?P<line>\d+):(?:\d+:)? (?:fatal )?error: (?P<text>.*)")
_OTHER_ERROR = re.compile(
    r"(?P<text>.*(?:\b[Ee]rror:|Error\(s\)|undefined reference|cannot find -l|No rule to make|[A-Za-z]Error:|\*\*\*).*)"
)
_CALLER = re.compile(r"^\s+(?P<file>[^:()]+):(?P<line>\d+) \(\w+\)$")
CALL_STACK = "Call Stack (most recent call first):"
CALLERS_MAX = 40
SYSTEM = ("/usr/", "/opt/")
FIRST_ERROR_HINT = "run catkin_make in a fresh clone and fix the first error that it prints"


class BuildError(NamedTuple):
    """The first error that the build printed; `kind` is `cmake`, `compiler` or `other`.

    `place` is the line of the package's own that it comes from.
    """

    kind: str
    text: str
    place: FileCitation | None


class Explained(NamedTuple):
    """The error in a student's words, and what to do; `of_machine`: the grading machine lacks something; `place`: the
    line that is wrong, where that is not the one that the build names; `lacks`: the package that it lacks; `by_itself`:
    a command that CMake does not know, and no line of catkin's own is why; `uncalled`: a command to call."""

    why: str
    hint: str
    of_machine: bool = False
    place: FileCitation | None = None
    lacks: str = ""
    by_itself: bool = False
    uncalled: str = ""


Explain = Callable[[re.Match[str], PackageFacts, Sequence[str]], Explained]
"""From what was found in an error, the package and the build's lines to the error in a student's words."""


def told(why: str, hint: str) -> Explain:
    """Return what explains an error in these words; {0} stands for all of it, {1} for the pattern's first group."""

    def explain(found: re.Match[str], _package: PackageFacts, _lines: Sequence[str]) -> Explained:
        printed = (found.string, *found.groups())
        return Explained(why.format(*printed), hint.format(*printed))

    return explain


def first_error(lines: Sequence[str], package: PackageFacts) -> BuildError | None:
    """Return the first line that fits: a compiler's error comes before make's summary of it."""
    for index, line in enumerate(lines):
        if match := _CMAKE_ERROR.match(line):
            below = lines[index + 1 :]
            called = [(match["file"] or "", int(match["line"] or 0)), *_callers(below)]
            places = (_own_line(package, file, number) for file, number in called)
            text = match["text"] or _paragraph(below)
            place = next(filter(None, places), None)
            named = place is None and match["file"] and not match["file"].startswith(SYSTEM)
            text = f"{match['file']}:{match['line']}: {text}" if named else text
            return BuildError("cmake", shown(text), place)
        if match := _COMPILER_ERROR.match(line):
            place = _own_line(package, match["file"], int(match["line"]))
            where = f"{posixpath.basename(match['file'])}:{match['line']}: "
            name = "" if match["file"].startswith(SYSTEM) else where
            return BuildError("compiler", shown(name + match["text"]), place)
    other = next((m["text"] for m in map(_OTHER_ERROR.match, lines) if m), None)
    return BuildError("other", shown(other), None) if other else None


def _callers(lines: Sequence[str]) -> list[tuple[str, int]]:
    """The call stack below an error, the innermost call first."""
    end = next((i for i, line in enumerate(lines[:CALLERS_MAX]) if line.startswith("CMake ")), CALLERS_MAX)
    begin = next((i for i, line in enumerate(lines[:end]) if line.startswith(CALL_STACK)), end)
    found = (_CALLER.match(line) for line in lines[begin + 1 : end])
    return [(match["file"], int(match["line"])) for match in found if match]


def _own_line(package: PackageFacts, file: str, line: int) -> FileCitation | None:
    """The line if it lies in the package. A bare `CMakeLists.txt` is the workspace's own."""
    outside = not line or "/" not in file or file.startswith(SYSTEM)
    path = None if outside else path_in_package(package, file)
    folder = posixpath.basename(posixpath.dirname(file))
    of_another = path == "CMakeLists.txt" and folder not in folder_names(package)
    return FileCitation(file=path, line=line) if path and not of_another else None


def folder_names(package: PackageFacts) -> set[str]:
    """The names that the package's folder may have in the build's workspace."""
    manifest = {package.manifest.name} if package.manifest else set()
    return {package.name, posixpath.basename(package.path), *manifest}


def _paragraph(lines: Sequence[str]) -> str:
    """The text of a CMake error: the first paragraph after its heading, and the one that its colon announces."""
    words: list[str] = []
    for line in lines:
        ends = bool(words) and not line.strip() and not _goes_on(words)
        if ends or line.startswith((CALL_STACK, "CMake ")):
            break
        words += line.split()
    return " ".join(words)


def _goes_on(words: Sequence[str]) -> bool:
    """CMake sets a path apart by blank lines in the middle of this sentence."""
    return words[-1].endswith(":") or (words[:3] == ["The", "source", "directory"] and words[-1][-1] != ".")
