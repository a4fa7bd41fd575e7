"""The way that a robot took, over the way that it had to take with as much room as it was given."""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup

from grader.model.figure import PathFigure
from grader.report.html.plots.axes import BOTTOM, LEFT, RIGHT, TOP, Frame
from grader.report.html.svg import drawing, element, path, text
from grader.wording import number

SIDE = 340.0
WIDEST = 2.0
LABELS_MAX = 20


def path_plot(figure: PathFigure, name: str) -> Markup | None:
    """Seen from above, as wide as it is high for the same metres; None for a robot that stood still."""
    if len(figure.points) < 2 and not figure.corners:
        return None
    frame, scale = _frame(figure)
    corners = [(frame.x(x), frame.y(y)) for x, y in figure.corners]
    children = frame.axes("metres", "metres")
    if len(corners) > 1:
        room = max(2 * figure.tolerance_m * scale, 2.0)
        children.append(element("path", d=path(corners), class_="room", stroke_width=room))
        children.append(element("path", d=path(corners), class_="way"))
    taken = [(frame.x(x), frame.y(y)) for x, y in figure.points]
    children.append(element("path", d=path(taken), class_="line strong-line"))
    children += _corners(figure, corners)
    children += _strayed(figure, taken)
    size = (frame.width, frame.height)
    return drawing(name, size, f"The way of {figure.topic}, seen from above", path_words(figure), *children)


def path_words(figure: PathFigure) -> str:
    """What the plot shows, in words."""
    words = f"{figure.topic} passed {figure.reached} of {len(figure.corners)} corners in their order; "
    words += f"{number(figure.tolerance_m)} m off the way are allowed"
    if figure.strayed is None:
        return f"{words}, and it kept to that."
    x, y = figure.points[figure.strayed]
    return f"{words}. It is too far off for the first time at x {number(x, 2)}, y {number(y, 2)}."


def _frame(figure: PathFigure) -> tuple[Frame, float]:
    """The frame, and how many pixels a metre has in it."""
    spots = (*figure.points, *figure.corners)
    x_low, x_high = _edges([x for x, _ in spots], figure.tolerance_m)
    y_low, y_high = _edges([y for _, y in spots], figure.tolerance_m)
    wide, high = x_high - x_low, y_high - y_low
    scale = SIDE / max(high, wide / WIDEST)
    frame = Frame(
        width=LEFT + RIGHT + max(wide * scale, SIDE / 2),
        height=TOP + BOTTOM + max(high * scale, SIDE / 4),
        x_low=x_low,
        x_high=x_low + max(wide, SIDE / 2 / scale),
        y_low=y_low,
        y_high=y_low + max(high, SIDE / 4 / scale),
    )
    return frame, scale


def _edges(values: list[float], room: float) -> tuple[float, float]:
    low, high = min(values), max(values)
    pad = max(room, 0.08 * (high - low), 0.05)
    return low - pad, high + pad


def _corners(figure: PathFigure, corners: list[tuple[float, float]]) -> Iterator[Markup]:
    for i, (x, y) in enumerate(corners):
        passed = i < figure.reached
        yield element("circle", cx=x, cy=y, r=5, class_="corner passed" if passed else "corner")
        if i < LABELS_MAX and (x, y) not in corners[:i]:
            yield text(x + 8, y - 8, "start" if i == 0 else f"{i}")


def _strayed(figure: PathFigure, taken: list[tuple[float, float]]) -> Iterator[Markup]:
    if figure.strayed is None:
        return
    x, y = taken[figure.strayed]
    yield element("circle", cx=x, cy=y, r=10, class_="wrong")
    right = max(spot[0] for spot in taken)
    end = "end" if x > right - 90 else "start"
    yield text(x + (-13 if end == "end" else 13), y + 4, "too far off", class_="alarm", text_anchor=end)
