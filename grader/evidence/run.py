"""One recorded run as the checks see it: frozen, decoded on demand within a budget of memory, no ROS needed."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from grader.errors import EvidenceError
from grader.evidence.events import (
    ActorEvent,
    ConsoleLine,
    GraphEvent,
    HostEvent,
    ParamEvent,
    ProcessEvent,
    RecorderEvent,
    ScenarioEvent,
)
from grader.untrusted_text import without_colours

if TYPE_CHECKING:
    from grader.evidence.decode import Decoder

Params = ParamSpec("Params")
Found = TypeVar("Found")

HELD_BYTES_MAX = 192 << 20
"""More than the arena records of one submission (`arena/limits.py`)."""
FOREIGN_BYTES_MAX = 96 << 20
"""Of other tools' recordings, which are held unpacked beside it."""
DECODED_BYTES_MAX = 160 << 20
RECORD_BYTES = 150
"""What a message takes beside its own bytes, roughly."""
LESS = "record the lab's topics only: `rosbag record /topic …`, or cut it with `rosbag filter`"
"""What to do about a recording that is too large."""


class BudgetExceeded(ValueError):
    """The recordings need more memory than they may take."""


class MemoryBudget:
    """Counts the memory taken. One budget is shared by all recordings that are read together."""

    def __init__(self, *, decoded_bytes: int = DECODED_BYTES_MAX) -> None:
        self._decoded_bytes_max = decoded_bytes
        self._held_bytes = self._decoded_bytes = 0

    def hold(self, size_bytes: int, *, foreign: bool, count: int = 1) -> None:
        """Count records (how many, and their size together) as they lie in the file. Raises BudgetExceeded."""
        self._held_bytes += count * RECORD_BYTES + size_bytes
        most_bytes = FOREIGN_BYTES_MAX if foreign else HELD_BYTES_MAX
        if self._held_bytes > most_bytes:
            raise BudgetExceeded(f"it holds more than {most_bytes >> 20} MiB of messages")

    def decode(self, size_bytes: int) -> None:
        """Count what a message takes once decoded, at most. Raises BudgetExceeded."""
        self._decoded_bytes += size_bytes
        if self._decoded_bytes > self._decoded_bytes_max:
            raise BudgetExceeded(
                f"its messages come to more than {self._decoded_bytes_max >> 20} MiB once decoded"
            )


# As in `arena/ros/guard.py`, which runs under ROS's own Python and imports nothing from here.
OWN_NODE = re.compile(r"/grader_(recorder|actor|calibration)_[0-9a-f]{8}(_knock)?")
BARE_NAME = "/grader"
OTHER_RUNS = re.compile(r"(repaired|repeated)-[1-9]")
"""Folders of evidence beside the first runs: of a repaired copy, and of scenarios that were run once more."""
_LINE_END = re.compile(r"\r\n|\r|\n")
FILE_BYTES_MAX = 2_000_000
DECODER_BYTES = 200_000
LETTER_BYTES = 1_400
"""What a decoder takes, and for each letter of its definition: time more than memory."""


class LeftFile(NamedTuple):
    """A file that a process left behind."""

    process: str
    """What the scenario calls the process."""
    path: str
    """Where it lay: `~/run.bag` in the process's working folder, `~/catkin_ws/src/<package>/…` in the package."""
    size_bytes: int
    """Its size, in bytes."""
    data: bytes | None
    """Its content; None where the scenario does not keep it, or where it is larger than it may be."""

    def recording(self) -> Run:
        """Return the messages of a bag or MCAP file. Raises EvidenceError."""
        from grader.evidence.reader import load_recording  # noqa: PLC0415 - few runs leave one

        return load_recording(self.path, self.data or b"")


