"""A counter's values over time: a sawtooth, its wraps marked and its wrong steps circled; a long one zoomed, too."""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup

from grader.model.figure import CounterFigure
from grader.report.html.plots.axes import TOP, Frame
from grader.report.html.svg import dots, drawing, element, path, text
from grader.wording import number

WHOLE = (760.0, 240.0)
CLOSE = (760.0, 220.0)
MANY = 40
AROUND = 6
LABELS_MAX = 12
TEXTS_MAX = 3
FAR = 10**15
"""Larger values are drawn at the edge: the frame has no more digits."""


def counter_plots(figure: CounterFigure, name: str) -> list[Markup]:
    """The whole of it, and where it is long the surroundings of the first wrong step, or of the first wrap."""
    count = len(figure.values)
    if count < 2:
        return []
    drawn = [_plot(figure, name, range(count), WHOLE, f"{figure.topic} over time")]
    around = (*figure.wrong[:1], *figure.wraps[:1])
    if count > MANY and around:
        first = max(0, around[0] - AROUND)
        near = range(first, min(count, around[0] + AROUND + 1))
        what = "wrong step" if figure.wrong else "wrap"
        drawn.append(_plot(figure, f"{name}-close", near, CLOSE, f"{figure.topic} around the first {what}"))
    return drawn


def counter_words(figure: CounterFigure) -> str:
    """What the plot shows, in words."""
    if not figure.values:
        return f"No number was seen on {figure.topic}."
    low, high = min(figure.values), max(figure.values)
    words = f"{figure.topic}: values from {number(low)} to {number(high)}, the first is {number(figure.values[0])}. "
    words += f"It {_times(len(figure.wraps))} as it should"
    shown = ", ".join(_step(figure, i) for i in figure.wraps[:TEXTS_MAX] if i)
    words += f" ({shown}{', …' if len(figure.wraps) > TEXTS_MAX else ''})" if shown else ""
    wrong = len(figure.wrong) + figure.more_wrong
    return words + (
        f"; {wrong} {'step is' if wrong == 1 else 'steps are'} wrong." if wrong else "; no step is wrong."
    )


def wrong_steps(figure: CounterFigure) -> Iterator[str]:
    """`1, at 12.8 s: …`, as the circles are numbered; the first few."""
    texts = (*figure.texts, *[""] * len(figure.wrong))
    for index, (i, said) in enumerate(zip(figure.wrong[:LABELS_MAX], texts, strict=False), start=1):
        yield f"{index}, at {number(figure.times_s[i], 2)} s: {said or _step(figure, i)}"
    more = len(figure.wrong) - LABELS_MAX
    if more > 0 or figure.more_wrong:
        yield f"… and {max(more, 0) + figure.more_wrong} more"


def _times(count: int) -> str:
    return {0: "never wraps", 1: "wraps once", 2: "wraps twice"}.get(count, f"wraps {count} times")


def _step(figure: CounterFigure, i: int) -> str:
    value = number(figure.values[i])
    return f"{number(figure.values[i - 1])} → {value}" if i else f"{value} comes first"


def _plot(figure: CounterFigure, name: str, shown: range, size: tuple[float, float], title: str) -> Markup:
    values = [float(max(-FAR, min(FAR, figure.values[i]))) for i in shown]
    times = [figure.times_s[i] for i in shown]
    low, high = min(values), max(values)
    if size == WHOLE:
        low, high = min(low, 0.0), max(high, 1.0)
    pad = (high - low) * 0.14 or 1.0
    frame = Frame(
        width=size[0],
        height=size[1],
        x_low=times[0],
        x_high=times[-1],
        y_low=low - (pad if low != 0 else 0),
        y_high=high + pad,
    )
    points = [(frame.x(t), frame.y(v)) for t, v in zip(times, values, strict=True)]
    at = dict(zip(shown, points, strict=True))
    few = len(points) <= MANY
    named = len(points) <= 2 * AROUND + 1
    children = frame.axes("seconds since the run began", "value")
    children += _wraps(figure, frame, at)
    children.append(element("path", d="".join(map(path, _whole(figure, at))), class_="line"))
    children.append(element("path", d=dots(points), class_="dots" if few else "dots small"))
    if named:
        children += [
            text(x, y - 9, number(figure.values[i]), text_anchor="middle")
            for i, (x, y) in at.items()
            if i not in figure.wrong
        ]
    children += _wrong(figure, frame, at)
    return drawing(name, size, title, counter_words(figure), *children)


def _whole(figure: CounterFigure, at: dict[int, tuple[float, float]]) -> Iterator[list[tuple[float, float]]]:
    """The points in pieces, broken where values between them are left out."""
    numbers = figure.numbers or range(len(figure.values))
    piece: list[tuple[float, float]] = []
    for i, point in at.items():
        if piece and numbers[i] != numbers[i - 1] + 1:
            yield piece
            piece = []
        piece.append(point)
    yield piece


def _wraps(figure: CounterFigure, frame: Frame, at: dict[int, tuple[float, float]]) -> Iterator[Markup]:
    for i in figure.wraps:
        if i not in at:
            continue
        x, y = at[i]
        yield element("line", x1=x, x2=x, y1=TOP, y2=frame.bottom, class_="wrap")
        yield element("path", d=f"M{x:.1f} {y - 6:.1f}l5 6l-5 6l-5 -6z", class_="wrap-mark")
        if len(figure.wraps) <= LABELS_MAX // 2 and i not in figure.wrong:
            end = "end" if x > frame.right - 90 else "start"
            yield text(x + (-5 if end == "end" else 5), TOP - 7, f"wrap {_step(figure, i)}", text_anchor=end)


def _wrong(figure: CounterFigure, frame: Frame, at: dict[int, tuple[float, float]]) -> Iterator[Markup]:
    for index, i in enumerate(figure.wrong[:LABELS_MAX], start=1):
        if i not in at:
            continue
        x, y = at[i]
        yield element("circle", cx=x, cy=y, r=10, class_="wrong")
        turns = i == 0 or abs(figure.values[i] - figure.values[i - 1]) != 1
        words = f"{index}: {_step(figure, i)}" if turns and len(figure.wrong) <= TEXTS_MAX else str(index)
        end = "end" if x > frame.right - 110 else "start"
        above = y - 24 if y - 24 > TOP else y + 28
        yield text(x + (-8 if end == "end" else 8), above, words, class_="alarm", text_anchor=end)
