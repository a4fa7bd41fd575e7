"""Slips that change a line or two of a file: the record, and those that any text can have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple


class LineSlip(NamedTuple):
    """A slip in a file: why its line is wrong, the line's number (from 1), what to do, and the text without it.

    `is_within` is whether the line itself has the slip, and not its place.
    """

    why: str
    number: int
    fix: str
    text: str
    is_within: bool = False


def changed_line(lines: list[str], number: int, line: str, why: str) -> LineSlip:
    """Return the slip of which the line with that number is put right."""
    text = "\n".join([*lines[: number - 1], line, *lines[number:]])
    return LineSlip(why, number, f"write `{line.strip()}`", text, is_within=True)


def doubled_and_turned(lines: list[str], near: Iterable[int]) -> Iterator[LineSlip]:
    """Yield the texts without a line that is there twice, then those with two lines exchanged, by the numbers of lines
    near which the slip may be."""
    beside = dict.fromkeys(one for number in near for one in (number, number + 1) if 1 < one <= len(lines))
    pairs = [(number, lines[number - 2], lines[number - 1]) for number in beside]
    for number, first, second in pairs:
        if first.strip() == second.strip():
            left = "\n".join([*lines[: number - 1], *lines[number:]])
            yield LineSlip("this line repeats the one above", number, f"delete line {number}", left)
    for number, first, second in pairs:
        if first.strip() and second.strip():
            turned = "\n".join([*lines[: number - 2], second, first, *lines[number:]])
            why = f"lines {number - 1} and {number} are the wrong way round"
            yield LineSlip(why, number, f"write line {number} above line {number - 1}", turned)
