"""Plots of what a check measured, drawn as SVG: counter, path and rate; `…_words` say the same in a sentence."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence

from markupsafe import Markup

from grader.model.figure import CounterFigure, PathFigure, PlaceFigure, RateFigure
from grader.report.html import svg
from grader.wording import hertz, number, plural

WHOLE = (760.0, 240.0)
CLOSE = (460.0, 230.0)
MANY = 40
AROUND = 6
LABELS_MAX = 12
TEXTS_MAX = 3
DWARFS = 10
TINY_S = 1e-6
FAR = 10**15
"""Larger values are drawn at the edge: the frame has no more digits."""


def counter_plots(figure: CounterFigure, name: str) -> list[Markup]:
    """Return the surroundings of the first wrong step, or of the first wrap, of a long one; then the whole of it."""
    count = len(figure.values)
    if count < 2:
        return []
    drawn = [_plot(figure, name, range(count), WHOLE, f"{figure.topic} over time")]
    around = (*figure.wrong[:1], *figure.wraps[:1])
    if count > MANY and around:
        first = max(0, around[0] - AROUND)
        near = range(first, min(count, around[0] + AROUND + 1))
        what = "wrong step" if figure.wrong else "wrap"
        drawn.insert(
            0, _plot(figure, f"{name}-close", near, CLOSE, f"{figure.topic} around the first {what}")
        )
    return drawn


def counter_words(figure: CounterFigure) -> str:
    """Return what the plot shows, in words."""
    if not figure.values:
        return f"No number was seen on {figure.topic}."
    low, high = min(figure.values), max(figure.values)
    words = f"{figure.topic}: values from {number(low)} to {number(high)}, the first is {number(figure.values[0])}. "
    words += f"It {_times(len(figure.wraps))} correctly"
    shown = ", ".join(_step(figure, i) for i in figure.wraps[:TEXTS_MAX] if i)
    words += f" ({shown}{', …' if len(figure.wraps) > TEXTS_MAX else ''})" if shown else ""
    wrong = len(figure.wrong) + figure.more_wrong
    return words + (
        f"; {wrong} {'step is' if wrong == 1 else 'steps are'} wrong." if wrong else "; no step is wrong."
    )


def wrong_steps(figure: CounterFigure) -> Iterator[str]:
    """Yield `#1, at 12.8 s: …`, as the circles are numbered; the first few."""
    texts = (*figure.texts, *[""] * len(figure.wrong))
    for index, (i, said) in enumerate(zip(figure.wrong[:LABELS_MAX], texts, strict=False), start=1):
        yield f"#{index}, at {number(figure.times_s[i], 2)} s: {said or _step(figure, i)}"
    more = len(figure.wrong) - LABELS_MAX
    if more > 0 or figure.more_wrong:
        yield f"… and {max(more, 0) + figure.more_wrong} more"


def _times(count: int) -> str:
    return {0: "never wraps", 1: "wraps once", 2: "wraps twice"}.get(count, f"wraps {count} times")


def _step(figure: CounterFigure, i: int) -> str:
    value = number(figure.values[i])
    return f"{number(figure.values[i - 1])} → {value}" if i else f"{value} comes first"


def _plot(figure: CounterFigure, name: str, shown: range, size: svg.Point, title: str) -> Markup:
    values = [float(max(-FAR, min(FAR, figure.values[i]))) for i in shown]
    times = [figure.times_s[i] for i in shown]
    low, high = min(values), max(values)
    # the whole is seen from 0, so that its slope is not taken for more than it is
    if size == WHOLE:
        low, high = min(low, 0.0), max(high, 1.0)
    pad = (high - low) * 0.14 or 1.0
    died = _visible_ends(figure.died, times[0], times[-1])
    frame = svg.Frame(
        size=size,
        xs=(times[0], max(times[-1], *(at for at, _ in died), times[0] + TINY_S)),
        ys=(low - (pad if low != 0 else 0), high + pad),
        log_y=_has_dwarfed(values),
    )
    points = frame.at(zip(times, values, strict=True))
    at = dict(zip(shown, points, strict=True))
    few = len(points) <= MANY
    named = len(points) <= 2 * AROUND + 1
    fast = f"seconds of ROS's clock, {number(figure.faster)} times as fast as real time"
    children = frame.axes(fast if figure.faster != 1 else "seconds since the run began", "value")
    children += _wraps(figure, frame, at)
    children += _deaths(died, frame)
    children.append(svg.element("path", d="".join(map(svg.path, _whole(figure, at))), class_="line"))
    if named:
        children += [
            svg.text(x, y - 9, number(figure.values[i]), text_anchor="middle")
            for i, (x, y) in at.items()
            if i not in figure.wrong
        ]
    children.append(svg.element("path", d=svg.dots(points), class_="dots" if few else "dots small"))
    children += _wrong(figure, frame, at)
    return svg.drawing(name, size, title, counter_words(figure), *children)


def _has_dwarfed(values: Sequence[float]) -> bool:
    """Return whether few of the values leave no room to the others on a linear axis."""
    sizes = sorted(map(abs, values))
    return sizes[-1] > DWARFS * max(sizes[int(0.9 * (len(sizes) - 1))], 1.0)


def _visible_ends(died: Sequence[tuple[float, str]], from_s: float, to_s: float) -> list[tuple[float, str]]:
    """Return those ends that lie in a plot, or not far behind what it shows."""
    beyond = to_s + max(0.5 * (to_s - from_s), 1.0)
    return [(at, words) for at, words in died if from_s <= at <= beyond][:1]


def _deaths(died: Sequence[tuple[float, str]], frame: svg.Frame) -> Iterator[Markup]:
    """Yield where a process ended by itself: nothing comes after that."""
    for at, words in died:
        x = frame.x(at)
        yield svg.element("line", x1=x, x2=x, y1=svg.TOP, y2=frame.bottom, class_="died")
        yield _beside(x, frame.bottom - 8, words, 6, most=(svg.LEFT + frame.right) / 2, class_="alarm")


def _beside(x: float, y: float, words: str, gap: float, *, most: float, class_: str = "label") -> Markup:
    """Return words beside a place: to its right, or to its left where it lies right of `most`."""
    if x > most:
        return svg.text(x - gap, y, words, class_, text_anchor="end")
    return svg.text(x + gap, y, words, class_, text_anchor="start")


def _whole(figure: CounterFigure, at: dict[int, svg.Point]) -> Iterator[list[svg.Point]]:
    """Yield the points in pieces, broken where values between them are left out."""
    numbers = figure.numbers or range(len(figure.values))
    piece: list[svg.Point] = []
    for i, point in at.items():
        if piece and numbers[i] != numbers[i - 1] + 1:
            yield piece
            piece = []
        piece.append(point)
    yield piece


def _wraps(figure: CounterFigure, frame: svg.Frame, at: dict[int, svg.Point]) -> Iterator[Markup]:
    for i in figure.wraps:
        if i not in at:
            continue
        x, y = at[i]
        yield svg.element("line", x1=x, x2=x, y1=svg.TOP, y2=frame.bottom, class_="wrap")
        yield svg.element("path", d=f"M{x:.1f} {y - 6:.1f}l5 6l-5 6l-5 -6z", class_="wrap-mark")
        if len(figure.wraps) <= LABELS_MAX // 2 and i not in figure.wrong:
            yield _beside(x, svg.TOP - 7, f"wrap {_step(figure, i)}", 5, most=frame.right - 90)


def _wrong(figure: CounterFigure, frame: svg.Frame, at: dict[int, svg.Point]) -> Iterator[Markup]:
    for index, i in enumerate(figure.wrong[:LABELS_MAX], start=1):
        if i not in at:
            continue
        x, y = at[i]
        yield svg.element("circle", cx=x, cy=y, r=10, class_="wrong")
        turns = i == 0 or abs(figure.values[i] - figure.values[i - 1]) != 1
        words = f"#{index}: {_step(figure, i)}" if turns and len(figure.wrong) <= TEXTS_MAX else f"#{index}"
        above = y - 24 if y - 24 > svg.TOP else y + 28
        yield _beside(x, above, words, 8, most=frame.right - 110, class_="alarm")


SIDE = 340.0
WIDEST = 2.0
CORNER_LABELS_MAX = 20


def path_plot(figure: PathFigure, name: str) -> Markup | None:
    """Return the path from above, as wide as it is high for the same metres; None for a robot that stood still."""
    if len(figure.points) < 2 and not figure.corners:
        return None
    frame, scale = _frame((*figure.points, *figure.corners), figure.tolerance_m)
    corners = frame.at(figure.corners)
    children = frame.axes("metres", "metres")
    if len(corners) > 1:
        room = max(2 * figure.tolerance_m * scale, 2.0)
        children.append(svg.element("path", d=svg.path(corners), class_="room", stroke_width=room))
        children.append(svg.element("path", d=svg.path(corners), class_="way"))
    taken = frame.at(figure.points)
    children.append(svg.element("path", d=svg.path(taken), class_="line strong-line"))
    children += _corners(figure, corners)
    children += _mark_point(figure.strayed, taken, "leaves it here")
    return svg.drawing(
        name, frame.size, f"The path of {figure.topic}, seen from above", path_words(figure), *children
    )


def path_words(figure: PathFigure) -> str:
    """Return what the plot shows, in words."""
    words = f"{figure.topic} passed {figure.reached} of {plural(len(figure.corners), 'point')} in order; "
    words += f"{number(figure.tolerance_m)} m off the path is allowed"
    if figure.strayed is None:
        return f"{words} and it stayed within that."
    x, y = figure.points[figure.strayed]
    return f"{words}. It leaves that for the first time at x {number(x, 2)}, y {number(y, 2)}."


def place_plot(figure: PlaceFigure, name: str) -> Markup:
    """Return the path from above, with walls, the border of the region and the goal."""
    goal = [figure.goal] if figure.goal else []
    around = [spot for line in figure.walls for spot in line]
    frame, scale = _frame((*figure.points, *figure.area, *around, *goal), figure.tolerance_m)
    taken = frame.at(figure.points)
    children = frame.axes("metres", "metres")
    if figure.area:
        children.append(
            svg.element("path", d=svg.path(frame.at((*figure.area, figure.area[0]))), class_="way")
        )
    for x, y in frame.at(goal):
        children.append(
            svg.element("circle", cx=x, cy=y, r=max(figure.tolerance_m * scale, 4), class_="goal")
        )
    lines = "".join((svg.path if len(line) > 1 else svg.dots)(frame.at(line)) for line in figure.walls)
    if lines:
        children.append(svg.element("path", d=lines, class_="wall"))
    children.append(svg.element("path", d=svg.path(taken), class_="line strong-line"))
    children.append(svg.element("circle", cx=taken[0][0], cy=taken[0][1], r=4, class_="corner"))
    children += _mark_point(figure.wrong, taken, "here")
    title = f"Where the robot was, seen from above: {figure.topic}"
    return svg.drawing(name, frame.size, title, figure.says, *children)


def _frame(spots: Sequence[svg.Point], room: float) -> tuple[svg.Frame, float]:
    """Return the frame, and how many pixels a metre has in it."""
    x_low, x_high = _edges([x for x, _ in spots], room)
    y_low, y_high = _edges([y for _, y in spots], room)
    wide, high = x_high - x_low, y_high - y_low
    scale = SIDE / max(high, wide / WIDEST)
    # A path along a wall is nearly a line: its plot is still half as wide, and a quarter as high, as a square one.
    size = (
        svg.LEFT + svg.RIGHT + max(wide * scale, SIDE / 2),
        svg.TOP + svg.BOTTOM + max(high * scale, SIDE / 4),
    )
    xs, ys = (x_low, x_low + max(wide, SIDE / 2 / scale)), (y_low, y_low + max(high, SIDE / 4 / scale))
    return svg.Frame(size=size, xs=xs, ys=ys), scale


def _edges(values: list[float], room: float) -> svg.Point:
    low, high = min(values), max(values)
    pad = max(room, 0.08 * (high - low), 0.05)
    return low - pad, high + pad


def _corners(figure: PathFigure, corners: list[svg.Point]) -> Iterator[Markup]:
    for i, (x, y) in enumerate(corners):
        passed = i < figure.reached
        yield svg.element("circle", cx=x, cy=y, r=5, class_="corner passed" if passed else "corner")
        if i < CORNER_LABELS_MAX and (x, y) not in corners[:i]:
            yield svg.text(x + 8, y - 8, "start" if i == 0 and not figure.first else f"{i + figure.first}")


def _mark_point(index: int | None, taken: list[svg.Point], words: str) -> Iterator[Markup]:
    if index is None:
        return
    x, y = taken[index]
    yield svg.element("circle", cx=x, cy=y, r=10, class_="wrong")
    yield _beside(x, y + 4, words, 13, most=max(spot[0] for spot in taken) - 90, class_="alarm")


OVER_TIME = (460.0, 230.0)
HISTOGRAM = (330.0, 230.0)
BINS = 30
TOO_FAR = 5.0
"""Where a value is so many times the bound, the axis is logarithmic."""
FASTEST_S = 1e-5
"""A shorter gap is drawn as one of this length."""


def rate_plots(figure: RateFigure, name: str) -> list[Markup]:
    """Return how fast they came and how long the gaps are, or the messages of a flood; nothing without a gap."""
    if not figure.gaps_s:
        return []
    if len(figure.counts) > 1:
        return [_flood(figure, f"{name}-rate")]
    return [_over_time(figure, f"{name}-rate"), _histogram(figure, f"{name}-gaps")]


def rate_words(figure: RateFigure) -> str:
    """Return what the plots show, in words."""
    if not figure.gaps_s:
        return f"Too few messages on {figure.topic} to draw a rate."
    if len(figure.counts) > 1:
        least, most = (f"{count / figure.slice_s:,.0f}" for count in (min(figure.counts), max(figure.counts)))
        words = f"{figure.topic}: {least} to {most} messages a second came, counted every {number(figure.slice_s)} s"
        return f"{words}; {_allowed_text(figure)} (the green line) passes."
    gaps = figure.gaps_s
    mean = f"{hertz(figure.mean_hz)} on average" if figure.mean_hz is not None else "no mean"
    words = (
        f"{figure.topic}: {mean}; {_allowed_text(figure)} (the green band) passes. Each dot is a message. "
    )
    words += f"The gaps between messages are {_ms(min(gaps))} to {_ms(max(gaps))} ms long"
    words += _outside(figure)
    if figure.ends_silent:
        words += "; the last one is the silence at the end"
    if figure.late:
        times = plural(len(figure.late), "time")
        words += f". The grading machine itself was late {times} (hatched), which is allowed for"
    return words + "."


def _allowed_text(figure: RateFigure) -> str:
    return f"{number(figure.low_hz, 2)} to {number(figure.high_hz, 2)} Hz"


def _outside(figure: RateFigure) -> str:
    low, high = figure.gap_low_s, figure.gap_high_s
    if low is None or high is None:
        return ""
    outside = sum(not low <= gap <= high for gap in figure.gaps_s)
    lie = "lies" if outside == 1 else "lie"
    return f"; {outside or 'none'} of {len(figure.gaps_s)} {lie} outside {_ms(low)} to {_ms(high)} ms"


def _ms(seconds: float) -> str:
    return number(seconds * 1000, 1)


def _over_time(figure: RateFigure, name: str) -> Markup:
    rates = [1 / gap if gap > FASTEST_S else 1 / FASTEST_S for gap in figure.gaps_s]
    begin = max(0.0, figure.times_s[0] - figure.gaps_s[0])
    last = max(*figure.times_s, begin + TINY_S)
    died = _visible_ends(figure.died, begin, last)
    highest = max(figure.high_hz, figure.mean_hz or 0.0)
    log = max(rates) > TOO_FAR * highest
    end = max(last, *(at for at, _ in died), last)
    top = (1.5 if log else 1.2) * max(highest, *rates)
    frame = svg.Frame(size=OVER_TIME, xs=(begin, end), ys=(0, top), log_y=log)
    # SVG draws in this order: what passes, and when the machine was late, lies below axes and dots
    children = [_hatching(name), frame.box(frame.xs, (figure.low_hz, figure.high_hz), class_="band")]
    children += [
        frame.box(stretch, frame.ys, fill=f"url(#{name}-late)", class_="late")
        for stretch in figure.late
        if stretch[1] > begin and stretch[0] < end
    ]
    children += frame.axes("seconds since the run began", "Hz")
    points = frame.at(zip(figure.times_s, rates, strict=True))
    children.append(svg.element("path", d=svg.dots(points), class_="dots"))
    children.append(
        svg.text(svg.LEFT + 5, frame.y(figure.high_hz) - 5, f"{_allowed_text(figure)} passes", class_="good")
    )
    children += _mean(frame, figure.mean_hz)
    children += _deaths(died, frame)
    return svg.drawing(name, OVER_TIME, f"Rate of {figure.topic} over time", rate_words(figure), *children)


def _flood(figure: RateFigure, name: str) -> Markup:
    """Return a column for each tenth of a second, on a logarithmic axis: else the few that pass would not show."""
    hz = [count / figure.slice_s for count in figure.counts]
    begin = max(0.0, figure.times_s[0] - figure.gaps_s[0])
    end = begin + figure.slice_s * len(hz)
    frame = svg.Frame(size=OVER_TIME, xs=(begin, end), ys=(0, 4 * max(hz)), log_y=True)
    children = frame.axes("seconds since the run began", "messages a second")
    children += [
        frame.box(
            (begin + i * figure.slice_s, begin + (i + 0.85) * figure.slice_s), (0, one), class_="column"
        )
        for i, one in enumerate(hz)
        if one
    ]
    y = (frame.y(figure.low_hz) + frame.y(figure.high_hz)) / 2
    children += [
        svg.element("line", x1=svg.LEFT, x2=frame.right, y1=y, y2=y, class_=look)
        for look in ("halo", "passes")
    ]
    above = frame.y(max(hz)) - 8
    children.append(svg.text(svg.LEFT + 5, above, f"green: {_allowed_text(figure)} passes", class_="good"))
    mean = f"mean {figure.mean_hz:,.0f} Hz" if figure.mean_hz else ""
    children.append(svg.text(frame.right - 4, above, mean, class_="strong", text_anchor="end"))
    return svg.drawing(name, OVER_TIME, f"Rate of {figure.topic} over time", rate_words(figure), *children)


def _mean(frame: svg.Frame, mean_hz: float | None) -> list[Markup]:
    if mean_hz is None:
        return []
    y = frame.y(mean_hz)
    return [
        svg.element("line", x1=svg.LEFT, x2=frame.right, y1=y, y2=y, class_="mean"),
        svg.text(
            frame.right - 4,
            y - 7 if y > 2 * svg.TOP else y + 17,
            f"mean {hertz(mean_hz)}",
            class_="strong",
            text_anchor="end",
        ),
    ]


def _hatching(name: str) -> Markup:
    line = svg.element("path", d="M0 8L8 0", class_="hatch")
    return svg.element(
        "defs",
        svg.element("pattern", line, id=f"{name}-late", width=8, height=8, patternUnits="userSpaceOnUse"),
    )


def _histogram(figure: RateFigure, name: str) -> Markup:
    bound = figure.gap_high_s or 2 / figure.low_hz
    log = max(figure.gaps_s) > TOO_FAR * bound
    longest_ms = 1.1e3 * max(1.2 * bound, *figure.gaps_s)  # with a tenth of room behind it
    shares = [i / BINS for i in range(BINS + 1)]
    edges = [svg.from_log(s * svg.to_log(longest_ms)) if log else s * longest_ms for s in shares]
    counts = [0] * BINS
    for gap in figure.gaps_s:
        counts[min(bisect_right(edges, gap * 1000) - 1, BINS - 1)] += 1
    frame = svg.Frame(size=HISTOGRAM, xs=(0, longest_ms), ys=(0, 1.15 * max(counts)), log_x=log)
    children = _gap_bounds(figure, frame)
    children += frame.axes("milliseconds from message to message", "messages")
    children += [
        frame.box((edges[i], edges[i + 1]), (0, count), class_="column")
        for i, count in enumerate(counts)
        if count
    ]
    words = f"{len(figure.gaps_s)} gaps. {rate_words(figure)}"
    return svg.drawing(name, HISTOGRAM, f"Gaps between messages on {figure.topic}", words, *children)


def _gap_bounds(figure: RateFigure, frame: svg.Frame) -> list[Markup]:
    if figure.gap_low_s is None or figure.gap_high_s is None:
        return []
    low, high = figure.gap_low_s * 1000, figure.gap_high_s * 1000
    edges = (frame.x(low), frame.x(high))
    return [
        frame.box((low, high), frame.ys, class_="band"),
        *(svg.element("line", x1=x, x2=x, y1=svg.TOP, y2=frame.bottom, class_="bound") for x in edges),
    ]
