"""One arena from the grader's side: starts it, commands it, writes what it tells into the evidence.

`Killed` says which processes were killed, and not by the arena: such a run says nothing about a student.
"""

from __future__ import annotations

import asyncio
import base64
import re
import secrets
import signal
import struct
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from typing_extensions import Self

from grader.arena.admission import MEMINFO, read_numbers
from grader.arena.arena_process import ArenaProcess
from grader.arena.control_groups import remove_groups
from grader.arena.process_environment import LOOPBACK, ProcessEnvironment, search_path
from grader.arena.ros.wire import Frame, FrameReader
from grader.arena.run_end import all_compute
from grader.arena.run_state import ROSOUT, RunState
from grader.arena.sandbox_files import HOME
from grader.errors import ArenaError
from grader.evidence.events import (
    NO_ANSWER,
    OTHER_TYPE,
    STOPPED,
    TOPICS,
    ActorEvent,
    ProcessEvent,
    ScenarioEvent,
)
from grader.evidence.run import is_grader_node, left_name
from grader.evidence.writer import EvidenceChannel, EvidenceWriter
from grader.files import open_untrusted
from grader.ros_env import RosInstallation

ARENA = Path(__file__).parent / "ros"
CLOCK = "/clock"
TIME = struct.Struct("<II")
WATCHED_MAX = 20
NS = 1_000_000_000
READY_S = 15.0
END_S = 5.0
GROUPS_S, LOOK_S = 5.0, 0.02
GRAPH_S, GRAPH_EVERY_S = 5.0, 0.25
CONNECTING_S = 3.0
"""So long at most nodes are waited for that have a topic in common and may yet connect over it."""
STUCK_S = 0.5
"""So long a call is waited for at least, though the programs only compute."""
PORT = 11311
LEFT_FILES_MAX = 200
"""So many of the files that a run leaves are events."""


def arena_command(ros: RosInstallation) -> tuple[list[str], dict[str, str]]:
    """Return the managed roscore's command, and its environment: ROS and nothing of the shell's."""
    env = {"LANG": "C.UTF-8", "ROS_IP": LOOPBACK, **ros.env, "PATH": search_path(ros, "")}
    # -s: no packages of the user's own. -B: no compiled files beside the grader's sources.
    return [ros.python, "-s", "-B", str(ARENA)], env


class _Channel(NamedTuple):
    topic: str
    callerid: str
    evidence: EvidenceChannel


