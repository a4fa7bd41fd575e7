"""What the arena records beside the messages: one record for each JSON channel. Times are their `log_time`s (ns)."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.version import EVIDENCE

EVIDENCE_VERSION = str(EVIDENCE.version)
METADATA_NAME = "grader.evidence"
PACKAGE_RUN = "package"
"""The run that holds the package's facts and files, and its build: `package.mcap`."""
CATKIN_MAKE = "catkin_make"
"""The name of the build's process."""
STOPPED = "stopped by the grader"
"""Begins the detail of a limit at which a process was ended."""
RECORDING_MISSING = "recording.missing"
RECORDING_PROBLEM = "recording.problem"
MISFIT = "the package's definition does not fit: "
"""Begins the detail of the answer to a call that could not be made, because the student's own `.srv` is another one."""
UNSENDABLE = "the grader cannot publish "
"""Begins the detail of a note about messages that the rubric has wrong."""


GOAL_STATUS = (
    "PENDING", "ACTIVE", "PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "PREEMPTING", "RECALLING", "RECALLED", "LOST",
)  # fmt: skip
"""By number (actionlib_msgs/GoalStatus)."""
OTHER_TYPE = "asks for another type"
"""Begins the detail of the note on a node that the grader's own node refused for its type."""
UNNAMED = "/unnamed"
"""As which rospy looks for services in a program that is no node."""
UNHEARD = "nothing was published: no node has subscribed"
"""The detail of the note on a topic to which a step would have sent messages."""
NOT_OFFERED = "not called: no node has offered it"
"""The detail of the note on a service that a step would have called."""
NO_ANSWER = "no answer within"
"""Begins the detail of the answer to a call that a service did not answer in time."""


class ProcessEvent(Record):
    """`/grader/process`: a process started or ended."""

    event: Literal["start", "exit"]
    """It started or ended."""
    name: str
    """What the scenario calls it."""
    role: Literal["student", "build", "grader"]
    """`student`, `build`, or `grader` for programs that a scenario starts beside the student's."""
    argv: tuple[str, ...] = ()
    """Its arguments."""
    script: str | None = None
    """The package's script that runs, from the package's root."""
    repairs: tuple[str, ...] = ()
    """What was repaired in the copy that ran: `executable bit`, `CRLF`, `shebang`."""
    exit_code: int | None = None
    """Its exit code, at the end."""
    signal: int | None = None
    """The signal that ended it."""
    stopped_by: str | None = None
    """The last signal that the arena sent it (`INT`, `TERM`, `KILL`); null if it ended on its own."""
    cpu_s: float | None = None
    """CPU seconds of its process tree."""
    max_rss_bytes: int | None = None
    """The most memory of its process tree, in bytes."""


class ConsoleLine(Record):
    """`/grader/console`: one line without its end. Bytes that are not UTF-8 appear as U+FFFD."""

    process: str
    """Whose output it is."""
    stream: Literal["stdout", "stderr"]
    """Where it was printed."""
    line: str
    """The line, without its end."""
    truncated: bool = False
    """Whether the line was longer."""


class Connection(Record):
    """A live topic connection: both nodes report it (`getBusInfo`), and the kernel knows of one between them."""

    topic: str
    """The topic."""
    publisher: str
    """The publishing node."""
    subscriber: str
    """The subscribing node."""


class GraphEvent(Record):
    """`/grader/graph`: the master's state after a change. Topics and services map to the names of nodes."""

    nodes: tuple[str, ...]
    """All nodes."""
    topic_types: dict[str, str]
    """Types by topic."""
    publishers: dict[str, tuple[str, ...]]
    """Nodes by topic."""
    subscribers: dict[str, tuple[str, ...]]
    """Nodes by topic."""
    services: dict[str, tuple[str, ...]]
    """Nodes by service."""
    connections: tuple[Connection, ...] = ()
    """What is connected."""
    processes: dict[str, str] = Field(default_factory=dict)
    """The process that each node belongs to."""
    service_types: dict[str, str] = Field(default_factory=dict)
    """Types by service, as the services themselves say."""


class ParamEvent(Record):
    """`/grader/param`: one change of the parameter server."""

    action: Literal["set", "delete"]
    """It was set, or deleted."""
    name: str
    """The parameter."""
    caller_id: str
    """The node that did it."""
    value: Any = None
    """What it was set to."""


