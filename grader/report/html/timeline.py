"""The timeline of a run: lanes beside their names, in a plane that is as wide as its reader zooms in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from grader.model.figure import Lane, Stretch, TimelineFigure
from grader.report.html.svg import element, escaped, short, ticks
from grader.wording import number, plural

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
    wrong: bool


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """What the page needs beside the drawing: the lanes' kinds and names, the axis, and all of it in words."""

    lanes: Sequence[tuple[str, str]]
    axis: Sequence[Tick]
    happened: Sequence[Happened]
    more: int


def timeline(figure: TimelineFigure) -> Timeline:
    """Return the names, the axis and the list."""
    happened = sorted(_happened(figure.lanes), key=lambda one: one.at_s)
    return Timeline(
        lanes=[(WORDS[lane.kind], lane.name) for lane in figure.lanes],
        axis=list(_axis(figure.length_s)),
        happened=happened[:EVENTS_MAX],
        more=len(happened[EVENTS_MAX:]),
    )


def timeline_words(figure: TimelineFigure) -> str:
    """What the drawing shows, in a sentence."""
    kinds: list[str] = [lane.kind for lane in figure.lanes]
    counted = [plural(kinds.count(kind), kind, "processes" if kind == "process" else "") for kind in KINDS]
    return f"{', '.join(counted)} over {number(figure.length_s, 1)} s."


KINDS = ("process", "node", "topic")


def timeline_plot(figure: TimelineFigure, name: str) -> Markup:
    """Return the drawing, without names and axis: it is stretched to the width that it has."""
    scale = WIDE / (figure.length_s or 1.0)
    high = LANE * len(figure.lanes)
    lanes = [part for i, lane in enumerate(figure.lanes) for part in _lane(lane, i * LANE, scale)]
    rules = [
        element("line", x1=0, x2=WIDE, y1=i * LANE, y2=i * LANE, class_="grid")
        for i in range(len(figure.lanes) + 1)
    ]
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
        x, wide = _place(stretch, scale)
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


def _place(stretch: Stretch, scale: float) -> tuple[float, float]:
    return stretch.from_s * scale, max((stretch.to_s - stretch.from_s) * scale, NARROW)


def _bar(stretch: Stretch, y: float, scale: float) -> str:
    x, wide = _place(stretch, scale)
    return f"M{short(x)} {short(y)}h{short(wide)}v{short(BAR)}h-{short(wide)}z"


def _axis(length_s: float) -> Iterator[Tick]:
    coarse = ticks(0.0, length_s)
    step = coarse[1] - coarse[0] if len(coarse) > 1 else length_s
    for i in range(int(length_s / step * FINE + 1e-9) + 1 if step else 0):
        at_s = i * step / FINE
        yield Tick(at=100 * at_s / length_s, label=f"{number(at_s, 2)} s", fine=i % FINE != 0)


def _happened(lanes: Sequence[Lane]) -> Iterator[Happened]:
    for lane in lanes:
        if lane.kind == "topic":
            yield from _heard(lane)
            continue
        for stretch in lane.stretches:
            moment = stretch.to_s == stretch.from_s
            begins = stretch.says if moment else BEGINS[lane.kind]
            wrong = stretch.wrong and moment
            yield Happened(at_s=stretch.from_s, who=_who(lane), says=begins, wrong=wrong)
            if lane.kind == "process":
                yield Happened(at_s=stretch.to_s, who=_who(lane), says=stretch.says, wrong=stretch.wrong)


BEGINS = {"process": "started", "node": "registered with the master", "log": "", "grader": ""}


def _heard(lane: Lane) -> Iterator[Happened]:
    first, last = lane.stretches[0], lane.stretches[-1]
    yield Happened(at_s=first.from_s, who=_who(lane), says="first message", wrong=False)
    if last.to_s > first.from_s:
        yield Happened(at_s=last.to_s, who=_who(lane), says="last message", wrong=False)


def _who(lane: Lane) -> str:
    return f"{WORDS[lane.kind]} {lane.name}".strip()
