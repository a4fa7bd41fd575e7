"""Texts and numbers of a figure: each of bounded size, whatever the evidence holds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from grader.evidence.run import BARE_NAME, Run, is_grader_node
from grader.wording import shorten

NAME_LETTERS = 200
LINE_LETTERS = 300
LARGEST = 2**64
SPREAD = (math.sqrt(5) - 1) / 2


def short(text: object, letters: int = LINE_LETTERS) -> str:
    """Its beginning, with a mark where it goes on."""
    whole = text if isinstance(text, str) else str(text)
    cut = shorten(whole, letters)
    return cut if cut.isascii() else cut.encode(errors="replace").decode()


def short_name(text: object) -> str:
    """Return the name of a topic, a node or a file."""
    return short(text, NAME_LETTERS)


def finite(value: float) -> float:
    """A number that can be drawn and written as JSON; what is none is 0."""
    return max(-LARGEST, min(LARGEST, value)) if value == value else 0.0  # noqa: PLR0124 - NaN is not itself


def is_drawn(name: str) -> bool:
    """Return whether a node or a topic is none of the grader's own."""
    return name not in {"", BARE_NAME} and not name.startswith(f"{BARE_NAME}/") and not is_grader_node(name)


def second(run: Run, time_ns: int) -> float:
    """Since the run began."""
    return round((time_ns - run.start_ns) / 1e9, 6)


def thin_out(indices: Sequence[int], count: int) -> Iterable[int]:
    """About `count` of them, one from each of as many parts, at another place in each: so that no rhythm of theirs
    meets one of the parts'."""
    if len(indices) <= count:
        return indices
    size = len(indices) / max(1, count)
    return (indices[int((part + part * SPREAD % 1) * size)] for part in range(count))
