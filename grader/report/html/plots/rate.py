"""A rate over time with the band in which its mean has to lie, and the histogram of the gaps."""

from __future__ import annotations

import math
from collections.abc import Sequence

from markupsafe import Markup

from grader.model.figure import RateFigure
from grader.report.html.plots.axes import TOP, Frame
from grader.report.html.svg import dots, drawing, element, text
from grader.wording import number, plural

OVER_TIME = (460.0, 230.0)
HISTOGRAM = (330.0, 230.0)
BINS = 30
TOO_FAR = 3.0
"""So many times the bound: what lies farther is drawn at the edge."""


def rate_plots(figure: RateFigure, name: str) -> list[Markup]:
    """Both plots; none where there is no gap."""
    if not figure.gaps_s:
        return []
    return [_over_time(figure, f"{name}-rate"), _histogram(figure, f"{name}-gaps")]


def rate_words(figure: RateFigure) -> str:
    """What the plots show, in words."""
    if not figure.gaps_s:
        return f"Too few messages on {figure.topic} to draw a rate."
    gaps = figure.gaps_s
    mean = f"{number(figure.mean_hz, 2)} Hz in the mean" if figure.mean_hz is not None else "no mean"
    words = f"{figure.topic}: {mean}; {_allowed(figure)} (the green band) passes. Each dot is a message. "
    words += f"The gaps between messages are {_ms(min(gaps))} to {_ms(max(gaps))} ms long"
    words += _outside(figure)
    if figure.ends_silent:
        words += "; the last one is the silence at the end"
    if figure.late:
        words += f". The grading machine itself was late {plural(len(figure.late), 'time')} (hatched)"
    return words + "."


def _allowed(figure: RateFigure) -> str:
    return f"{number(figure.low_hz, 2)} to {number(figure.high_hz, 2)} Hz"


def _outside(figure: RateFigure) -> str:
    low, high = figure.gap_low_s, figure.gap_high_s
    if low is None or high is None:
        return ""
    outside = sum(not low <= gap <= high for gap in figure.gaps_s)
    lie = "lies" if outside == 1 else "lie"
    return f"; {outside or 'none'} of {len(figure.gaps_s)} {lie} outside of {_ms(low)} to {_ms(high)} ms"


def _ms(seconds: float) -> str:
    return number(seconds * 1000, 1)


def _over_time(figure: RateFigure, name: str) -> Markup:
    rates = [1 / gap if gap > 0 else math.inf for gap in figure.gaps_s]
    frame = Frame(
        width=OVER_TIME[0],
        height=OVER_TIME[1],
        x_low=0,
        x_high=max(figure.times_s) or 1.0,
        y_low=0,
        y_high=_top(rates, figure),
    )
    across = (frame.x_low, frame.x_high)
    children = [_hatching(name)]
    children.append(frame.box(across, (figure.low_hz, figure.high_hz), class_="band"))
    children += [
        frame.box(stretch, (0, frame.y_high), fill=f"url(#{name}-late)", class_="late")
        for stretch in figure.late
    ]
    children += frame.axes("seconds since the run began", "Hz")
    points = [(frame.x(t), frame.y(r)) for t, r in zip(figure.times_s, rates, strict=True)]
    children.append(element("path", d=dots(points), class_="dots"))
    children.append(
        text(frame.x(0) + 5, frame.y(figure.high_hz) - 5, f"{_allowed(figure)} passes", class_="good")
    )
    children += _mean(frame, figure.mean_hz)
    beyond = sum(rate > frame.y_high for rate in rates)
    if beyond:
        children.append(text(frame.right, TOP - 9, f"{beyond} above the edge", text_anchor="end"))
    return drawing(name, OVER_TIME, f"Rate of {figure.topic} over time", rate_words(figure), *children)


def _top(rates: Sequence[float], figure: RateFigure) -> float:
    """The highest rate, but not where a few messages that came together would flatten all others."""
    most = TOO_FAR * max(figure.high_hz, figure.mean_hz or 0.0)
    return 1.2 * max(figure.high_hz, figure.mean_hz or 0.0, min(max(rates), most))


def _mean(frame: Frame, mean_hz: float | None) -> list[Markup]:
    if mean_hz is None:
        return []
    y = frame.y(mean_hz)
    return [
        element("line", x1=frame.x(frame.x_low), x2=frame.right, y1=y, y2=y, class_="mean"),
        text(
            frame.right - 4,
            y - 7 if y > 2 * TOP else y + 17,
            f"mean {number(mean_hz, 2)} Hz",
            class_="strong",
            text_anchor="end",
        ),
    ]


def _hatching(name: str) -> Markup:
    line = element("path", d="M0 8L8 0", class_="hatch")
    return element(
        "defs",
        element("pattern", line, id=f"{name}-late", width=8, height=8, patternUnits="userSpaceOnUse"),
    )


def _histogram(figure: RateFigure, name: str) -> Markup:
    longest = _longest(figure)
    counts = [0] * BINS
    for gap in figure.gaps_s:
        counts[min(int(gap / longest * BINS), BINS - 1)] += 1
    frame = Frame(
        width=HISTOGRAM[0],
        height=HISTOGRAM[1],
        x_low=0,
        x_high=longest * 1000,
        y_low=0,
        y_high=1.15 * max(counts),
    )
    width = frame.x_high / BINS
    children = _gap_bounds(figure, frame)
    children += frame.axes("milliseconds from message to message", "messages")
    children += [
        frame.box((i * width, (i + 1) * width), (0, plural), class_="column")
        for i, plural in enumerate(counts)
        if plural
    ]
    longer = sum(gap > longest for gap in figure.gaps_s)
    if longer:
        children.append(text(frame.right, TOP - 9, f"{longer} longer, in the last bar", text_anchor="end"))
    words = f"{len(figure.gaps_s)} gaps. {rate_words(figure)}"
    return drawing(name, HISTOGRAM, f"How long the gaps of {figure.topic} are", words, *children)


def _longest(figure: RateFigure) -> float:
    bound = figure.gap_high_s or 2 / figure.low_hz
    return 1.1 * max(1.2 * bound, min(max(figure.gaps_s), TOO_FAR * bound))


def _gap_bounds(figure: RateFigure, frame: Frame) -> list[Markup]:
    if figure.gap_low_s is None or figure.gap_high_s is None:
        return []
    low, high = figure.gap_low_s * 1000, figure.gap_high_s * 1000
    edges = (frame.x(low), frame.x(high))
    return [
        frame.box((low, high), (0, frame.y_high), class_="band"),
        *(element("line", x1=x, x2=x, y1=TOP, y2=frame.bottom, class_="bound") for x in edges),
    ]
