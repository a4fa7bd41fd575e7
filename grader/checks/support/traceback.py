"""Python tracebacks among the lines that a process printed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

HEADING = "Traceback (most recent call last):"
_FRAME = re.compile(r'^\s+File "([^"]+)", line (\d+)')
_LAST = re.compile(r"^([A-Za-z_][\w.]*)(?:: ?(.*))?$")
_LIBRARY = ("/dist-packages/", "/site-packages/", "/usr/lib/python", "<frozen", "/opt/ros/")


class Frame(NamedTuple):
    file: str
    line: int

    @property
    def in_library(self) -> bool:
        return any(part in self.file for part in _LIBRARY)


class Traceback(NamedTuple):
    """`kind` is the exception's class without its module; `first` and `last` are the indices of its lines."""

    kind: str
    message: str
    frames: tuple[Frame, ...]
    first: int
    last: int

    @property
    def text(self) -> str:
        """The last line, as Python prints it."""
        return f"{self.kind}: {self.message}" if self.message else self.kind

    @property
    def own_frames(self) -> tuple[Frame, ...]:
        """Those outside Python's and ROS's own code, the innermost last."""
        return tuple(f for f in self.frames if not f.in_library)


def tracebacks(lines: Sequence[str]) -> tuple[Traceback, ...]:
    """Every traceback, also the bare `File …` form of a syntax error. One that was cut short is left out."""
    found: list[Traceback] = []
    frames: list[Frame] = []
    first: int | None = None
    bare = _followed_by_syntax_error(lines)
    for index, line in enumerate(lines):
        frame = _FRAME.match(line)
        if HEADING in line:
            first, frames = index, []
        elif frame and (first is not None or bare[index]):
            first = index if first is None else first
            frames.append(Frame(frame[1], int(frame[2])))
        elif first is not None and line and not line[0].isspace():
            last = _LAST.match(line)
            if last:
                kind = last[1].rpartition(".")[2]
                found.append(Traceback(kind, (last[2] or "").strip(), tuple(frames), first, index))
            first = None
    return tuple(found)


def _followed_by_syntax_error(lines: Sequence[str]) -> list[bool]:
    """For each line whether only indented ones come, then the name of a syntax error: one of the script itself has no
    heading."""
    found, named = [False] * len(lines), False
    for index in range(len(lines) - 1, -1, -1):
        found[index], line = named, lines[index]
        if line and not line[0].isspace():
            named = line.startswith(("SyntaxError", "IndentationError", "TabError"))
    return found
