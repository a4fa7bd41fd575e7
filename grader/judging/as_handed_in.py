"""Verdicts on the repaired copy, with the lines and names that its files have in the package as handed in. Pure.

A repair may add lines, take some out or rename a file, and the checks speak of what ran. Students look into their own
files.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from grader.model.repair import Repair
from grader.model.verdict import FileCitation, Verdict

LINES = re.compile(
    r"(?:(?P<before>[\w./-]+\.\w+),? )?\blines? (?P<numbers>\d+(?:(?:, | and | to )\d+)*)"
    r"(?: of (?P<behind>[\w./-]*\w))?"
)
WHOLE_FILES = ("encoding", "byte-order-mark", "line-ends", "file-name", "executable-bit")
"""Repairs of these kinds change no line."""


def with_lines_as_handed_in(verdict: Verdict, repairs: Sequence[Repair]) -> Verdict:
    """Return a verdict on a copy with these repairs, whose citations and texts name the lines before them."""
    moving, renamed = _moving(repairs), _renamed(repairs)
    if not moving:
        return verdict
    cited = tuple(
        one.model_copy(update={"line": _before(moving, renamed.get(one.file, one.file), one.line)})
        if isinstance(one, FileCitation) and one.line is not None
        else one
        for one in verdict.citations
    )
    files = {one.file for one in verdict.citations if isinstance(one, FileCitation)}
    alone = files.pop() if len(files) == 1 else ""
    texts = {
        name: text_as_handed_in(getattr(verdict, name), repairs, alone)
        for name in ("message", "hint", "cause")
    }
    return verdict.model_copy(update={"citations": cited, **texts})


def text_as_handed_in(text: str, repairs: Sequence[Repair], alone: str = "") -> str:
    """Return a text on the copy that names the lines before these repairs; a line without a file is of `alone`."""
    moving, renamed = _moving(repairs), _renamed(repairs)

    def counted(found: re.Match[str]) -> str:
        file = found["before"] or found["behind"] or alone
        file = renamed.get(file, file)
        numbers = re.sub(r"\d+", lambda n: str(_before(moving, file, int(n[0]))), found["numbers"])
        start = found.start("numbers") - found.start()
        return found[0][:start] + numbers + found[0][start + len(found["numbers"]) :]

    return LINES.sub(counted, text) if moving else text


def repairs_as_handed_in(needed: Iterable[Repair], repairs: Iterable[Repair]) -> tuple[Repair, ...]:
    """Return the repairs with the names that their files have in the package as it is: on the copy, a file may have
    got its right name first."""
    names = {new: old for old, new in _renamed(repairs).items()}
    old = ((one, names.get(one.file, one.file)) for one in needed)
    return tuple(
        one.model_copy(update={"file": file, "message": one.message.replace(one.file, file)})
        for one, file in old
    )


def with_names_as_handed_in(copy: Verdict, repairs: Iterable[Repair]) -> Verdict:
    """Return a verdict on the copy that cites files by the names that they have in the package as it is."""
    names = {new: old for old, new in _renamed(repairs).items()}
    cited = tuple(
        one.model_copy(update={"file": names.get(one.file, one.file)})
        if isinstance(one, FileCitation)
        else one
        for one in copy.citations
    )
    return copy.model_copy(update={"citations": cited})


def _renamed(repairs: Iterable[Repair]) -> dict[str, str]:
    return {one.before: one.after for one in repairs if one.kind == "file-name"}


def _moving(repairs: Sequence[Repair]) -> list[Repair]:
    """Return the repairs that add lines or take some out, of files by the names that they get."""
    renamed = _renamed(repairs)
    return [
        one.model_copy(update={"file": renamed.get(one.file, one.file)})
        for one in repairs
        if one.kind not in WHOLE_FILES and one.before.count("\n") != one.after.count("\n")
    ]


def _before(moving: Sequence[Repair], file: str, line: int) -> int:
    """Return the number that the line of a file had before the repairs, the last of which is undone first."""
    for one in reversed(moving):
        first, old, new = one.line or 1, one.before.split("\n"), one.after.split("\n")
        if one.file != file or line < first:
            continue
        at = line - first
        if at >= len(new):
            line += len(old) - len(new)
        else:
            same = [i for i, text in enumerate(old) if text == new[at]]
            line = first + min(same or [min(at, len(old) - 1)], key=lambda i: abs(i - at))
    return line