class HostEvent(Record):
    """`/grader/host`: how late a timer of 20 ms woke since the last such event, and how busy the machine was."""

    samples: int
    """How often the timer woke since the last such event."""
    mean_ms: float
    """How late, on average (ms)."""
    p95_ms: float
    """How late, at most, in 95 of 100 cases (ms)."""
    max_ms: float
    """How late, at most (ms)."""
    load_1min: float
    """The load average of the last minute."""
    busy: float | None = None
    """The share of the processors' time that was busy, 0 to 1; null if not known."""
    own_busy: float | None = None
    """The part of `busy` that this run's student processes took, 0 to 1; null if not known."""


class ActorEvent(Record):
    """`/grader/actor`: what the grader, or a stand-in program of its own, did in the run.

    `publish`: `value` is the field `data` as sent, or a map of the message's fields. `param`: `topic` is
    the parameter's name, `value` what it was set to. `call`: `topic` is the service, `value` the request's
    fields; `answer`: the response's fields, or None and the reason in `detail`. `open`: the stand-in for
    the program `actor` was started with the arguments `value`. `refused`: `actor` (a process if known, else
    a node) was not allowed what `detail` says; `limit`: it reached a limit. There are at most 50 of each in
    a run, equal ones once. For steps: `set_param` is `param` in the middle of the run. `wait` waited for
    the topic or node `topic`, or for a time, and `detail` says whether it came. For tests that call
    functions: `type` is the call, and `answer`, in JSON, is what came back in the process `detail`.
    `start`, `stop` (Ctrl-C) and `kill` have the process in `detail` (`interrupt` is the run's end), and so
    does `type`, with the line for its standard input in `value`. `goal`, `cancel` and `result` are an
    action's: `topic` is its name, `detail` the word for the result's status (`SUCCEEDED`), or why there is
    none. `play`: the recording `topic` was played; its messages are on their topics. `left`: the process
    `actor` left the file `detail`, of `value` bytes; a file that is kept is an attachment. For services and
    actions that the grader offers: `serve` is a call, or a goal, of the node `actor`, and `value` has the
    fields of its `request` and of the `response` or result, None if the service fails; a goal's state is in
    `detail`. `lookup`: the node `actor` asked the master for the service `topic` for the first time;
    `detail` says if it did not exist. `read`: the same for the parameter `topic`.
    """

    action: Literal[
        "publish", "clock", "interrupt", "param", "call", "answer", "open", "note", "refused", "limit", "wait",
        "start", "stop", "kill", "type", "set_param", "goal", "cancel", "result", "play", "left", "serve", "lookup",
        "read",
    ]  # fmt: skip
    """What was done."""
    actor: str
    """Who did it."""
    topic: str | None = None
    """The topic, parameter or service."""
    type: str | None = None
    """The message's or service's type."""
    value: Any = None
    """What was sent, set, asked or answered."""
    detail: str = ""
    """Further details."""


class RecorderEvent(Record):
    """`/grader/recorder`: the recorder's connections. `dropped` counts messages beyond the limits of a
    channel or of the run; in a flood of millions it is calculated from the bytes, and `detail` says so.
    `behind`: the recorder could not keep up, and from then on the publisher may have dropped messages."""

    event: Literal["connected", "refused", "closed", "limit", "behind", "invalid"]
    """What happened to the connection."""
    topic: str
    """The topic."""
    callerid: str
    """The publisher."""
    messages: int = 0
    """How many messages were recorded."""
    dropped: int = 0
    """How many were not, because of the limits."""
    detail: str = ""
    """Further details."""


class ScenarioEvent(Record):
    """`/grader/scenario`: the run's own course. `outcome` is given once, at the end.

    `complete`: everything that the run waited for was seen. `ended`: the student's processes ended first.
    `silent`: messages did not come, or stopped coming, although the processes ran. `timeout`: the limit was
    reached while they were still coming. `host`: the arena or the machine failed (`detail` says how), which
    must not cost the student anything.
    """

    event: Literal["begin", "ready", "end"]
    """The run began, was ready, ended."""
    outcome: Literal["complete", "ended", "silent", "timeout", "host"] | None = None
    """How it ended; only at the end."""
    detail: str = ""
    """Further details."""


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
FIELDS = {
    "processes": "/grader/process",
    "console": "/grader/console",
    "graph": "/grader/graph",
    "params": "/grader/param",
    "host": "/grader/host",
    "actors": "/grader/actor",
    "recorder": "/grader/recorder",
    "course": "/grader/scenario",
}
"""Where a `Run` keeps each topic's records."""
