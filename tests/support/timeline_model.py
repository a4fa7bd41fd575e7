"""The text form of recorded evidence (docs/reference/evidence-timelines.md). Seconds count from the run's beginning."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from grader.evidence.events import (
    ActorEvent,
    ConsoleLine,
    GraphEvent,
    HostEvent,
    ParamEvent,
    RecorderEvent,
)
from grader.model.record import Record

At = Annotated[float, Field(ge=0)]


class Gap(Record):
    """The publisher pauses for `pause_s` before message `before`, and everything after it comes later."""

    before: Annotated[int, Field(ge=1)]
    pause_s: At


class Stall(Record):
    """Message `at` is late by `late_s`; those after it keep their own schedule, as `rospy.Rate` does."""

    at: Annotated[int, Field(ge=0)]
    late_s: At


class CountUp(Record):
    """A counter: `count_from`, then by `step`; after `wrap_after` comes `wrap_to`."""

    count_from: int = 0
    step: int = 1
    wrap_after: int | None = None
    wrap_to: int = 0

    def values(self, count: int) -> list[Any]:
        value, values = self.count_from, []
        for _ in range(count):
            values.append(value)
            value = self.wrap_to if value == self.wrap_after else value + self.step
        return values


class TextPattern(Record):
    """Text made by `str.format` from `i` (the message's number) and `time_s` (its time since 1970)."""

    text: str


class TopicLine(Record):
    """One publisher on one topic. `values` shorter than `count` begin again; without `count` each comes once.

    `times_s` gives every time by hand. `jitter_ms` shifts single messages, round and round. `burst` messages
    come together. `drop` leaves messages out as if lost on the way, `replace` changes single values, `raw`
    are bytes in hex.
    """

    topic: str
    type: str = "std_msgs/String"
    callerid: str = "/talker"
    latching: bool = False
    start_s: At = 0.5
    rate_hz: Annotated[float, Field(gt=0)] = 10.0
    count: Annotated[int, Field(ge=0, le=1_000_000)] | None = None
    values: CountUp | TextPattern | tuple[Any, ...] | None = None
    raw: tuple[str, ...] | None = None
    times_s: tuple[At, ...] | None = None
    jitter_ms: tuple[float, ...] = ()
    gaps: tuple[Gap, ...] = ()
    stalls: tuple[Stall, ...] = ()
    burst: Annotated[int, Field(ge=1)] = 1
    drop: tuple[int, ...] = ()
    replace: dict[int, Any] = Field(default_factory=dict)
    md5sum: str | None = None
    definition: str | None = None

    @model_validator(mode="after")
    def _one_source(self) -> TopicLine:
        if self.values is not None and self.raw is not None:
            raise ValueError("give `values` or `raw`, not both")
        if self.times_s is not None and (self.gaps or self.stalls or self.jitter_ms or self.burst > 1):
            raise ValueError("`times_s` already says when each message comes")
        return self


class ProcessLine(Record):
    """A process: its start and, where `exit_s`, `exit_code`, `signal` or `stopped_by` is given, its end.

    `nodes` are those that belong to it, in the graph that is made up.
    """

    name: str
    role: Literal["student", "build", "grader"] = "student"
    nodes: tuple[str, ...] = ()
    argv: tuple[str, ...] = ()
    script: str | None = None
    repairs: tuple[str, ...] = ()
    start_s: At = 0.0
    exit_s: At | None = None
    exit_code: int | None = None
    signal: int | None = None
    stopped_by: str | None = None
    cpu_s: float | None = None
    max_rss_bytes: int | None = None

    @property
    def ends(self) -> bool:
        return any(v is not None for v in (self.exit_s, self.exit_code, self.signal, self.stopped_by))


class ServiceLine(Record):
    """Who offers a service and, unless nobody could ask it, its type."""

    node: str
    type: str | None = None


class Printed(ConsoleLine):
    """A console line at `at_s`, or several (`lines`) that follow each other by `every_s`."""

    stream: Literal["stdout", "stderr"] = "stdout"
    line: str = ""
    lines: tuple[str, ...] = ()
    at_s: At = 0.6
    every_s: At = 0.1


class Acted(ActorEvent):
    """What the grader did at `at_s`; `values` stands for several such events that follow by `every_s`."""

    actor: str = "/grader_probe"
    values: tuple[Any, ...] = ()
    at_s: At = 0.6
    every_s: At = 0.1


class Graph(GraphEvent):
    at_s: At = 0.4
    nodes: tuple[str, ...] = ()
    topic_types: dict[str, str] = Field(default_factory=dict)
    publishers: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    subscribers: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    services: dict[str, tuple[str, ...]] = Field(default_factory=dict)


class Host(HostEvent):
    at_s: At = 1.0
    samples: int = 100
    mean_ms: float = 0.1
    p95_ms: float = 0.2
    max_ms: float = 0.5
    load_1min: float = 0.5


class ParamLine(ParamEvent):
    action: Literal["set", "delete"] = "set"
    caller_id: str = "/grader"
    at_s: At = 0.3


class RecorderLine(RecorderEvent):
    at_s: At = 0.4


class LeftLine(Record):
    """A file that a process left: its `text`, or the `topics` of a bag; neither is a file of which nothing was kept."""

    process: str
    path: str
    text: str | None = None
    topics: tuple[TopicLine, ...] | None = None
    size_bytes: int = 0
    at_s: At = 0.6


class TimelineRun(Record):
    """One run. `graph`, `host` and `recorder` are made up where left out; an empty list means none."""

    scenario: str | None = None
    clock: Literal["real", "warped"] = "real"
    warp: Annotated[float, Field(ge=1)] = 1.0
    metadata: dict[str, str] = Field(default_factory=dict)
    topics: tuple[TopicLine, ...] = ()
    subscribers: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    services: dict[str, ServiceLine] = Field(default_factory=dict)
    processes: tuple[ProcessLine, ...] = ()
    console: tuple[Printed, ...] = ()
    graph: tuple[Graph, ...] | None = None
    host: tuple[Host, ...] | None = None
    recorder: tuple[RecorderLine, ...] | None = None
    actors: tuple[Acted, ...] = ()
    params: tuple[ParamLine, ...] = ()
    outcome: Literal["complete", "ended", "silent", "timeout", "host"] | None = "complete"
    outcome_detail: str = ""
    end_s: At | None = None
    attachments: dict[str, str] = Field(default_factory=dict)
    left: tuple[LeftLine, ...] = ()
    package: dict[str, Any] | None = None

    @model_validator(mode="after")
    def _one_graph(self) -> TimelineRun:
        made_up = self.subscribers or self.services or any(process.nodes for process in self.processes)
        if self.graph is not None and made_up:
            raise ValueError(
                "`subscribers`, `services` and `nodes` fill a graph that is made up: leave `graph` out"
            )
        return self
