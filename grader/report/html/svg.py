"""SVG written as text: elements, whose attributes and texts are all escaped, and a frame with two axes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from markupsafe import Markup

from grader.report.text import html, line
from grader.wording import number

TEXT_CHARS = 80
Point = tuple[float, float]


def element(name: str, *children: Markup, **attributes: str | float) -> Markup:
    """Return `<name …>children</name>`. An attribute `class_` is `class`, `stroke_width` is `stroke-width`."""
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html(value) if isinstance(value, str) else short(value)}"'
        for key, value in attributes.items()
    )
    inside = "".join(children)
    return Markup(f"<{name}{given}>{inside}</{name}>" if inside else f"<{name}{given}/>")  # noqa: S704 - escaped


def text(x: float, y: float, words: str, class_: str = "label", **attributes: str | float) -> Markup:
    """Return words at a place; `text_anchor` says which end of them."""
    return element("text", escaped(words), x=x, y=y, class_=class_, **attributes)


def escaped(words: str) -> Markup:
    """Return one visible line, of the length that a plot has room for."""
    return Markup(html(line(words, TEXT_CHARS)))  # noqa: S704 - escaped


def path(points: Iterable[Point]) -> str:
    """Return a line through the points, for `d`."""
    return "M" + "L".join(f"{short(x)} {short(y)}" for x, y in points)


def dots(points: Iterable[Point]) -> str:
    """Return a dot at each point, for the `d` of a path with round ends."""
    return "".join(f"M{short(x)} {short(y)}h0" for x, y in points)


SHRINKS = 0.72
"""To such a part of its size a drawing shrinks where there is little room; its letters can still be read then."""


def drawing(
    name: str, size: tuple[float, float], title: str, words: str, *children: Markup, shrinks: float = SHRINKS
) -> Markup:
    """Return the whole `<svg>`: an image to those who cannot see it, with its title and what it shows in words.

    `name` is unique on the page. Where there is little room, it `shrinks` to such a part of its size.
    """
    width, height = size
    return element(
        "svg",
        element("title", escaped(title), id=f"{name}-title"),
        element("desc", Markup(html(line(words, 600))), id=f"{name}-desc"),  # noqa: S704 - escaped
        *children,
        viewBox=f"0 0 {short(width)} {short(height)}",
        width=width,
        height=height,
        style=f"min-width:{short(shrinks * width)}px",
        role="img",
        class_="plot",
        aria_labelledby=f"{name}-title {name}-desc",
    )


def short(value: float) -> str:
    """Return a coordinate: tenths of a pixel."""
    return number(value, 1)


LEFT, RIGHT, TOP, BOTTOM = 46.0, 14.0, 22.0, 40.0
TICKS = 5
TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class Frame:
    """`size` is the drawing's width and height in pixels, `xs` and `ys` are the lowest and highest values at its edges.

    An axis may be logarithmic, for values among which some dwarf the others: see `to_log`.
    """

    size: Point
    xs: Point
    ys: Point
    log_x: bool = False
    log_y: bool = False

    @property
    def right(self) -> float:
        return self.size[0] - RIGHT

    @property
    def bottom(self) -> float:
        return self.size[1] - BOTTOM

    def x(self, value: float) -> float:
        """Return the pixel of a value; one outside of the frame lies on its edge."""
        return LEFT + _share(value, self.xs, log=self.log_x) * (self.right - LEFT)

    def y(self, value: float) -> float:
        """Return the pixel as `x` does, from the bottom up."""
        return self.bottom - _share(value, self.ys, log=self.log_y) * (self.bottom - TOP)

    def at(self, points: Iterable[Point]) -> list[Point]:
        """Return the pixels of points."""
        return [(self.x(x), self.y(y)) for x, y in points]

    def box(self, xs: Point, ys: Point, **attributes: str | float) -> Markup:
        """Return a rectangle between values, at least a pixel wide and high."""
        (left, bottom), (right, top) = self.at(zip(xs, ys, strict=True))
        wide, high = max(right - left, 1.0), max(bottom - top, 1.0)
        return element("rect", x=left, y=top, width=wide, height=high, **attributes)

    def axes(self, x_label: str, y_label: str) -> list[Markup]:
        """Return lines across at the ticks, their numbers, and what they are numbers of."""
        parts = []
        for value in (log_ticks if self.log_y else ticks)(*self.ys):
            y = self.y(value)
            parts.append(element("line", x1=LEFT, x2=self.right, y1=y, y2=y, class_="grid"))
            parts.append(text(LEFT - 6, y + 4, number(value), text_anchor="end"))
        for value in (log_ticks if self.log_x else ticks)(*self.xs):
            x = self.x(value)
            parts.append(element("line", x1=x, x2=x, y1=self.bottom, y2=self.bottom + 4, class_="axis"))
            parts.append(text(x, self.bottom + 17, number(value), text_anchor="middle"))
        parts.append(element("line", x1=LEFT, x2=self.right, y1=self.bottom, y2=self.bottom, class_="axis"))
        x_label, y_label = (
            f"{label} (logarithmic)" if log else label
            for label, log in ((x_label, self.log_x), (y_label, self.log_y))
        )
        parts.append(text(self.right, self.size[1] - 6, x_label, text_anchor="end"))
        parts.append(text(2, 13, y_label))
        return parts


def to_log(value: float) -> float:
    """Return the logarithm of 1 more than the value's size, with its sign: values around 0 have a place too."""
    return math.copysign(math.log10(1 + abs(value)), value)


def from_log(value: float) -> float:
    """Return the value of which `to_log` is this."""
    return math.copysign(10 ** abs(value) - 1, value)


def _share(value: float, edges: Point, *, log: bool) -> float:
    value, low, high = map(to_log, (value, *edges)) if log else (value, *edges)
    return min(max((value - low) / ((high - low) or 1.0), 0.0), 1.0)


def log_ticks(low: float, high: float) -> list[float]:
    """Return powers of ten from `low` to `high`, at most about `TICKS`, 0 and their negatives."""
    most = max(abs(low), abs(high), 1.0)
    powers = range(int(math.log10(most)) + 1)
    sizes = [10.0**power for power in powers[:: len(powers) // TICKS + 1]]
    return [value for value in (*(-size for size in reversed(sizes)), 0.0, *sizes) if low <= value <= high]


def ticks(low: float, high: float) -> list[float]:
    """Return about `TICKS` round values from `low` to `high`: 0, 0.5, 1 …"""
    span = high - low
    if span < TINY or not math.isfinite(span):
        return []
    rough = span / TICKS
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * size for factor in (1, 2, 5, 10) if factor * size >= rough)
    # 1e-9: what is a multiple of the step may come out a little beside one
    first = math.ceil(low / step - 1e-9)
    return [i * step for i in range(first, math.floor(high / step + 1e-9) + 1)]
