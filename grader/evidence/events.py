"""What the arena notes beside the messages: one record a JSON channel. Times are its `log_time`s (ns)."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.version import EVIDENCE

EVIDENCE_VERSION = str(EVIDENCE.version)
METADATA_NAME = "grader.evidence"
RECORDING_MISSING = "recording.missing"
RECORDING_PROBLEM = "recording.problem"


class ProcessEvent(Record):
    """`/grader/process`. `role` is `student`, `build` or `grader`; CPU in seconds, memory in bytes (tree).

    `stopped_by` is the last signal that the arena sent it (`INT`, `TERM`, `KILL`), None where it ended alone.
    `repairs` names what was mended on the copy that ran (`executable bit`, `CRLF`, `shebang`).
    """

    event: Literal["start", "exit"]
    name: str
    role: Literal["student", "build", "grader"]
    argv: tuple[str, ...] = ()
    script: str | None = None
    repairs: tuple[str, ...] = ()
    exit_code: int | None = None
    signal: int | None = None
    stopped_by: str | None = None
    cpu_s: float | None = None
    max_rss_bytes: int | None = None


class ConsoleLine(Record):
    """`/grader/console`: one line without its end. Bytes that are not UTF-8 appear as U+FFFD."""

    process: str
    stream: Literal["stdout", "stderr"]
    line: str
    truncated: bool = False


class Connection(Record):
    """A live topic connection: both nodes report it (`getBusInfo`), and the kernel knows of one between them."""

    topic: str
    publisher: str
    subscriber: str


class GraphEvent(Record):
    """`/grader/graph`: the master's state after a change. Topics and services map to the nodes' names.

    `processes` tells which process each node belongs to, `service_types` what services themselves say they are.
    """

    nodes: tuple[str, ...]
    topic_types: dict[str, str]
    publishers: dict[str, tuple[str, ...]]
    subscribers: dict[str, tuple[str, ...]]
    services: dict[str, tuple[str, ...]]
    connections: tuple[Connection, ...] = ()
    processes: dict[str, str] = Field(default_factory=dict)
    service_types: dict[str, str] = Field(default_factory=dict)


class ParamEvent(Record):
    """`/grader/param`: one change of the parameter server."""

    action: Literal["set", "delete"]
    name: str
    caller_id: str
    value: Any = None


class HostEvent(Record):
    """`/grader/host`: how late a timer woke that asked for 20 ms each time, since the last such event (ms), the load
    average, and the share of the processors' time (0 to 1) that was busy, and that the run's own student processes
    took."""

    samples: int
    mean_ms: float
    p95_ms: float
    max_ms: float
    load_1min: float
    busy: float | None = None
    own_busy: float | None = None


class ActorEvent(Record):
    """`/grader/actor`: what the grader, or a stand-in of its, did in the run.

    `publish`: `value` is the field `data` as sent, or a map of the message's fields. `param`: `topic` is the
    parameter's name, `value` what it was set to. `call`: `topic` is the service, `value` the request's fields;
    `answer`: the response's fields, or None and the reason in `detail`. `open`: the stand-in for the program `actor`
    was started with the arguments `value`. `refused`: `actor`, a process where it is known, else a node, was not
    allowed what `detail` says; `limit`: it had too much of something. At most 50 of each a run, equal ones once.
    """

    action: Literal[
        "publish", "clock", "interrupt", "param", "call", "answer", "open", "note", "refused", "limit"
    ]
    actor: str
    topic: str | None = None
    type: str | None = None
    value: Any = None
    detail: str = ""


class RecorderEvent(Record):
    """`/grader/recorder`: the recorder's connections. `dropped` counts messages past the limits of a channel or of the
    run; of a flood of millions it is worked out from the bytes, and `detail` says so. `behind`: the recorder could not
    keep up, and from then on the publisher may have dropped messages."""

    event: Literal["connected", "refused", "closed", "limit", "behind", "invalid"]
    topic: str
    callerid: str
    messages: int = 0
    dropped: int = 0
    detail: str = ""


class ScenarioEvent(Record):
    """`/grader/scenario`: the run's own course. `outcome` is given once, at the end.

    `complete`: everything waited for was seen. `ended`: the student's processes ended first. `silent`: what was
    waited for did not come, or stopped coming, though the processes ran. `timeout`: the limit came while it was
    still coming. `host`: the arena or the machine failed (`detail` says how): nothing may be held against a
    student.
    """

    event: Literal["begin", "ready", "end"]
    outcome: Literal["complete", "ended", "silent", "timeout", "host"] | None = None
    detail: str = ""


TOPICS: dict[str, type[Record]] = {
    "/grader/process": ProcessEvent,
    "/grader/console": ConsoleLine,
    "/grader/graph": GraphEvent,
    "/grader/param": ParamEvent,
    "/grader/host": HostEvent,
    "/grader/actor": ActorEvent,
    "/grader/recorder": RecorderEvent,
    "/grader/scenario": ScenarioEvent,
}
PACKAGE_TOPIC = "/grader/package"
