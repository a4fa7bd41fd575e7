"""Figures of every kind, made up: quiet ones, and ones full of text that nobody should obey."""

from __future__ import annotations

from collections.abc import Callable

from grader.model.figure import (
    CodeFigure,
    ConsoleFigure,
    ConsoleLine,
    CounterFigure,
    Edge,
    Figures,
    GraphFigure,
    Heard,
    HeardFigure,
    Lane,
    PathFigure,
    RateFigure,
    Stretch,
    TimelineFigure,
)
from tests.report.hostile import MARKDOWN, XML

SCRIPT = "</script><script>alert(1)</script><img src=x onerror=alert(1)>\"'`"
RTL = "\u202eevil \u05e9\u05dc\u05d5\u05dd \u2066x\u2069"


def rate(**changes: object) -> RateFigure:
    """5 Hz where 10 Hz are asked for, with one late stretch."""
    data: dict[str, object] = {
        "topic": "/chatter",
        "publisher": "/talker",
        "scenario": "real",
        "times_s": tuple(0.5 + 0.2 * i for i in range(30)),
        "gaps_s": (0.2,) * 30,
        "mean_hz": 5.0,
        "low_hz": 9.5,
        "high_hz": 10.5,
        "gap_low_s": 0.05,
        "gap_high_s": 0.15,
        "late": ((2.0, 2.4),),
        "messages": 31,
    }
    return RateFigure.model_validate({**data, **changes})


def counter(**changes: object) -> CounterFigure:
    """Twice around, right the first time and to 1 the second."""
    values = (*range(128), *range(128), *range(1, 10))
    data: dict[str, object] = {
        "topic": "/numeric_chatter",
        "publisher": "/talker",
        "scenario": "wraps",
        "times_s": tuple(0.1 * i for i in range(len(values))),
        "values": values,
        "numbers": tuple(range(len(values))),
        "wraps": (128,),
        "wrong": (256,),
        "texts": ("after 127 comes 1",),
        "messages": len(values),
    }
    return CounterFigure.model_validate({**data, **changes})


def heard(**changes: object) -> HeardFigure:
    """One of three was not printed."""
    rows = (
        Heard(topic="/chatter", sent="abc", at_s=1.0, heard="I heard abc", after_s=0.002),
        Heard(topic="/chatter", sent="0", at_s=1.1),
        Heard(topic="/chatter", sent="def", at_s=1.2, heard="I heard def", after_s=0.003),
    )
    return HeardFigure.model_validate({"scenario": "listener", "rows": rows, **changes})


def graph(**changes: object) -> GraphFigure:
    """A talker and a listener, joined over one of two topics."""
    edges = (
        Edge(node="/talker", topic="/chatter", publishes=True),
        Edge(node="/listener", topic="/chatter", publishes=False),
        Edge(node="/talker", topic="/numeric_chatter", publishes=True),
    )
    data: dict[str, object] = {
        "scenario": "real",
        "nodes": ("/talker", "/listener"),
        "topics": ("/chatter", "/numeric_chatter"),
        "types": {"/chatter": "std_msgs/String"},
        "edges": edges,
    }
    return GraphFigure.model_validate({**data, **changes})


def console(*texts: str, **changes: object) -> ConsoleFigure:
    """These lines, every second one on stderr."""
    lines = tuple(
        ConsoleLine(at_s=0.1 * i, process="talker", stream=("stdout", "stderr")[i % 2], text=text)
        for i, text in enumerate(texts or ("hello", "Traceback"))
    )
    return ConsoleFigure.model_validate({"scenario": "real", "lines": lines, **changes})


def code(**changes: object) -> CodeFigure:
    data: dict[str, object] = {
        "file": "src/numeric_talker.py",
        "first_line": 16,
        "lines": ("while True:", "    rate.sleep", "    count += 1"),
        "marked": (17,),
    }
    return CodeFigure.model_validate({**data, **changes})


def way(**changes: object) -> PathFigure:
    """A square whose second corner is missed."""
    data: dict[str, object] = {
        "topic": "/turtle1/pose",
        "scenario": "real",
        "points": ((0, 0), (1, 0.02), (2, 0), (2.1, 0.5), (2.9, 1.0)),
        "corners": ((0, 0), (2, 0), (2, 2), (0, 2), (0, 0)),
        "tolerance_m": 0.3,
        "reached": 2,
        "strayed": 4,
        "messages": 5,
    }
    return PathFigure.model_validate({**data, **changes})


def timeline(*names: str) -> TimelineFigure:
    """A talker that dies, its topic, and more lanes with these names and texts."""
    life = Stretch(from_s=0.5, to_s=3.0, says="ended by itself: exit code 1", wrong=True)
    sent = tuple(Stretch(from_s=1 + i / 10, to_s=1 + i / 10) for i in range(15))
    lanes = (
        Lane(kind="process", name="talker", stretches=(life,)),
        Lane(kind="topic", name="/chatter", stretches=sent),
        *(
            Lane(kind="log", name=name, stretches=(Stretch(from_s=1, to_s=1, says=name, wrong=True),))
            for name in names
        ),
    )
    return TimelineFigure(scenario="real", length_s=6.0, lanes=lanes)


def figures() -> Figures:
    """One of each kind, beside criteria of `tests.report.hostile`."""
    return Figures(
        by_criterion={
            "chatter-rate": (rate(), code()),
            "counter-wrap": (counter(),),
            "listener-chatter": (heard(),),
            "launch": (way(),),
            "manifest": (rate(),),
        },
        timelines={"real": timeline()},
        graphs={"real": graph()},
        consoles={"real": console()},
    )


def hostile_figures() -> Figures:
    """The same with text of others in every place that takes text, of great length too."""
    bad, long = f"{SCRIPT} {RTL} {XML} {MARKDOWN}", "x<&>\u202e" * 2000
    edges = tuple(Edge(node=f"{bad}{i}", topic=f"{long}{i}", publishes=i % 2 == 0) for i in range(5))
    names = {"nodes": tuple(e.node for e in edges), "topics": tuple(e.topic for e in edges)}
    row = Heard(topic=bad, sent=long, at_s=1.0, heard=bad, after_s=0.1)
    missed = Heard(topic=bad, sent=bad, at_s=1.0)
    of: Callable[[str], dict[str, object]] = lambda text: {"topic": text, "publisher": text}  # noqa: E731
    return Figures(
        by_criterion={
            "chatter-rate": (rate(**of(bad)), rate(**of(long)), code(file=bad, lines=(bad, long, RTL))),
            "talker-node": (counter(**of(bad), texts=(bad,)), counter(**of(long), texts=(long,))),
            "listener-chatter": (heard(rows=(row, missed)), way(topic=bad)),
        },
        timelines={"real": timeline(bad, long)},
        graphs={"real": graph(**names, edges=edges, types={e.topic: bad for e in edges}), bad: graph()},
        consoles={"real": console(bad, long, *["y" * 10_000] * 500), "package": console(RTL)},
    )


EVERY: dict[str, Callable[[], object]] = {
    "rate": rate,
    "counter": counter,
    "heard": heard,
    "graph": graph,
    "console": console,
    "code": code,
    "path": way,
    "timeline": timeline,
}