class ArenaSession:
    """`async with ArenaSession(…) as arena`: inside, the managed roscore runs (or, without `master`, only processes).

    Raises ArenaError when it does not start or dies. Times are those of its start plus monotonic time, as the arena's
    own are: a clock that is set while it runs moves none of them. `last_run` says that it will not be run again.
    `calibrated` says that a calibration publisher runs beside it, which tells what a sleep takes here: rates need it.
    `on_lateness` is told how late the machine is (ms, 95th percentile) as the arena measures it.
    """

    def __init__(
        self,
        place: ProcessEnvironment,
        writer: EvidenceWriter,
        *,
        master: bool = True,
        calibrated: bool = True,
        last_run: bool = False,
        on_lateness: Callable[[float], None] = lambda _: None,
    ) -> None:
        self.live = RunState()
        self.cpu_s = 0.0
        self.student_cpu_s = 0.0
        self.exit_codes: dict[str, int | None] = {}
        self.place = place
        self._writer = writer
        self._master = master
        self._calibrated = calibrated
        self._changed = asyncio.Event()
        self._channels: dict[int, _Channel] = {}
        self._ready = False
        self._done = False
        self._failure = ""
        self._error: Exception | None = None
        self._killed = Killed(sandboxed=place.sandbox.bubblewrap)
        self._left = LeftFiles(place, writer)
        self._last_run = last_run
        self._on_lateness = on_lateness
        self._offset_ns = time.time_ns() - time.monotonic_ns()
        self._frames = FrameReader()
        self._calls = 0
        self._answers: dict[int, dict[str, Any]] = {}
        self._clock_ns = 0
        self._watched: dict[str, deque[bytes]] = {}
        self.last_from: dict[str, str] = {}
        self._printed: dict[str, deque[str]] = {}
        self.on_request = self.on_other_type = _ignore

    async def __aenter__(self) -> Self:
        self._process = ArenaProcess(*arena_command(self.place.ros), self._read)
        self.cpu_s += self._process.cpu_s
        try:
            self.send(**self._config())
            await self._await_ready()
        except BaseException:
            await self._end()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._end()

    async def _end(self) -> None:
        """End the arena, and remove the groups that it could not remove itself: it was killed, or the kernel still
        frees what processes of theirs had."""
        await self._process.end()
        until_s = time.monotonic() + GROUPS_S
        while not remove_groups(self.place.sandbox.cgroups, self._process.pid):
            if time.monotonic() > until_s:
                break
            await asyncio.sleep(LOOK_S)

    async def _await_ready(self) -> None:
        if not await self.wait(lambda: self._ready, READY_S):
            raise ArenaError(f"the managed roscore did not start: {self._why()}", hint="grader doctor")

    def send(self, **command: Any) -> None:  # noqa: ANN401 - JSON
        """Send the arena one command (grader/arena/ros/__main__.py has a method for each)."""
        self._process.send(command)

    def start(self, spec: dict[str, Any]) -> None:
        self.live.note_start(spec["name"], time.monotonic(), helper=spec["role"] == "grader")
        self.exit_codes.pop(spec["name"], None)
        self._killed.starting(spec["name"])
        self.send(do="start", spec=spec)

    async def run_to_end(self, spec: dict[str, Any], limit_s: float, *, int_s: float = 1.0) -> bool:
        """Start a process and return whether it came to its end in time; else it is interrupted."""
        name = spec["name"]
        self.start(spec)
        ended = await self.wait(lambda: name in self.exit_codes, limit_s)
        if not ended:
            await self.interrupt(name, int_s=int_s, term_s=1.0)
        return ended

    async def interrupt(self, name: str, *, int_s: float, term_s: float, action: str = "interrupt") -> None:
        """Send Ctrl-C, TERM after `int_s`, and KILL after another `term_s`. Return when the process has ended.

        `action` is how the evidence calls it: with `kill`, it is KILL at once.
        """
        self._killed.stopping(name)
        self.send(do="interrupt", name=name, int_s=int_s, term_s=term_s, action=action)
        await self.wait(lambda: name in self.exit_codes, int_s + term_s + END_S)

    async def look_at_connections(self) -> None:
        """Have the connections between nodes recorded as they are now."""
        looks = self.live.graphs
        self.send(do="graph")
        await self.wait(lambda: self.live.graphs > looks or not self.live.running, GRAPH_S)

    async def await_connections(self) -> None:
        """Wait until the nodes that have a topic in common are connected over it, or have had their time to: what one
        sends before that, the other never hears."""
        live, until_s = self.live, time.monotonic() + CONNECTING_S
        while live.shared and live.running and time.monotonic() < until_s:
            await self.look_at_connections()
            if live.shared <= live.connected_s.keys():
                return
            await self.wait(lambda: not live.running, GRAPH_EVERY_S)

    def watch(self, topic: str) -> deque[bytes]:
        """Return where the latest messages on a topic will be, as they come; whose the last is, `last_from` says."""
        return self._watched.setdefault(topic, deque(maxlen=WATCHED_MAX))

    def watch_console(self, process: str) -> deque[str]:
        """Return where the latest lines on a process's stdout will be, as they come."""
        return self._printed.setdefault(process, deque(maxlen=WATCHED_MAX))

    def course(self, event: ScenarioEvent) -> None:
        self._writer.event("/grader/scenario", self.now_ns(), event)

    def note(self, event: ActorEvent, time_ns: int | None = None) -> None:
        """Write down what the grader did, or learnt: now, or when the arena did."""
        self._writer.event("/grader/actor", self.now_ns() if time_ns is None else time_ns, event)

    async def call(self, timeout_s: float, **command: Any) -> dict[str, Any]:  # noqa: ANN401 - JSON
        """Call a service: `{"data": base64}` of its response, or `{"error": why not}`."""
        self._calls += 1
        number = self._calls
        self.send(do="call", id=number, timeout_s=timeout_s, **command)
        begun_s = time.monotonic()
        patient_s = begun_s - self.live.lost_s + STUCK_S

        def is_over() -> bool:
            stuck = time.monotonic() - self.live.lost_s > patient_s and all_compute(self.live)
            return number in self._answers or stuck

        if not await self.wait(is_over, timeout_s + END_S) or number not in self._answers:
            after_s = min(timeout_s, time.monotonic() - begun_s)
            return {"error": f"{NO_ANSWER} {after_s:.3g} s"}
        return self._answers.pop(number)

    async def wait(self, condition: Callable[[], bool], timeout_s: float, *, exact: bool = False) -> bool:
        """Wait until the condition holds; False when it does not in time. Time that others took of a full machine does
        not count, unless the time is to be `exact`. Raises ArenaError if the arena dies."""

        def now_s() -> float:
            # `lost_s` grows while others fill the machine, and moves the deadline with it.
            return time.monotonic() - (0.0 if exact else self.live.lost_s)

        deadline = now_s() + timeout_s
        while True:
            self._raise_failure()
            if condition():
                return True
            left = deadline - now_s()
            if left <= 0:
                return False
            # Cleared after the condition was looked at, in one thread: no change can come between the two.
            self._changed.clear()
            timer = asyncio.get_running_loop().call_later(left, self._changed.set)
            try:
                await self._changed.wait()
            finally:
                timer.cancel()

    def _raise_failure(self) -> None:
        """Raise the arena's failure, even where what was waited for has come: something else is missing then."""
        if self._error is not None:
            raise self._error
        if self._failure:
            raise ArenaError(f"the managed roscore ended: {self._why()}", hint="grade again")

    async def finish(self) -> None:
        """Let the arena stop what is left and give its last frames. Raises ArenaError where they do not come, or where
        a process was killed, and not by the arena: the machine had no memory for it, or a person ended it."""
        self.send(do="finish")
        if not await self.wait(lambda: self._done, END_S):
            raise ArenaError("the managed roscore did not shut down cleanly", hint="grade again")
        killed = self._killed.first(last_run=self._last_run)
        if killed:
            raise ArenaError(
                f"{killed} was killed (SIGKILL), and not by the grader: the machine may be out of memory",
                hint="grade again",
            )

    def _config(self) -> dict[str, Any]:
        return {
            "master": self._master,
            "calibrated": self._calibrated,
            "stage": self.place.stage(),
            "cgroups": self.place.sandbox.cgroups.model_dump(),
            # In a sandbox the network is the run's own, so the usual port is free: outside, the system chooses one.
            "port": PORT if self.place.sandbox.bubblewrap else 0,
            "limits": self.place.limits.model_dump(),
            "suffix": "_" + secrets.token_hex(4),
        }

    def _read(self, chunk: bytes) -> None:
        try:
            for frame in self._frames.feed(chunk):
                self._take(frame)
        except (ValueError, KeyError) as error:
            self._failure = f"it sent something that is not a frame: {type(error).__name__}"
        except Exception as error:  # noqa: BLE001 - the disk, the memory: `wait` raises it where it is heeded
            self._error = error
        # After `done` the output ends as it should.
        if not chunk and not self._done:
            self._failure = self._failure or "its output ended"
        self._changed.set()

    def _take(self, frame: Frame) -> None:
        if frame.kind == "M":
            self._messages(frame)
        elif frame.kind == "E":
            self._event(frame)
        elif frame.kind == "S":
            self._status(frame.time_ns, frame.fields)
        else:
            fields = frame.fields
            number, topic, caller_id = fields.pop("id"), fields["topic"], fields["callerid"]
            self._channels[number] = _Channel(topic, caller_id, self._writer.register_channel(**fields))

    def _messages(self, frame: Frame) -> None:
        channel = self._channels[frame.channel]
        for data in frame.datas:
            channel.evidence.message(frame.time_ns, data)
        if frame.datas and channel.topic == CLOCK and is_grader_node(channel.callerid):
            secs, nsecs = TIME.unpack(frame.datas[-1])
            self._clock_ns = secs * NS + nsecs
        if frame.datas and not is_grader_node(channel.callerid):
            # A helper's messages may be waited for as well, and are no sign that the student's nodes do anything.
            own = channel.callerid not in self.live.helper_nodes
            if channel.topic != ROSOUT:
                self.live.talking.setdefault(channel.callerid, time.monotonic())
            if channel.topic in self._watched:
                self._watched[channel.topic].extend(frame.datas)
                self.last_from[channel.topic] = channel.callerid
            self.live.note_messages(channel.topic, len(frame.datas), time.monotonic(), active=own)
            self.live.note_arrivals(channel.topic, len(frame.datas), frame.time_ns)

    def _event(self, frame: Frame) -> None:
        topic, record = frame.fields["topic"], frame.fields["record"]
        self._writer.event(topic, frame.time_ns, TOPICS[topic].model_validate(record))
        if topic == "/grader/graph":
            nodes = [n for n in record["nodes"] if not is_grader_node(n)]
            # Connections are asked for again and again, and say nothing of what is registered.
            picture = {key: value for key, value in record.items() if key != "connections"}
            self.live.note_graph(nodes, record["processes"], time.monotonic(), picture=picture)
            self.live.services = set(record["services"])
            self.live.published = _of(nodes, record["publishers"])
            self.live.listened = _of(nodes, record["subscribers"])
        elif topic == "/grader/console":
            self._print(**record)
        elif topic == "/grader/process" and record["event"] == "exit":
            self._note_exit(record)
        elif topic == "/grader/host":
            self._on_lateness(record["p95_ms"])
            self.live.note_machine(record["busy"], record["own_busy"], time.monotonic())
        elif topic == "/grader/param" and not is_grader_node(record["caller_id"]):
            self.live.note_activity(time.monotonic())
        elif topic == "/grader/actor":
            self._acted(record)
        elif topic == "/grader/recorder" and record["event"] == "limit":
            self.live.unrecorded.add((record["topic"], record["callerid"]))
        elif topic == "/grader/recorder" and record["event"] == "closed":
            self.live.unrecorded.discard((record["topic"], record["callerid"]))

    def _acted(self, record: dict[str, Any]) -> None:
        """Take note of what the arena says that a process or a node did, or was refused."""
        if record["action"] == "limit":
            if record["detail"].startswith(STOPPED):
                self._killed.limited(record["actor"])
        elif record["action"] == "lookup":
            self.live.note_lookup(record["actor"], record["topic"], is_there=not record["detail"])
        elif record["action"] == "note" and record.get("detail") == OTHER_TYPE:
            self.live.refused.add(record["topic"])
        elif record["action"] == "open":
            self.live.opened.add(record["actor"])
            self.live.note_activity(time.monotonic())

    def _print(self, process: str, stream: str, line: str, **_: object) -> None:
        self._killed.printed(process, line)
        if stream == "stdout" and process in self._printed:
            self._printed[process].append(line)
        if process in self.live.running | self.live.ended:
            self.live.note_line(line, time.monotonic(), process)

    def _note_exit(self, record: dict[str, Any]) -> None:
        name = record["name"]
        if record["role"] == "grader":
            self.cpu_s += record["cpu_s"]
        else:
            self.student_cpu_s += record["cpu_s"]
        self.exit_codes[name] = record["exit_code"]
        if self._master or record["role"] != "student":  # what a build only tries out may end as it likes
            self._killed.ended(record)
        self.live.note_exit(name, time.monotonic())

    def _status(self, time_ns: int, fields: dict[str, Any]) -> None:
        status = fields["status"]
        if status == "ready":
            self._ready = True
        elif status == "subscribed" and not is_grader_node(fields["subscriber"]):
            self.live.subscribers.setdefault(fields["topic"], set()).add(fields["subscriber"])
        elif status == "rest":
            self.live.note_rest(fields["name"], fields["rest"], fields["programs"], time.monotonic())
        elif status == "answer":
            self._answers[fields["id"]] = fields
        elif status == "left":
            self._left.add(fields["name"], fields["path"], fields["bytes"], fields["data"], self.now_ns())
        elif status in {"request", "other-type"}:
            self._note_service_call(time_ns, fields)
        elif status == "graph":
            pairs = [c for c in fields["connections"] if not is_grader_node(c["subscriber"])]
            topics = {c["topic"] for c in pairs}
            self.live.note_connections(topics, time.monotonic(), answered=fields["answered"])
            self.live.graphs += 1
        elif status == "spawn-failed":
            message = f"{fields['name']} could not be started: {fields['detail']}"
            self._error = self._error or ArenaError(message, hint="grader doctor")
        elif status == "done":
            self._note_cost(fields)
            self._done = True

    def _note_service_call(self, time_ns: int, fields: dict[str, Any]) -> None:
        """Handle a client's call of a service that the grader offers, by its type or by another one."""
        if fields["status"] == "request":
            self.live.note_activity(time.monotonic())
            self.on_request(time_ns, fields)
        else:
            self.on_other_type(time_ns, fields)

    def _note_cost(self, fields: dict[str, Any]) -> None:
        """Take note of what the arena itself took: CPU seconds, and bytes of memory at its peak."""
        self.cpu_s += fields["cpu_s"]
        event = ProcessEvent(
            event="exit",
            name="arena",
            role="grader",
            cpu_s=round(fields["cpu_s"], 4),
            max_rss_bytes=fields["max_rss_bytes"],
        )
        self._writer.event("/grader/process", self.now_ns(), event)

    def ros_now_ns(self) -> int:
        """Return the time of the run's nodes: `/clock` where there is one."""
        return self._clock_ns or self.now_ns()

    def now_ns(self) -> int:
        """Return the time as the evidence has it."""
        return self._offset_ns + time.monotonic_ns()

    def _why(self) -> str:
        return f"{self._failure} {self._process.last_words()}".strip() or "it did not answer"


