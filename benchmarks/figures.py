"""What a benchmark found: tables for the README, and what was not right."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple


class NotMeasured(Exception):
    """What was to be measured did not run: the message says what happened instead."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command line asks for; None is the benchmark's own default."""

    times: int | None = None
    count: int | None = None
    jobs: int | None = None
    loops: tuple[int, ...] | None = None
    seconds: float | None = None
    keep: str | None = None
    against: str | None = None


@dataclass(frozen=True, kw_only=True)
class Found:
    """`runs` says how often what was run, `faults` what came out wrong: being slow is none."""

    runs: str
    tables: tuple[str, ...]
    faults: tuple[str, ...] = ()
    remarks: tuple[str, ...] = field(default=())


class Row(NamedTuple):
    """One figure, measured several times. `asked` is what the issue asks for."""

    what: str
    unit: str
    values: Sequence[float]
    asked: str = ""
    digits: int = 2


def spread(rows: Iterable[Row]) -> str:
    """Median, least and most of each."""
    rows = list(rows)
    asked = any(row.asked for row in rows)
    header = ["what", "unit", "median", "least", "most", *(["asked"] if asked else [])]
    return table(
        header, [[row.what, row.unit, *_three(row), *([row.asked] if asked else [])] for row in rows]
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def mid(values: Sequence[float], digits: int = 2) -> str:
    """The median, with least and most where there are several."""
    middle = f"{statistics.median(values):.{digits}f}"
    if len(values) == 1:
        return middle
    return f"{middle} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({100 * part / whole:.1f} %)"


def _three(row: Row) -> list[str]:
    values = [statistics.median(row.values), min(row.values), max(row.values)]
    return [f"{value:.{row.digits}f}" for value in values]
