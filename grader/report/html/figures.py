"""Figures made ready for the page: drawn as SVG, or as rows for a table, with the same said in words beside it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from markupsafe import Markup

from grader.model.figure import (
    CodeFigure,
    ConsoleFigure,
    ConsoleLine,
    CounterFigure,
    Figure,
    GraphFigure,
    Heard,
    HeardFigure,
    Lane,
    PathFigure,
    PlaceFigure,
    RateFigure,
    Stretch,
    TimelineFigure,
)
from grader.report.html.graph import graph_faults, graph_plot, graph_rows
from grader.report.html.plots import (
    counter_plots,
    counter_words,
    path_plot,
    path_words,
    place_plot,
    rate_plots,
    rate_words,
    wrong_steps,
)
from grader.report.html.svg import element, escaped, short, ticks
from grader.report.text import clip
from grader.wording import join_words, number, plural

CONSOLE_FIRST, CONSOLE_LAST = 35, 25
LINE_CHARS = 500
TITLE_CHARS = 200
SHOWN_TAB = "⇥   "
HEARD_MAX, HEARD_ALIKE_MAX = 60, 3
PHONE_PX = 330
LATE_S = 0.1
"""A listener prints within milliseconds: only a later line is worth a column."""
NEAR_LINES = 1
"""How far from a cited line those are that a narrow screen shows too."""
GRAPH_ROWS_MAX = 100


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """`name` is its id on the page, `points` how many points, rows or lines it has. The first of at most two `plots` is
    the more telling one; `second` says what the other shows. `same_as` is the id of an earlier figure that shows the
    same; then nothing else is drawn. `late` says whether some row was heard late. `left_out` says what is not shown,
    of a console after `gap_at` lines."""

    title: str
    name: str = ""
    kind: str = ""
    words: str = ""
    points: int = 0
    plots: Sequence[Markup] = ()
    second: str = ""
    rows: Sequence[object] = ()
    notes: Sequence[str] = ()
    gap_at: int = 0
    left_out: str = ""
    same_as: str = ""
    timeline: Timeline | None = None
    late: bool = False

    @property
    def is_wide(self) -> bool:
        """Whether the first plot has no room on a phone, even as small as it may become."""
        width = re.search(r"min-width:([\d.]+)px", self.plots[0]) if self.plots else None
        return width is not None and float(width[1]) > PHONE_PX


@dataclass(kw_only=True)
class Drawer:
    """Draws each figure once; `console_chars` is how much of all consoles may still be shown."""

    console_chars: int
    _seen: list[tuple[Figure, Drawn]] = field(default_factory=list)

    def draw(self, figure: Figure) -> Drawn:
        """Return the figure made ready, or where it was drawn before."""
        earlier = next((drawn for seen, drawn in self._seen if seen == figure), None)
        if earlier is not None:
            return Drawn(title=earlier.title, kind=figure.kind, same_as=earlier.name)
        name = f"figure-{len(self._seen) + 1}"
        try:
            drawn = (
                self._console(figure)
                if isinstance(figure, ConsoleFigure)
                else DRAWN[figure.kind](figure, name)
            )
        except Exception:  # noqa: BLE001 - no report hangs on a picture
            drawn = Drawn(title="This picture could not be drawn")
        drawn = replace(drawn, name=name, kind=figure.kind, title=clip(drawn.title, TITLE_CHARS))
        self._seen.append((figure, drawn))
        return drawn

    def _console(self, figure: ConsoleFigure) -> Drawn:
        first, last = self._room(figure.lines)
        # not `[-last:]`, which is all of them where `last` is 0
        shown = [*figure.lines[:first], *figure.lines[len(figure.lines) - last :]]
        errors = sum(printed.stream == "stderr" for printed in figure.lines)
        left = figure.left_out + len(figure.lines) - len(shown)
        lines = plural(len(figure.lines) + figure.left_out, "line")
        return Drawn(
            title=f"What was printed: {lines}, {errors or 'none'} of them on stderr",
            points=len(shown),
            rows=shown,
            gap_at=first if left else len(shown),
            left_out=f"{plural(left, 'line is', 'lines are')} left out here; console.log has them."
            if left
            else "",
        )

    def _room(self, lines: tuple[ConsoleLine, ...]) -> tuple[int, int]:
        """Return how many of the first and of the last lines are shown."""
        first, last = len(lines), 0
        if len(lines) > CONSOLE_FIRST + CONSOLE_LAST:
            first, last = CONSOLE_FIRST, CONSOLE_LAST
        for place, line in enumerate([*lines[:first], *lines[len(lines) - last :]]):
            self.console_chars -= min(len(line.text), LINE_CHARS) + 30  # and about so much markup
            if self.console_chars < 0:
                return min(first, place), max(0, place - first)
        return first, last


def _rate(figure: RateFigure, name: str) -> Drawn:
    return Drawn(
        title=f"The rate of {figure.topic}, published by {figure.publisher}",
        words=rate_words(figure),
        points=len(figure.gaps_s),
        plots=rate_plots(figure, name),
        second="How long the gaps are",
        left_out="" if figure.counts else _thinned_text(len(figure.gaps_s), figure.messages - 1),
    )


def _counter(figure: CounterFigure, name: str) -> Drawn:
    return Drawn(
        title=f"The numbers on {figure.topic}, published by {figure.publisher}",
        words=counter_words(figure),
        points=len(figure.values),
        plots=counter_plots(figure, name),
        second="All values",
        notes=tuple(wrong_steps(figure)),
        left_out=_thinned_text(len(figure.values), figure.messages),
    )


def _thinned_text(shown: int, there: int) -> str:
    return f"{shown} of {there} messages are shown." if there > shown else ""


def _draw_heard(figure: HeardFigure, _name: str) -> Drawn:
    missed = [row for row in figure.rows if row.heard is None]
    rows = _first(figure.rows, missed)
    if len(missed) == len(rows) or all(row.other_words for row in rows):
        rows = rows[:HEARD_ALIKE_MAX]  # all the same is seen from a few
    many = len(figure.rows)
    said = f"{many - len(missed)} of {plural(many, 'message')} {'was' if many == 1 else 'were'} printed."
    if other := sum(row.other_words for row in figure.rows):
        said = f"{said[:-1]}, {other} of them in other words."
    if figure.out_of_order:
        said += " All of them came, but not in the order in which they were sent."
    return Drawn(
        title="What was sent to your listener, and what it printed",
        words=said,
        points=len(rows),
        rows=rows,
        late=any(row.after_s is not None and row.after_s >= LATE_S for row in rows),
        left_out=_thinned_text(len(rows), many + figure.left_out),
    )


def _first(rows: tuple[Heard, ...], missed: list[Heard]) -> list[Heard]:
    """Return rows in their order; of too many, those that were missed come before those that were heard."""
    if len(rows) <= HEARD_MAX:
        return list(rows)
    # by identity, since two rows may be equal
    kept = {id(row) for row in [*missed, *(row for row in rows if row.heard is not None)][:HEARD_MAX]}
    return [row for row in rows if id(row) in kept]


def _graph(figure: GraphFigure, name: str) -> Drawn:
    rows = list(graph_rows(figure))
    plot = graph_plot(figure, name)
    alone = [node for node in figure.nodes if node not in {edge.node for edge in figure.edges}]
    words = f"{plural(len(figure.nodes), 'node')}, {plural(len(figure.topics), 'topic')}."
    words += f" Not connected to any topic: {', '.join(alone[:10])}." if alone else ""
    faults = [f"In red: {'; '.join(graph_faults(figure))}."] if figure.wrong else []
    return Drawn(
        title="Nodes and topics, as rqt_graph draws them",
        words=words,
        points=len(figure.nodes) + len(figure.topics),
        plots=[plot] if plot else [],
        rows=rows[:GRAPH_ROWS_MAX],
        notes=faults,
        left_out=f"{figure.left_out} more are not shown." if figure.left_out else "",
    )


def _code(figure: CodeFigure, _name: str) -> Drawn:
    lines = [str(i) for i in figure.marked[:5]]
    marked = f"line{'s' if len(lines) > 1 else ''} {join_words(lines)}"
    return Drawn(
        title=f"{figure.file}, {marked}" if lines else figure.file,
        points=len(figure.lines),
        rows=[
            (
                number,
                number in figure.marked,
                all(abs(number - at) > NEAR_LINES for at in figure.marked),
                text[: len(text) - len(text.lstrip())].replace("\t", SHOWN_TAB),
                _parts(text, figure.columns.get(number), figure.ends.get(number)),
            )
            for number, text in enumerate(figure.lines, start=figure.first_line)
        ],
    )


def _parts(text: str, column: int | None, end: int | None) -> tuple[str, str, str]:
    """Return what stands between the indentation and the place that is meant, that itself, and the rest; all is the
    rest where no place is known."""
    indent = len(text) - len(text.lstrip())
    if column is None or column <= indent:
        return "", "", text[indent:]
    begin = column - 1
    # without an end, the word that begins there is meant, or else one letter
    word = re.compile(r"\w+").match(text, begin)
    at_end = end - 1 if end and end > column else word.end() if word else column
    return text[indent:begin], text[begin:at_end], text[at_end:]


def _path(figure: PathFigure, name: str) -> Drawn:
    plot = path_plot(figure, name)
    return Drawn(
        title=f"The path of {figure.topic}, seen from above",
        words=path_words(figure),
        points=len(figure.points),
        plots=[plot] if plot else [],
        left_out=_thinned_text(len(figure.points), figure.messages),
    )


def _place(figure: PlaceFigure, name: str) -> Drawn:
    return Drawn(
        title=f"Where the robot was, seen from above: {figure.topic}",
        words=f"{figure.says} {'Thick lines are walls. ' if figure.walls else ''}It began at the small circle.",
        points=len(figure.points),
        plots=[place_plot(figure, name)],
        left_out=_thinned_text(len(figure.points), figure.messages),
    )


def _timeline(figure: TimelineFigure, name: str) -> Drawn:
    return Drawn(
        title="What happened, and when",
        words=timeline_words(figure),
        points=len(figure.lanes),
        plots=[timeline_plot(figure, name)],
        timeline=timeline(figure),
        left_out=f"{figure.left_out} more are not shown." if figure.left_out else "",
    )


DRAWN: dict[str, Callable[..., Drawn]] = {
    "rate": _rate,
    "counter": _counter,
    "heard": _draw_heard,
    "graph": _graph,
    "code": _code,
    "path": _path,
    "place": _place,
    "timeline": _timeline,
}


def code_places(figures: Iterable[Figure]) -> frozenset[tuple[str, int]]:
    """Return the lines that are shown with the code around them."""
    return frozenset(
        (figure.file, line) for figure in figures if isinstance(figure, CodeFigure) for line in figure.marked
    )


WIDE, LANE, BAR = 1000.0, 24.0, 12.0
NARROW = 1.6
"""So wide is a moment, of `WIDE`."""
EVENTS_MAX = 80
FINE = 5
"""So many more ticks are there when one has zoomed in."""
WORDS = {"process": "process", "node": "node", "topic": "topic", "log": "log", "grader": ""}


@dataclass(frozen=True, kw_only=True)
class Tick:
    """`at` is in percent; a `fine` one is shown in a wide plane alone."""

    at: float
    label: str
    fine: bool


@dataclass(frozen=True, kw_only=True)
class Happened:
    """One line of the list that says the same in words."""

    at_s: float
    who: str
    says: str
    wrong: bool = False


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """What the page needs beside the drawing: the lanes' kinds and names, the axis, and all of it in words."""

    lanes: Sequence[tuple[str, str]]
    axis: Sequence[Tick]
    happened: Sequence[Happened]
    more: int