def _ignore(time_ns: int, fields: dict[str, Any]) -> None:
    """Ignore a call of one of the grader's services: when it was, and what the arena says."""


def _of(nodes: list[str], topics: Mapping[str, list[str]]) -> dict[str, set[str]]:
    """Return which of these nodes each topic has; topics that have none of them are left out."""
    found = {topic: {*callers} & {*nodes} for topic, callers in topics.items()}
    return {topic: own for topic, own in found.items() if own}


class LeftFiles:
    """The files that a run's processes left, as `ros/processes.py` reads them.

    Each is an event, and what is kept of it an attachment, within the run's limits. A file of the package that is as it
    was handed in is not left by the run.
    """

    def __init__(self, place: ProcessEnvironment, writer: EvidenceWriter) -> None:
        self._place, self._writer = place, writer
        self._left_bytes, self._left_files = place.limits.kept_bytes, place.limits.kept_files
        self._listed = 0

    def add(self, process: str, path: str, size_bytes: int, data: str | None, time_ns: int) -> None:
        """Add a file by its path in the sandbox; `data` is base64, or None where the arena does not keep it."""
        content = None if data is None else base64.b64decode(data)
        if self._listed >= LEFT_FILES_MAX or self._is_handed_in(path, size_bytes, content):
            return
        self._listed += 1
        shown = path.replace(HOME, "~", 1)
        event = ActorEvent(action="left", actor=process, value=size_bytes, detail=shown)
        self._writer.event("/grader/actor", time_ns, event)
        if content is not None and self._left_files and len(content) <= self._left_bytes:
            self._left_bytes -= len(content)
            self._left_files -= 1
            self._writer.attach(left_name(process, shown), content, time_ns, "application/octet-stream")

    def _is_handed_in(self, path: str, size_bytes: int, content: bytes | None) -> bool:
        sources = PurePosixPath(self._place.inside_workspace, "src")
        if not PurePosixPath(path).is_relative_to(sources):
            return False
        inside = PurePosixPath(path).relative_to(sources).parts
        try:
            with open_untrusted(self._place.workspace.repaired, *inside) as file:
                # One byte more shows a file that was longer.
                before = file.read(size_bytes + 1)
        except OSError:
            return False
        return len(before) == size_bytes and content in {None, before}


