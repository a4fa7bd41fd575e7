"""What a report draws beside a verdict: numbers and texts from the evidence, each of bounded size.

All times are seconds since the run began. Drawing needs nothing else from the evidence.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from grader.model.record import Record

POINTS_MAX = 600
"""The most points of a figure; of more, those that show what is judged are kept."""


class RateFigure(Record):
    """The rate of a topic over time, and how long its gaps are.

    `publisher` is one node, or all of the student's on the topic together (`/a and /b`): that is what is judged.
    `times_s` are the arrivals but for the first, `gaps_s` the time before each; where the publisher `ends_silent`, the
    last of them is the silence at the end. Of a flood, `counts` say how many came in each `slice_s`. `low_hz` and
    `high_hz` bound the mean that passes, `gap_low_s` and `gap_high_s` a single gap. `mean_hz` is what was measured, of
    so many `messages`; of very many some points are shown. `late` are stretches in which the machine was late, `died`
    when a publisher's process ended by itself, and how.
    """

    kind: Literal["rate"] = "rate"
    topic: str
    publisher: str
    scenario: str
    times_s: tuple[float, ...]
    gaps_s: tuple[float, ...]
    mean_hz: float | None
    low_hz: float
    high_hz: float
    gap_low_s: float | None = None
    gap_high_s: float | None = None
    late: tuple[tuple[float, float], ...] = ()
    died: tuple[tuple[float, str], ...] = ()
    messages: int = 0
    ends_silent: bool = False
    counts: tuple[int, ...] = ()
    slice_s: float = 0.1


class CounterFigure(Record):
    """A counter's values over time. `wraps` and `wrong` are indexes into the points: steps to the first value after a
    wrap, and steps that are not as they should be; `texts` say what is wrong with each of `wrong`, and `more_wrong`
    steps are not named. `numbers` count each point's value from 0 on its publisher: where they jump, points are left
    out. `died` says when the publisher's process ended by itself, and how. Where ROS's clock was `faster` than the wall
    by this factor, times are the clock's."""

    kind: Literal["counter"] = "counter"
    topic: str
    publisher: str
    scenario: str
    times_s: tuple[float, ...]
    values: tuple[int | float, ...]
    numbers: tuple[int, ...] = ()
    wraps: tuple[int, ...] = ()
    wrong: tuple[int, ...] = ()
    texts: tuple[str, ...] = ()
    more_wrong: int = 0
    died: tuple[tuple[float, str], ...] = ()
    messages: int = 0
    faster: float = 1


class Heard(Record):
    """One probe: what was sent on which topic, and the line that the listener printed of it, if any.

    `other_words`: the line has the message, in other words than those that the lab asks for."""

    topic: str
    sent: str
    at_s: float
    heard: str | None = None
    after_s: float | None = None
    other_words: bool = False


class HeardFigure(Record):
    """What the listener was sent, against what it printed; `left_out` of what was sent is not shown.

    Where it is `out_of_order`, everything was printed, but not in the order in which it was sent.
    """

    kind: Literal["heard"] = "heard"
    scenario: str
    rows: tuple[Heard, ...]
    left_out: int = 0
    out_of_order: bool = False


class Edge(Record):
    """Over `topic`, from the node to the topic (`publishes`) or from the topic to the node."""

    node: str
    topic: str
    publishes: bool


class GraphFigure(Record):
    """Nodes and topics as `rqt_graph` draws them, all that were there during the run. `types` are the topics'.

    `wrong` says of nodes and topics what is wrong with them; topics of these that are `missing` were not there.
    `left_out` nodes and topics are not shown.
    """

    kind: Literal["graph"] = "graph"
    scenario: str
    nodes: tuple[str, ...]
    topics: tuple[str, ...]
    types: dict[str, str] = Field(default_factory=dict)
    edges: tuple[Edge, ...]
    wrong: dict[str, str] = Field(default_factory=dict)
    missing: tuple[str, ...] = ()
    left_out: int = 0


class ConsoleLine(Record):
    at_s: float
    process: str
    stream: str
    text: str


class ConsoleFigure(Record):
    """What was printed during a run; `left_out` lines are only in the evidence."""

    kind: Literal["console"] = "console"
    scenario: str
    lines: tuple[ConsoleLine, ...]
    left_out: int = 0


class CodeFigure(Record):
    """Lines of a file from `first_line` (counted from 1) on, with the `marked` ones.

    `columns` are places in these, counted from 1, by line, and `ends` where what is meant there ends.
    """

    kind: Literal["code"] = "code"
    file: str
    first_line: int
    lines: tuple[str, ...]
    marked: tuple[int, ...]
    columns: dict[int, int] = Field(default={})
    ends: dict[int, int] = Field(default={})


class PathFigure(Record):
    """The way that a robot took, through `points` in metres, and the `corners` that it had to pass in their order.

    It may be `tolerance_m` off. `reached` of the corners were passed; `strayed` is the index of the first point that
    is too far from the way, None where none is.
    """

    kind: Literal["path"] = "path"
    topic: str
    scenario: str
    points: tuple[tuple[float, float], ...]
    corners: tuple[tuple[float, float], ...]
    tolerance_m: float
    reached: int
    strayed: int | None = None
    messages: int = 0
    first: int = Field(default=0, exclude_if=lambda value: not value)
    """The number of the first corner; 0 is a start that the rubric does not count."""


class PlaceFigure(Record):
    """Where a robot was, through `points` in metres, and where it had to be.

    That is a `goal` within `tolerance_m`, or a region: inside `area`, or at some distance from `walls`, lines through
    points. `wrong` is the index of the point that is worst, None where all are right, and `says` tells it in a
    sentence.
    """

    kind: Literal["place"] = "place"
    topic: str
    scenario: str
    points: tuple[tuple[float, float], ...]
    goal: tuple[float, float] | None = None
    tolerance_m: float = 0.0
    area: tuple[tuple[float, float], ...] = ()
    walls: tuple[tuple[tuple[float, float], ...], ...] = ()
    wrong: int | None = None
    says: str
    messages: int = 0


class Stretch(Record):
    """From when to when something was there; both are the same for a moment. `says` tells what it was, and is empty
    for one of many alike; `wrong` marks what went wrong."""

    from_s: float
    to_s: float
    says: str = ""
    wrong: bool = False


class Lane(Record):
    """One row of a timeline: of a process, a node, a topic, a log, or of what the grader did."""

    kind: Literal["process", "node", "topic", "log", "grader"]
    name: str
    stretches: tuple[Stretch, ...]


class TimelineFigure(Record):
    """What happened in a run, and when: `lanes` over `length_s`. Of the many messages of a topic, those close together
    are one stretch. `left_out` lanes are not shown."""

    kind: Literal["timeline"] = "timeline"
    scenario: str
    length_s: float
    lanes: tuple[Lane, ...]
    left_out: int = 0


Figure = Annotated[
    RateFigure
    | CounterFigure
    | HeardFigure
    | GraphFigure
    | ConsoleFigure
    | CodeFigure
    | PathFigure
    | PlaceFigure
    | TimelineFigure,
    Field(discriminator="kind"),
]


class Figures(Record):
    """Of one submission: by criterion what shows its verdict, and of each scenario the timeline, the graph and the
    console.

    `consoles` has what the build printed too, as `package`.
    """

    by_criterion: dict[str, tuple[Figure, ...]] = Field(default_factory=dict)
    timelines: dict[str, TimelineFigure] = Field(default_factory=dict)
    graphs: dict[str, GraphFigure] = Field(default_factory=dict)
    consoles: dict[str, ConsoleFigure] = Field(default_factory=dict)