def timeline(figure: TimelineFigure) -> Timeline:
    """Return the names, the axis and the list."""
    happened = sorted(_happenings(figure.lanes), key=lambda one: one.at_s)
    return Timeline(
        lanes=[(WORDS[lane.kind], lane.name) for lane in figure.lanes],
        axis=list(_axis(figure.length_s)),
        happened=happened[:EVENTS_MAX],
        more=len(happened[EVENTS_MAX:]),
    )


def timeline_words(figure: TimelineFigure) -> str:
    """Return what the drawing shows, in a sentence."""
    kinds: list[str] = [lane.kind for lane in figure.lanes]
    counted = [plural(kinds.count(kind), kind, "processes" if kind == "process" else "") for kind in KINDS]
    return f"{', '.join(counted)} over {number(figure.length_s, 1)} s."


KINDS = ("process", "node", "topic")


def timeline_plot(figure: TimelineFigure, name: str) -> Markup:
    """Return the drawing, without names and axis: it is stretched to the width that it has."""
    scale = WIDE / (figure.length_s or 1.0)
    high = LANE * len(figure.lanes)
    lanes = [part for i, lane in enumerate(figure.lanes) for part in _lane(lane, i * LANE, scale)]
    tops = (i * LANE for i in range(len(figure.lanes) + 1))
    rules = [element("line", x1=0, x2=WIDE, y1=y, y2=y, class_="grid") for y in tops]
    return element(
        "svg",
        element("title", escaped("What happened in this run, and when"), id=f"{name}-title"),
        element("desc", escaped(timeline_words(figure)), id=f"{name}-desc"),
        *rules,
        *lanes,
        viewBox=f"0 0 {short(WIDE)} {short(high)}",
        height=high,
        preserveAspectRatio="none",
        role="img",
        class_="lanes",
        aria_labelledby=f"{name}-title {name}-desc",
    )


