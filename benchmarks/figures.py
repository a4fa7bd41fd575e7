"""What a benchmark found: tables for the README, and what was not right."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from markupsafe import Markup

from grader.report.html.svg import Frame, drawing, element, path, text

CHART = (640.0, 300.0)
ROOM = 1.6
"""The largest value of an axis is so many times the largest that is drawn: names stand at the ends of lines."""
COLOURS = ("#0b57d0", "#b3261e", "#146c2e")
DASHES = ("none", "7 3", "2 3")
LOOK = """
text { font: 12px sans-serif; fill: #444 } .grid { stroke: #ddd } .axis { stroke: #888 } .label { fill: #444 }
"""


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
    """`runs` says how often what was run, `faults` what came out wrong: being slow is none. `pictures` are SVG, by
    their file names in this folder."""

    runs: str
    tables: tuple[str, ...]
    faults: tuple[str, ...] = ()
    remarks: tuple[str, ...] = field(default=())
    pictures: Mapping[str, str] = field(default_factory=dict)


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


def chart(
    name: str,
    title: str,
    labels: tuple[str, str],
    lines: Mapping[str, Sequence[tuple[float, float]]],
    *,
    log: tuple[bool, bool] = (False, False),
) -> str:
    """Return a drawing of lines, each with its name at its end. `labels` and `log` are of the two axes."""
    xs, ys = zip(*(point for points in lines.values() for point in points), strict=True)
    frame = Frame(
        size=CHART,
        xs=(min(xs), max(xs) * (ROOM**3 if log[0] else 1.2)),
        ys=(min(ys) if log[1] else 0.0, max(ys) * ROOM),
        log_x=log[0],
        log_y=log[1],
    )
    parts = [element("style", Markup(LOOK)), element("rect", width="100%", height="100%", fill="white")]  # noqa: S704 - ours
    parts += frame.axes(*labels)
    for (line, points), colour, dash in zip(lines.items(), COLOURS, DASHES, strict=False):
        drawn = frame.at(points)
        parts.append(
            element("path", d=path(drawn), fill="none", stroke=colour, stroke_width=2, stroke_dasharray=dash)
        )
        parts += [element("circle", cx=x, cy=y, r=3, fill=colour) for x, y in drawn]
        parts.append(text(drawn[-1][0] + 6, drawn[-1][1] - 6, line))
    words = "; ".join(
        f"{line}: " + ", ".join(f"{y:.0f} at {x:g}" for x, y in points) for line, points in lines.items()
    )
    whole = drawing(name, CHART, title, words, *parts)
    return str(whole).replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)


def share(part: int, whole: int) -> str:
    return f"{part} of {whole} ({100 * part / whole:.1f} %)"


def _three(row: Row) -> list[str]:
    values = [statistics.median(row.values), min(row.values), max(row.values)]
    return [f"{value:.{row.digits}f}" for value in values]
