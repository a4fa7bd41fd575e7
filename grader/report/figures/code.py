"""The lines of a student's files that a verdict cites, with those around them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from grader.evidence.run import Run
from grader.model.figure import CodeFigure
from grader.model.verdict import Citation, FileCitation
from grader.report.figures.bounded import named, short

AROUND = 3
APART_MAX = 4
"""So many lines between two places are shown too, rather than left out."""
LINES_MAX = 60
FIGURES_MAX = 6
BYTES_MAX = 2_000_000
_LINE_END = re.compile(r"\r\n|\r|\n")


def code_figures(build: Run, citations: Sequence[Citation]) -> Iterator[CodeFigure]:
    """A figure for each place of each file that was kept; places near each other are one."""
    cited = [c for c in citations if isinstance(c, FileCitation) and c.line is not None]
    left = FIGURES_MAX
    for file in dict.fromkeys(c.file for c in cited):
        lines = _lines(build.attachments, file)
        marks = sorted({c.line or 0 for c in cited if c.file == file and 0 < (c.line or 0) <= len(lines)})
        for group in _groups(marks):
            if not left:
                return
            left -= 1
            yield _figure(file, lines, group)


def _lines(attachments: Mapping[str, bytes], file: str) -> list[str]:
    data = attachments.get(file, b"")[:BYTES_MAX]
    text = data.decode("utf-8-sig", errors="replace")
    lines = _LINE_END.split(text)
    if lines[0].startswith("#!") and text.startswith(f"{lines[0]}\r"):
        lines[0] += "\r"  # for the kernel, part of the program's name
    return lines if lines[-1] else lines[:-1]


def _groups(marks: Sequence[int]) -> Iterator[list[int]]:
    """Marks whose surroundings meet, or nearly."""
    group: list[int] = []
    for mark in marks:
        far = group and mark - group[-1] > 2 * AROUND + 1 + APART_MAX
        full = group and mark - group[0] >= LINES_MAX - 2 * AROUND
        if far or full:
            yield group
            group = []
        group.append(mark)
    if group:
        yield group


def _figure(file: str, lines: Sequence[str], marks: Sequence[int]) -> CodeFigure:
    first = max(1, marks[0] - AROUND)
    return CodeFigure(
        file=named(file),
        first_line=first,
        lines=tuple(short(line) for line in lines[first - 1 : marks[-1] + AROUND]),
        marked=tuple(marks),
    )
