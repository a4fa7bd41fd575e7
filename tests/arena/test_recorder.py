"""From a publisher's socket to the evidence: nothing is lost, nothing changed, and what is dropped is counted."""

from __future__ import annotations

import importlib
import os
import random
import select
import socket
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from grader.arena.limits import RunLimits
from grader.arena.ros.wire import Frame, FrameReader
from grader.arena.session import ARENA
from grader.checks import CHECKS
from grader.checks.support.recorder_losses import account_for_losses, losses
from grader.judging.facts import NO_PACKAGE as PACKAGE
from tests.arena.support import printed, run_script

LIMITS = {"channel_messages": 1 << 40, "channel_bytes": 1 << 40, "run_bytes": 1 << 40, "channels": 300}
HEADER = {"type": "std_msgs/String", "md5sum": "0" * 32, "message_definition": "string data\n"}


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    monkeypatch.syspath_prepend(str(ARENA))
    return importlib.import_module


class Around:
    """As much of recorder, wire and loop as a connection speaks to."""

    def __init__(self, counts: int = 1 << 40) -> None:
        self.wire = self.loop = self
        self.data = bytearray()
        self.events: list[tuple[str, dict[str, Any]]] = []
        self.later: list[Callable[[], None]] = []
        self.look: Callable[[], None] | None = None
        self.congested = False
        self.reserved = 0
        self.to_count = counts

    @property
    def counts(self) -> bool:
        return self.to_count > 0

    def count(self, messages: int) -> None:
        self.to_count -= messages

    def reserve(self, size: int) -> bool:
        self.reserved += size
        return True

    def release(self, size: int) -> None:
        self.reserved -= size

    def messages(self, _channel: int, pieces: list[bytes], _time_ns: int) -> None:
        for piece in pieces:
            self.data += piece

    def channel(self, **_: object) -> int:
        return 1

    def note(self, event: str, *_: object, **fields: Any) -> None:
        self.events.append((event, fields))

    def overflows(self, _connection: object, messages: int, _time_ns: int) -> None:
        self.events.append(("limit", {"messages": messages}))

    def add_reader(self, _sock: socket.socket, look: Callable[[], None]) -> None:
        self.look = look

    def remove_reader(self, _sock: socket.socket) -> None:
        self.look = None

    def pass_on(self, _topic: str, _pieces: list[bytes]) -> None:
        """Nobody else listens."""

    def call_later(self, _seconds: float, work: Callable[[], None]) -> None:
        self.later.append(work)

    def ask_latching(self, _connection: object) -> None:
        """Nobody answers: what came is held until a test opens the channel, or the stream ends."""

    def closed(self, _connection: object) -> None:
        self.remove_reader(SimpleNamespace())  # type: ignore[arg-type] # there is only one

    @property
    def totals(self) -> dict[str, Any]:
        return next(fields for event, fields in self.events if event == "closed")


@pytest.fixture
def connected(module) -> Iterator[Callable[..., tuple[Any, socket.socket]]]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        open_: list[socket.socket] = []

        def connect(around: Around, **limits: int) -> tuple[Any, socket.socket]:
            sock = socket.create_connection(server.getsockname())
            far, _ = server.accept()
            open_.extend((sock, far))
            far.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.setblocking(False)
            account = module("quotas").Budget({**LIMITS, **limits}).open(("/c", "/n"), "p")
            connection = module("connection").Connection(
                around, sock, topic="/c", caller_id="/n", header=HEADER, account=account
            )
            return connection, far

        yield connect
        for sock in open_:
            sock.close()


def framed(*datas: bytes) -> bytes:
    return b"".join(struct.pack("<I", len(data)) + data for data in datas)


def pour(around: Around, connection: Any, far: socket.socket, stream: bytes, sizes: Iterator[int]) -> None:
    """Send it in pieces of these sizes, and take each as it comes; then end the stream."""
    at = 0
    while at < len(stream):
        piece = stream[at : at + next(sizes)]
        far.sendall(piece)
        at += len(piece)
        drain(connection)
    far.close()
    until_closed(around, connection)


def drain(connection: Any) -> None:
    while connection.readable():
        pass


def until_closed(around: Around, connection: Any) -> None:
    while "closed" not in dict(around.events):
        assert select.select([connection.sock], [], [], 5)[0], "the stream did not end"
        connection.readable()