def _lane(lane: Lane, top: float, scale: float) -> Iterator[Markup]:
    y = top + (LANE - BAR) / 2
    if lane.kind == "topic":
        yield element("path", d="".join(_bar(s, y, scale) for s in lane.stretches), class_="topic")
        return
    for stretch in lane.stretches:
        x, wide = _bar_place(stretch, scale)
        when = number(stretch.from_s, 2)
        until = f" to {number(stretch.to_s, 2)}" if stretch.to_s > stretch.from_s else ""
        yield element(
            "rect",
            element("title", escaped(f"{when}{until} s: {stretch.says}")),
            x=x,
            y=y,
            width=wide,
            height=BAR,
            class_=f"{lane.kind} wrong" if stretch.wrong else lane.kind,
        )


def _bar_place(stretch: Stretch, scale: float) -> tuple[float, float]:
    return stretch.from_s * scale, max((stretch.to_s - stretch.from_s) * scale, NARROW)


def _bar(stretch: Stretch, y: float, scale: float) -> str:
    x, wide = _bar_place(stretch, scale)
    return f"M{short(x)} {short(y)}h{short(wide)}v{short(BAR)}h-{short(wide)}z"


def _axis(length_s: float) -> Iterator[Tick]:
    coarse = ticks(0.0, length_s)
    step = coarse[1] - coarse[0] if len(coarse) > 1 else length_s
    for i in range(int(length_s / step * FINE + 1e-9) + 1 if step else 0):
        at_s = i * step / FINE
        yield Tick(at=100 * at_s / length_s, label=f"{number(at_s, 2)} s", fine=i % FINE != 0)


def _happenings(lanes: Sequence[Lane]) -> Iterator[Happened]:
    for lane in lanes:
        if lane.kind == "topic":
            yield from _heard_bars(lane)
            continue
        for stretch in lane.stretches:
            moment = stretch.to_s == stretch.from_s
            begins = stretch.says if moment else BEGINS[lane.kind]
            wrong = stretch.wrong and moment
            yield Happened(at_s=stretch.from_s, who=_who(lane), says=begins, wrong=wrong)
            if lane.kind == "process":
                yield Happened(at_s=stretch.to_s, who=_who(lane), says=stretch.says, wrong=stretch.wrong)


BEGINS = {"process": "started", "node": "registered with the master", "log": "", "grader": ""}


def _heard_bars(lane: Lane) -> Iterator[Happened]:
    first, last = lane.stretches[0], lane.stretches[-1]
    yield Happened(at_s=first.from_s, who=_who(lane), says="first message")
    if last.to_s > first.from_s:
        yield Happened(at_s=last.to_s, who=_who(lane), says="last message")


def _who(lane: Lane) -> str:
    return f"{WORDS[lane.kind]} {lane.name}".strip()
