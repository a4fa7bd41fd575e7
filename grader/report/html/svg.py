"""Elements of SVG, written as text: every attribute and every text is escaped, numbers are short."""

from __future__ import annotations

from collections.abc import Iterable

from markupsafe import Markup

from grader.report.text import html, line
from grader.wording import number

TEXT_CHARS = 80


def element(name: str, *children: Markup, **attributes: str | float) -> Markup:
    """`<name …>children</name>`. An attribute `class_` is `class`, `stroke_width` is `stroke-width`."""
    given = "".join(f' {_name(key)}="{_value(value)}"' for key, value in attributes.items())
    inside = "".join(children)
    return Markup(f"<{name}{given}>{inside}</{name}>" if inside else f"<{name}{given}/>")  # noqa: S704 - escaped


def text(x: float, y: float, words: str, class_: str = "label", **attributes: str | float) -> Markup:
    """Words at a place; `text_anchor` says which end of them."""
    return element("text", escaped(words), x=x, y=y, class_=class_, **attributes)


def escaped(words: str) -> Markup:
    """One visible line, of the length that a plot has room for."""
    return Markup(html(line(words, TEXT_CHARS)))  # noqa: S704 - escaped


def path(points: Iterable[tuple[float, float]]) -> str:
    """A line through the points, for `d`."""
    return "M" + "L".join(f"{short(x)} {short(y)}" for x, y in points)


def dots(points: Iterable[tuple[float, float]]) -> str:
    """A dot at each point, for the `d` of a path with round ends."""
    return "".join(f"M{short(x)} {short(y)}h0" for x, y in points)


def drawing(name: str, size: tuple[float, float], title: str, words: str, *children: Markup) -> Markup:
    """The whole `<svg>`: an image to those who cannot see it, with its title and what it shows in words.

    `name` is unique on the page.
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
        role="img",
        class_="plot",
        aria_labelledby=f"{name}-title {name}-desc",
    )


def short(value: float) -> str:
    """A coordinate: tenths of a pixel."""
    return number(value, 1)


def _name(key: str) -> str:
    return key.rstrip("_").replace("_", "-")


def _value(value: str | float) -> str:
    return html(value) if isinstance(value, str) else short(value)