@pytest.mark.parametrize("seed", range(12))
def test_a_stream_is_recorded_as_it_was_sent_however_it_comes(connected, seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - a fixed choice
    longest = rng.choice((1, 30, 5_000, 70_000, 700_000))
    datas = [rng.randbytes(rng.randint(0, longest)) for _ in range(min(400, 3_000_000 // longest))]
    largest = rng.choice((1, 7, 1_000, 50_000)) if longest < 10_000 else 100_000
    around = Around()
    connection, far = connected(around)
    pour(around, connection, far, framed(*datas), iter(lambda: rng.randint(1, largest), 0))
    assert bytes(around.data) == framed(*datas)
    assert around.totals == {"messages": len(datas), "dropped": 0, "detail": ""}
    assert around.reserved == 0


@pytest.mark.parametrize(
    ("sizes", "limits"),
    [
        ([0] * 30_000, {"channel_messages": 500}),
        ([1, 300, 2] * 5_000, {"channel_messages": 500}),
        ([200_000] * 50, {"channel_messages": 3}),
        ([200_000, 8] * 30, {"channel_bytes": 500_000}),
    ],
)
def test_what_is_dropped_is_counted_one_by_one(connected, sizes: list[int], limits: dict[str, int]) -> None:
    around = Around()
    connection, far = connected(around, **limits)
    pour(around, connection, far, framed(*map(bytes, sizes)), iter(lambda: 50_001, 0))
    kept = around.totals["messages"]
    assert 0 < kept < len(sizes)
    assert around.totals == {"messages": kept, "dropped": len(sizes) - kept, "detail": ""}
    assert around.events[0][0] == "limit"


def test_millions_are_counted_by_their_bytes(connected) -> None:
    around = Around(counts=10_000)
    connection, far = connected(around, channel_messages=100)
    pour(around, connection, far, framed(*[b"1234"] * 100_000), iter(lambda: 50_000, 0))
    assert around.totals["dropped"] == pytest.approx(99_900, rel=0.01)
    assert around.totals["detail"] == "as many as its bytes say"


def test_a_length_that_no_message_has_ends_the_recording(connected) -> None:
    around = Around()
    around.too_large = lambda *_: None  # type: ignore[attr-defined]
    connection, far = connected(around)
    far.sendall(framed(b"sound") + struct.pack("<I", 17 << 20) + b"x" * 100)
    until_closed(around, connection)
    assert bytes(around.data) == framed(b"sound")
    assert [event for event, _ in around.events] == ["invalid", "closed"]


def test_who_has_to_wait_for_the_grader_is_named_once(connected) -> None:
    around = Around()
    connection, far = connected(around, run_bytes=1 << 20)
    pour_in = framed(*[b"x" * 1000] * 20)
    far.sendall(pour_in)
    assert select.select([connection.sock], [], [], 5)[0]
    drain(connection)
    connection.open(latching=False)
    assert len(around.data) > 4000
    around.congested = True
    for _ in range(3):
        connection.watch()
        assert around.look is not None
        around.look()
        assert around.look is None, "it rests"
    assert [event for event, _ in around.events] == ["behind"]
    around.congested = False
    around.later.pop()()
    assert around.look is not None


def test_frames_come_whole_and_in_order_through_the_pipe(module) -> None:
    wire_module = module("wire")
    read_end, write_end = os.pipe()
    wire = wire_module.Wire(write_end)
    large = bytes(range(256)) * 4000
    channel = wire.channel(topic="/c", callerid="/n")
    for number in range(50):
        wire.messages(channel, [framed(b"a%d" % number, b""), framed(b"b")], 1000 + number)
    wire.messages(channel, [framed(large)], 2000)
    wire.event("/grader/console", {"line": "x"}, 3000)
    wire.status("done")
    frames = list(_frames(read_end, until="S"))
    wire.flush()
    os.close(read_end)
    messages = [frame for frame in frames if frame.kind == "M"]
    assert [f.kind for f in frames] == ["C", *["M"] * 51, "E", "S"]
    assert [f.datas for f in messages] == [[b"a%d" % n, b"", b"b"] for n in range(50)] + [[large]]
    assert [f.time_ns for f in messages] == [*range(1000, 1050), 2000]
    assert {f.channel for f in messages} == {channel}


def _frames(descriptor: int, until: str) -> Iterator[Frame]:
    reader = FrameReader()
    while True:
        for frame in reader.feed(os.read(descriptor, 100_000)):
            yield frame
            if frame.kind == until:
                return


FLOOD = """
import rospy
from std_msgs.msg import Int32
rospy.init_node('talker')
publisher = rospy.Publisher('/numbers', Int32)
for number in range(8000):
    publisher.publish(number)
print('sent', number + 1, flush=True)
rospy.sleep(0.5)
"""


@pytest.mark.ros
@pytest.mark.filterwarnings("ignore")
def test_a_run_says_how_many_messages_it_dropped_and_so_do_its_verdicts(tmp_path: Path) -> None:
    seen = run_script(tmp_path, FLOOD, limits=RunLimits(channel_messages=1000), ended=("node",), limit_s=30)
    assert "sent 8000" in printed(seen)
    (channel,) = seen.student_channels("/numbers")
    assert list(channel.data) == list(range(1000))
    lost = losses(seen, "/numbers")
    assert lost is not None
    assert (lost.kept, lost.dropped) == (1000, 7000)
    params = {"topic": "/numbers", "rate_hz": 100_000}
    asked = {"package": PACKAGE, "run": seen, "params": CHECKS["counter-step"].params.model_validate(params)}
    check = CHECKS["counter-step"]
    verdict = account_for_losses(check, asked, check.function(**asked))
    # On a full machine the recorder may fall behind such a flood, and then too little came whole
    behind = any(event.event == "behind" for _, event in seen.recorder)
    assert verdict.status.value == ("inconclusive" if behind else "pass"), verdict.message
    told = verdict.message if behind else verdict.measured
    assert told.endswith("; the recorder kept 1000 messages of /numbers, dropped 7000")