SHORT = 0.1
"""Where less than this part of the memory is available, helpers of the system (earlyoom, systemd-oomd) kill too."""
BELOW = re.compile(r"Killed signal terminated program|process has died \[pid \d+, exit code -9,")
"""What the compiler's driver and roslaunch say of a process of theirs that SIGKILL ended."""


class Killed:
    """The processes of one run that were killed, and not by the arena: by the kernel of a machine without memory, by
    a person, or by their own program. Those that broke a limit are not among them.

    A program that kills itself looks like one that is killed once. One that is killed in every run, while the
    machine has memory, has done it itself: nothing in a sandbox can kill the sandbox's own process.
    """

    def __init__(self, *, sandboxed: bool) -> None:
        self._sandboxed = sandboxed
        self._names: dict[str, None] = {}
        self._from_outside = False
        self._limited: set[str] = set()
        self._stopping: set[str] = set()
        self._kills_before = _kernel_kills()

    def stopping(self, name: str) -> None:
        """Take note that from now on the grader ends the process."""
        self._stopping.add(name)

    def starting(self, name: str) -> None:
        """Take note that from now on the process ends by itself again."""
        self._stopping.discard(name)

    def limited(self, name: str) -> None:
        self._limited.add(name)

    def printed(self, name: str, line: str) -> None:
        if name not in self._stopping and BELOW.search(line):
            self._names[name] = None

    def ended(self, record: dict[str, Any]) -> None:
        """Take note of a process's last event."""
        if record["signal"] == signal.SIGKILL and record["stopped_by"] is None:
            self._names[record["name"]] = None
            self._from_outside |= self._sandboxed and record["exit_code"] is None

    def first(self, *, last_run: bool) -> str:
        """Return the name of a process that the machine may have killed, or nothing."""
        short_of_memory = _kernel_kills() != self._kills_before or _available() < SHORT
        own = last_run and not self._from_outside and not short_of_memory
        return "" if own else next((name for name in self._names if name not in self._limited), "")


def _kernel_kills() -> int:
    """Return how often this machine's kernel has killed a process for lack of memory
    (Documentation/filesystems/proc)."""
    return read_numbers(Path("/proc/vmstat")).get("oom_kill", 0)


def _available() -> float:
    """Return the part of this machine's memory that is available."""
    memory = read_numbers(MEMINFO)
    return memory.get("MemAvailable", 0) / memory.get("MemTotal", 1)