class Message(NamedTuple):
    """A recorded message."""

    log_time_ns: int
    """When it arrived at the recorder, in ns."""
    sequence: int
    """Its number on its channel, counted from 0."""
    data: bytes
    """The bytes as sent."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """All messages of one publisher on one topic. `budget` limits the memory of their decoded values."""

    topic: str
    """The topic, with its slash."""
    callerid: str
    """The publishing node, with its slash."""
    type: str
    """The message type: `std_msgs/Int8`."""
    md5sum: str
    """The type's MD5 sum, as ROS computes it."""
    definition: str
    """The type's full definition, as the publisher gave it."""
    latching: bool
    """Whether the publisher latches the topic."""
    messages: tuple[Message, ...]
    """All messages, in the order of their arrival."""
    budget: MemoryBudget = field(default_factory=MemoryBudget, repr=False, compare=False)

    @property
    def by_grader(self) -> bool:
        """Whether one of the grader's own nodes published it."""
        exported = self.callerid == BARE_NAME and self.topic.startswith(f"{BARE_NAME}/")
        return exported or is_grader_node(self.callerid)

    @property
    def publisher(self) -> str:
        """The name of its node, for messages: another tool's recording may lack it."""
        return self.callerid or "an unnamed node"

    @cached_property
    def times_ns(self) -> tuple[int, ...]:
        """Return when each message arrived, in ns."""
        return tuple(m.log_time_ns for m in self.messages)

    @cached_property
    def values(self) -> tuple[Any, ...]:
        """Return each message decoded to a dict of its fields; None if its definition does not fit. Raises
        EvidenceError if that would take more memory than allowed.
        """
        try:
            decoder = self.decoder(self.budget)
            sizes = Counter([len(message.data) for message in self.messages])
            self.budget.decode(sum(count * decoder.decoded_bytes(size) for size, count in sizes.items()))
        except BudgetExceeded as error:
            raise EvidenceError(f"{self.topic}: {error}", hint="publish less on it") from error
        return tuple([decoder.decode(m.data) for m in self.messages])

    def decoder(self, budget: MemoryBudget) -> Decoder:
        """Return a decoder of its messages, which counts as memory too. Raises BudgetExceeded."""
        from grader.evidence.decode import Decoder  # noqa: PLC0415 - it imports this module

        budget.decode(DECODER_BYTES + LETTER_BYTES * len(self.definition))
        return Decoder(self.type, self.definition)

    @property
    def data(self) -> tuple[Any, ...]:
        """The field `data` of each message (std_msgs), None if it has none."""
        return tuple(v.get("data") if isinstance(v, dict) else None for v in self.values)


def left_name(process: str, path: str) -> str:
    """Return the attachment's name of a file that a process left."""
    return f"left/{process}/{path}"


def is_grader_node(name: str) -> bool:
    """Return whether it is one of the grader's own nodes, whose names no other node can have, or ROS's `/rosout`."""
    return OWN_NODE.fullmatch(name) is not None or name == "/rosout"


@dataclass(frozen=True, kw_only=True)
class Run:
    """The recording of one scenario."""

    evidence: str
    """The file's name, for citations."""
    scenario: str
    """The scenario's name in the rubric."""
    clock: str
    """`real`, or `warped` where ROS's time runs faster."""
    warp: float
    """How many seconds of ROS's time pass in one second; 1 in real time."""
    metadata: Mapping[str, str]
    """What the recorder wrote into the file about the run; empty if another tool recorded it."""
    start_ns: int
    """When the first record arrived, in ns. All times are the recorder's own, in real time."""
    end_ns: int
    """When the last record arrived, in ns."""
    channels: tuple[Channel, ...] = ()
    """Each publisher's messages on each topic."""
    processes: tuple[tuple[int, ProcessEvent], ...] = ()
    """When (ns) each process started, and how it ended."""
    console: tuple[tuple[int, ConsoleLine], ...] = ()
    """When (ns) which process printed what."""
    graph: tuple[tuple[int, GraphEvent], ...] = ()
    """When (ns) the master's state changed, and to what."""
    params: tuple[tuple[int, ParamEvent], ...] = ()
    """When (ns) which parameter was set or deleted."""
    host: tuple[tuple[int, HostEvent], ...] = ()
    """How late and how busy the machine was, at intervals."""
    actors: tuple[tuple[int, ActorEvent], ...] = ()
    """When (ns) the grader did what: messages, calls, goals and steps."""
    recorder: tuple[tuple[int, RecorderEvent], ...] = ()
    """What happened to the recorder's own connections."""
    course: tuple[tuple[int, ScenarioEvent], ...] = ()
    """The run's own course; `outcome` is its end."""
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    """Files that were kept with the run, by name."""
    package_json: bytes | None = None
    """The package's files as they were read; ask for the fact `package` instead."""

    @property
    def foreign(self) -> bool:
        """Whether another tool recorded it: then it holds messages, and nothing of processes, graph or console."""
        return not self.metadata

    def __getstate__(self) -> dict[str, Any]:
        """Return what was recorded, without what checks have worked out of it: instructors' tests are sent the run."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @cached_property
    def _known(self) -> dict[tuple[Any, ...], Any]:
        """Answers of `once_for_each_run`."""
        return {}

    @cached_property
    def grader_nodes(self) -> frozenset[str]:
        """Return the nodes of the programs that a scenario starts beside the student's (`turtlesim_node`)."""
        own = {e.name for _, e in self.processes if e.role == "grader"}
        return frozenset(n for _, e in self.graph for n, process in e.processes.items() if process in own)

    @cached_property
    def _bare_is_grader(self) -> bool:
        """Older recordings have its parameters set by `/grader`, newer ones by its node, the first before all else."""
        return not any(OWN_NODE.fullmatch(event.caller_id) for _, event in self.params)

    def is_student_node(self, name: str) -> bool:
        """Return whether a node is of the student's package: neither the grader's nor a program beside it."""
        if name == BARE_NAME and self._bare_is_grader:
            return False
        return not is_grader_node(name) and name not in self.grader_nodes

    def student_channels(self, topic: str | None = None) -> tuple[Channel, ...]:
        """Return the channels of the student's publishers, on one topic or on all."""
        return tuple(
            c for c in self.channels if self.is_student_node(c.callerid) and topic in {None, c.topic}
        )

    def student_nodes(self, process: str | None = None) -> tuple[str, ...]:
        """Return all student nodes that were ever registered, or those of one process, in order of appearance."""
        seen: dict[str, None] = {}
        for _, event in self.graph:
            for node in event.nodes:
                if self.is_student_node(node) and process in {None, event.processes.get(node)}:
                    seen[node] = None
        return tuple(seen)

    def lines(self, process: str) -> Iterator[tuple[int, ConsoleLine]]:
        """Yield what one process printed, with its time (ns)."""
        return ((t, line) for t, line in self.console if line.process == process)

    def file_lines(self, path: str) -> list[str]:
        """Return the lines of a text file of the package that was kept with the run of the build; none for any other.

        The carriage return in a script's first line is kept: the kernel takes it as part of the program's
        name.
        """
        text = self.attachments.get(path, b"")[:FILE_BYTES_MAX].decode("utf-8-sig", errors="replace")
        # Not `splitlines`, which also divides at characters that Python and editors take for part of a line.
        lines = _LINE_END.split(text)
        if lines[0].startswith("#!") and text.startswith(f"{lines[0]}\r"):
            lines[0] += "\r"
        return lines if lines[-1] else lines[:-1]

    @property
    def left_files(self) -> tuple[LeftFile, ...]:
        """The files that the student's processes left, if the scenario keeps files."""
        left = [event for _, event in self.actors if event.action == "left"]
        return tuple(
            LeftFile(e.actor, e.detail, e.value, self.attachments.get(left_name(e.actor, e.detail)))
            for e in left
        )

    @property
    def outcome(self) -> ScenarioEvent | None:
        """How the run ended; None for a file that was cut short."""
        return next((e for _, e in reversed(self.course) if e.event == "end"), None)


