"""How the points are spread."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, median

from markupsafe import Markup

from grader.report.html import svg
from grader.wording import number

BINS_MAX = 20
STEPS = (0.1, 0.2, 0.25, 0.5, 1, 2, 2.5, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000)
WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 520, 330, 8, 24, 20


@dataclass(frozen=True, kw_only=True)
class Bin:
    """`count` submissions with `low` to less than `high` points; the last bin has those with `high`, too."""

    low: float
    high: float
    count: int

    @property
    def words(self) -> str:
        return f"{number(self.low)} to {number(self.high)} points: {self.count}"


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Of all submissions that were judged."""

    count: int
    mean: float
    median: float
    best: float
    full: int
    none: int
    bins: tuple[Bin, ...]


def spread(points: Sequence[float], most: float) -> Spread | None:
    """None where nothing was judged."""
    if not points:
        return None
    return Spread(
        count=len(points),
        mean=fmean(points),
        median=median(points),
        best=max(points),
        full=sum(value >= most for value in points),
        none=sum(value <= 0 for value in points),
        bins=_bins(points, max(most, *points)),
    )


def _bins(points: Iterable[float], most: float) -> tuple[Bin, ...]:
    width = next((step for step in STEPS if step * BINS_MAX >= most), most / BINS_MAX) if most > 0 else 1.0
    last = max(1, math.ceil(most / width - 1e-9)) - 1
    counts = [0] * (last + 1)
    for value in points:
        counts[min(last, max(0, math.floor(value / width + 1e-9)))] += 1
    return tuple(
        Bin(low=place * width, high=min(most, (place + 1) * width) if most > 0 else width, count=count)
        for place, count in enumerate(counts)
    )


def histogram(found: Spread) -> Markup:
    """The bins as bars, each with its number above it and its points below."""
    bins = found.bins
    highest = max(one.count for one in bins)
    step = (WIDTH - 2 * LEFT) / len(bins)
    room = HEIGHT - BOTTOM - TOP
    bars = []
    for place, one in enumerate(bins):
        x, height = LEFT + place * step, room * one.count / highest
        bars.append(
            svg.element(
                "rect",
                svg.element("title", svg.escaped(one.words)),
                class_="pile",
                x=x + 1,
                y=TOP + room - height,
                width=max(1.0, step - 2),
                height=height,
            )
        )
        if one.count:
            middle = x + step / 2
            bars.append(svg.text(middle, TOP + room - height - 4, str(one.count), text_anchor="middle"))
    words = "; ".join(one.words for one in bins if one.count)
    title = f"Points of {found.count} submissions"
    return svg.drawing("histogram", (WIDTH, HEIGHT), title, words, *bars, *_scale(bins, step))


def _scale(bins: Sequence[Bin], step: float) -> list[Markup]:
    """The line below the bars, and where each second or fifth bar begins."""
    every = 1 if len(bins) <= 10 else 2
    y = HEIGHT - BOTTOM
    line = svg.element("path", d=f"M{LEFT} {y}H{WIDTH - LEFT}", class_="axis")
    ticks = [
        svg.text(
            LEFT + place * step, y + 16, number(bins[place].low), text_anchor="middle" if place else "start"
        )
        for place in range(0, len(bins), every)
    ]
    end = svg.text(WIDTH - LEFT, y + 16, number(bins[-1].high), text_anchor="end")
    return [line, *ticks, end]