def recorded_elsewhere(path: Path, channels: tuple[Channel, ...]) -> Run:
    """Return a run that another tool recorded: it is named after the file, in real time and without processes."""
    times = [t for channel in channels for t in channel.times_ns]
    return Run(
        evidence=path.name,
        scenario=path.stem,
        clock="real",
        warp=1.0,
        metadata={},
        start_ns=min(times, default=0),
        end_ns=max(times, default=0),
        channels=channels,
    )


def once_for_each_run(
    function: Callable[Concatenate[Run, Params], Found],
) -> Callable[Concatenate[Run, Params], Found]:
    """Let a function of a run and of names answer the same question about the same run once: checks share answers."""

    @wraps(function)
    def ask(run: Run, /, *args: Params.args, **names: Params.kwargs) -> Found:
        question = (function, *args, *names.items())
        if question not in run._known:  # noqa: SLF001 - the run's own
            run._known[question] = function(run, *args, **names)  # noqa: SLF001
        return run._known[question]  # type: ignore[no-any-return]  # noqa: SLF001

    return ask


def console_log(runs: Mapping[str, Run]) -> str:
    """Return what the build and the student's processes printed: the build first, then each scenario in the order in
    which they ran, with seconds since the run began and without the codes that colour a terminal."""
    lines = []
    for name, run in sorted(runs.items(), key=lambda item: item[1].start_ns):
        lines += [f"== {name}"] if run.console else []
        own = {event.name for _, event in run.processes if event.role == "grader"}
        for time_ns, line in run.console:
            if line.process in own:
                continue
            text = without_colours(line.line).replace("\n", "\\n")  # a line is one, whatever a recording says
            lines.append(f"{(time_ns - run.start_ns) / 1e9:8.3f} {line.process} {line.stream}: {text}")
    return "".join(f"{line}\n" for line in lines)


def merge_channels(channels: Iterable[Channel], *, renumber: bool) -> tuple[Channel, ...]:
    """Join channels that differ in nothing but their messages: a publisher that connected twice.

    `renumber` counts each channel's messages from 0: other tools number them across channels, or not at all.
    """
    groups: dict[tuple[str, str, str, str, str], list[Channel]] = {}
    for one in channels:
        key = (one.topic, one.callerid, one.type, one.md5sum, one.definition)
        groups.setdefault(key, []).append(one)
    # Popped one by one, so that joined messages are not held twice.
    return tuple(_merge_group(groups.pop(key), renumber=renumber) for key in list(groups))


def _merge_group(group: list[Channel], *, renumber: bool) -> Channel:
    if len(group) == 1 and not renumber:
        return group[0]
    messages = sorted((m for one in group for m in one.messages), key=lambda message: message.log_time_ns)
    if renumber and any(m.sequence != number for number, m in enumerate(messages)):
        messages = [Message(m.log_time_ns, number, m.data) for number, m in enumerate(messages)]
    return replace(group[0], latching=any(one.latching for one in group), messages=tuple(messages))
