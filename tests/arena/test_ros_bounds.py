"""The arena's bounds one by one, without ROS: reading calls, sharing the recording, who may call in whose name."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import socket
import struct
import sys
import threading
import time
import xmlrpc.client
from types import ModuleType

import pytest

from grader.arena.session import ARENA

MB = 1 << 20


@pytest.fixture
def module(monkeypatch):
    """Modules of the arena, which run under ROS's Python as scripts beside each other."""
    monkeypatch.syspath_prepend(str(ARENA))

    def load(name: str) -> ModuleType:
        return importlib.import_module(name)

    return load


def call(value: str) -> bytes:
    return (
        f"<methodCall><methodName>m</methodName><params><param>{value}</param></params></methodCall>".encode()
    )


@pytest.mark.parametrize(
    "value", [1, -1.5, True, "<&>\u202e", [1, [2]], {"a": {"b": []}}, xmlrpc.client.Binary(b"\0\xff"), ""]
)
def test_calls_as_clients_write_them(module, value) -> None:
    assert module("xmlrpc_parser").read(xmlrpc.client.dumps((value,), "m").encode()) == ((value,), "m")


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b'<!DOCTYPE a [<!ENTITY a "b">]>' + call("<value>&a;</value>"), "a document type"),
        (call("<value><!-- --></value>"), "comments"),
        (call("<value>x</value>").decode().encode("utf-16"), "not text"),
        (call(f"<value {'a' * 200}>x</value>"), "more than a name"),
        (call("<value><array><data>" * 60), "nested too deeply"),
        (call("<value/>" * 200_001), "more than 200000 elements"),
        (call("<value><int>2147483648</int></value>"), "too large"),
        (call(f"<value><i8>{'9' * 1000}</i8></value>"), "too large"),
        (
            call("<value><struct><member><value><i4>1</i4></value><value/></member></struct></value>"),
            "not a string",
        ),
        (call("<value><nil/></value>"), "no XML-RPC"),
        (call("<value>\0</value>"), "not text"),
        (b"", "no XML-RPC"),
        (b"<methodCall>", "no XML-RPC"),
    ],
)
def test_calls_that_no_client_writes(module, data, why) -> None:
    strict = module("xmlrpc_parser")
    with pytest.raises(strict.Malformed, match=why):
        strict.read(data)


def budget(module, **limits):
    whole = {"channel_messages": 20_000, "channel_bytes": 64 * MB, "run_bytes": 64 * MB, "channels": 300}
    return module("quotas").Budget({**whole, **limits})


def key(topic: str) -> tuple[str, ...]:
    return topic, "/node", "std_msgs/String", "0" * 32, "string data\n"


def test_one_flood_leaves_room_for_the_next_and_for_everybody(module) -> None:
    shared = budget(module)
    flood, second, talker = (shared.open(key(topic), "attack") for topic in ("/flood", "/second", "/talker"))
    taken = [sum(account.take(MB) for _ in range(100)) for account in (flood, second)]
    assert taken == [31, 16]
    assert all(talker.take(8) for _ in range(300))
    assert not any(one.take(MB) for one in (flood, second, talker))
    assert flood.bytes + second.bytes + talker.bytes < 64 * MB


def test_a_channel_has_so_many_messages(module) -> None:
    account = budget(module, channel_messages=5).open(key("/a"), "p")
    assert [account.take(1) for _ in range(7)] == [True] * 5 + [False] * 2


def test_one_process_does_not_take_every_channel(module) -> None:
    shared = budget(module, channels=20)
    opened = [shared.open(key(f"/a{n}"), "attack") for n in range(40)]
    assert 8 <= sum(account is not None for account in opened) <= 11
    assert shared.open(key("/chatter"), "talker") is not None
    assert shared.open(key("/a0"), "attack") is opened[0]


class Fixed:
    """Owners as a test says."""

    def __init__(self, **owners: str) -> None:
        self.owners = {f"http://127.0.0.1:{port[1:]}/": owner for port, owner in owners.items()}

    def of(self, api: str) -> str | None:
        return self.owners.get(api)

    look = of


class Caller:
    def __init__(self, process: str | None) -> None:
        self.process = process


NEW, OLD, NOBODY, GRADER = (f"http://127.0.0.1:{port}/" for port in (1, 2, 3, 4))
TYPE = "std_msgs/String"


@pytest.mark.parametrize(
    ("method", "args", "why"),
    [
        ("registerPublisher", ("/new", "/t", TYPE, NEW), ""),
        ("registerPublisher", ("/old", "/t", TYPE, NEW), ""),
        ("registerPublisher", ("/old", "/t", TYPE, OLD), "registered /old with an address of old"),
        ("registerPublisher", ("/new", "/t", TYPE, OLD), "registered /new with an address of old"),
        (
            "registerPublisher",
            ("/old", "/t", TYPE, NOBODY),
            "for /old, a node of old, with an address that no process has",
        ),
        ("registerPublisher", ("/new", "/t", TYPE, NOBODY), ""),
        ("registerPublisher", ("/new", "/t", TYPE, GRADER), "which is not its own"),
        ("registerPublisher", ("/new", "/t", TYPE, "http://host/"), "which is not its own"),
        ("registerPublisher", ("/new", "/t" * 200, TYPE, NEW), "not a name"),
        ("registerPublisher", ("/new", "/t", "a/\x1b[31m", NEW), "not a name"),
        ("registerPublisher", ("/new", "/my-topic with odd letters ä", TYPE, NEW), ""),
        ("registerService", ("/new", "/s", "rosrpc://127.0.0.1:9", NEW), ""),
        ("registerService", ("/new", "/s", OLD, NEW), "an address of old"),
        ("subscribeParam", ("/old", NOBODY, "/p"), "with an address that no process has"),
        ("unregisterPublisher", ("/old", "/t", OLD), "unregistered /t of /old, a node of old"),
        ("unregisterPublisher", ("/old", "/t", NOBODY), ""),
        ("unregisterPublisher", ("/old", "/t", NEW), ""),
        ("unregisterParam", ("/old", OLD, "/p"), ""),
        ("unsubscribeParam", ("/old", OLD, "/p"), "unregistered /p of /old"),
        ("setParam", ("/rosout", "/p", 1), "in the name of /rosout"),
        ("setParam", ("/grader_actor_0123abcd", "/p", 1), "the grader's node"),
        ("setParam", ("/grader_recorder_0123abcd_knock", "/p", 1), "the grader's node"),
        ("setParam", ("/grader", "/p", 1), ""),
        ("setParam", ("/grader_helper", "/p", 1), ""),
        ("setParam", (5, "/p", 1), "not a string"),
        ("setParam", ("/old", "/p", "\0" * 5000), ""),
        ("shutdown", ("/new", "x"), "shut down"),
        ("getPid", (), ""),
    ],
)
def test_who_may_call_in_whose_name(module, method, args, why) -> None:
    registered = {"/old": OLD}.get
    rules = module("guard").Rules(Fixed(p1="new", p2="old"), registered, {4})
    found = rules.why_not(method, args, Caller("new"))
    assert (why in found) if why else found == ""


def test_who_takes_too_many_names(module) -> None:
    rules = module("guard").Rules(Fixed(), {}.get, set())

    most = module("guard").NAMES_MAX

    def register(process: str, number: int) -> bool:
        return rules.too_much("registerPublisher", ("/n", f"/t{number}", TYPE, NEW), Caller(process))

    assert [register("attack", number) for number in range(most + 2)] == [False] * most + [True] * 2
    assert not register("attack", 5)
    assert not register("talker", most + 1)


def test_names_count_as_they_are_written_down(module) -> None:
    """A letter outside of ASCII takes up to twelve in an event of the graph, which goes to the grader in one frame."""
    names = module("guard").Names()
    taken = [("registerPublisher", "/n", "\U0001f600" * 200 + str(number), TYPE) for number in range(2000)]
    size = sum(len(json.dumps(entry)) for entry in taken if names.take("attack", entry))
    assert size < 2 * module("guard").NAME_BYTES_MAX


def test_events_are_told_once_and_not_for_ever(module) -> None:
    told = []

    class Wire:
        def event(self, topic: str, record: dict[str, str]) -> None:
            told.append((topic, record))

    guard = module("guard").Guard(Wire())
    for number in range(100):
        guard.limit("p", f"limit {number // 2}")
        guard.refused("p" * 1000, f"refused {number}")
    assert [len([r for _, r in told if r["action"] == kind]) for kind in ("limit", "refused")] == [50, 50]
    assert max(len(r["actor"]) for _, r in told) == 256


def read_on(sock: socket.socket, size: int) -> None:
    while True:
        sock.recv(size)


def test_a_socket_is_waited_for_once(module) -> None:
    """A byte now and then buys no time, and endless bytes no memory."""
    bounded = module("bounded_sockets")
    with socket.create_server(("127.0.0.1", 0)) as server:
        sock = bounded.connect(server.getsockname()[1], 0.5, 1000)
        far, _ = server.accept()
        stop = threading.Event()
        drip = threading.Thread(target=lambda: [far.send(b"x") for _ in range(600) if not stop.wait(0.1)])
        drip.start()
        with pytest.raises(TimeoutError):
            read_on(sock, 1)
        assert drip.is_alive()
        stop.set()
        drip.join()
        sock.allow(5, 1000)
        far.sendall(b"x" * 2000)
        with pytest.raises(ConnectionAbortedError):
            read_on(sock, 600)
        sock.close()
        far.close()


def test_who_never_answers_takes_no_more_than_its_share(module) -> None:
    pool = module("quotas").Pool(workers_max=10, each_max=2)
    stuck, done = threading.Event(), threading.Event()
    for _ in range(50):
        assert pool.submit("mute", stuck.wait)
    assert pool.submit("talker", done.set)
    assert done.wait(300)
    stuck.set()


def test_a_job_does_not_wait_for_one_that_came_just_before_it(module) -> None:
    pool, ran, hung = module("quotas").Pool(), threading.Event(), threading.Event()
    pool.submit("first", lambda: None)
    deadline = time.monotonic() + 5
    while not pool._idle and time.monotonic() < deadline:
        time.sleep(0.001)
    with pool._changed:  # the idle worker cannot run before both are there
        pool.submit("never answers", lambda: hung.wait(10))
        pool.submit("another", ran.set)
    assert ran.wait(3)
    hung.set()


def test_many_keys_that_wait_are_not_counted_at_each_job(module, monkeypatch) -> None:
    pool, stuck, counted = module("quotas").Pool(workers_max=10), threading.Event(), []
    count = pool._startable
    monkeypatch.setattr(pool, "_startable", lambda: counted.append(1) or count())
    for key in range(500):
        assert pool.submit(key, stuck.wait)
    assert len(counted) <= 20
    stuck.set()


def test_a_job_is_run_that_comes_as_the_last_worker_leaves(module, monkeypatch) -> None:
    monkeypatch.setattr(module("quotas"), "IDLE_S", 0.01)
    pool, ran, found = module("quotas").Pool(workers_max=1), threading.Event(), []
    take = pool._next
    monkeypatch.setattr(pool, "_next", lambda: found.append(take()) or found[-1])

    class Changed(threading.Condition):
        def __exit__(self, *error: object) -> None:
            super().__exit__(*error)
            if found[-2:] == [None, None]:  # neither before nor after it was idle
                found.clear()
                pool.submit("late", ran.set)

    pool._changed = Changed()
    pool.submit("first", lambda: None)
    assert ran.wait(3)


def test_values_of_any_kind_fit_into_the_evidence(module) -> None:
    values = module("quotas")
    strange = {"b": xmlrpc.client.Binary(b"\0"), "l": [{"d": xmlrpc.client.DateTime(0)}, None, 1.5]}
    assert values.plain(strange, 10_000)["l"][1:] == [None, 1.5]
    assert values.plain("x" * 1000, 500) is None
    assert values.depth([[[]], {"a": [1]}], 10) == 3
    assert values.weight(["x" * 1000] * 10, 1 << 30) > 10_000
    assert values.weight(["x" * 1000] * 1000, 5000) < 10_000


class Printing:
    """A process of which one stream is read; `loop` calls nobody by itself."""

    def __init__(self, module, limits: dict[str, int]) -> None:
        self.process = module("processes").Process.__new__(module("processes").Process)
        self.told: list[dict[str, object]] = []
        known = {"_lines": 0, "_bytes": 0, "_entered": True, "printed_too_much": False, "name": "p"}
        self.process.__dict__.update(known, _limits=limits, _wire=self, loop=self)
        reader, self._end = os.pipe()
        self._file = os.fdopen(reader, "rb", buffering=0)
        module("processes").Lines(self.process, "stdout", self._file)

    def event(self, _topic: str, record: dict[str, object]) -> None:
        self.told.append(record)

    def add_reader(self, _file: object, call: object) -> None:
        self.call = call

    def prints(self, data: bytes) -> None:
        os.write(self._end, data)
        self.call()

    def close(self) -> None:
        os.close(self._end)
        self._file.close()


@pytest.mark.parametrize("data", [b"\n", b"x" * 99 + b"\n", b"\0" * 1000, b"y" * 4096 + b"\n"])
def test_what_is_printed_past_the_limit_is_thrown_away_unread(module, data: bytes) -> None:
    printing = Printing(module, {"output_lines": 500, "output_bytes": 1 << 20})
    begin = time.process_time()
    for _ in range(1000):
        printing.prints(data * ((1 << 16) // len(data)))
    printing.close()
    assert time.process_time() - begin < 5
    lines = [record for record in printing.told if "line" in record]
    assert len(lines) <= 501
    assert sum(len(str(record["line"])) for record in lines[:-1]) <= 1 << 20
    limits = [record["detail"] for record in printing.told if record.get("action") == "limit"]
    assert limits == ["printed more than 500 lines or 1 MB"]


def test_of_thousands_of_sockets_on_one_port_some_are_looked_at(module, monkeypatch) -> None:
    sockets = module("sockets")
    monkeypatch.setattr(sockets, "SOCKETS_MAX", 20)
    held = [socket.socket() for _ in range(40)]
    for number, one in enumerate(held):
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        one.bind(("127.0.0.1", held[0].getsockname()[1] if number else 0))
        one.listen()
    found = sockets.listening(held[0].getsockname()[1])
    inodes = {os.fstat(one.fileno()).st_ino for one in held}
    for one in held:
        one.close()
    assert 20 <= len(found) <= 40  # of each address family
    assert set(found) <= inodes


@pytest.mark.parametrize(("most", "asked"), [(10, 1), (90, 1), (91, 5)], ids=["little", "the limit", "more"])
def test_each_socket_is_asked_about_where_all_of_the_machine_hold_enough(
    module, monkeypatch, most: int, asked: int
) -> None:
    """Below the limit, what they hold at most is enough to know."""
    sockets, questions = module("sockets"), []
    monkeypatch.setattr(sockets, "_memory_bytes", lambda *about: questions.append(about) or 10)
    monkeypatch.setattr(sockets, "_internet_bytes_at_most", lambda: most)
    assert sockets.buffer_bytes(100) == (10 + most if asked == 1 else 50)
    assert len(questions) == asked


def test_what_all_sockets_of_the_machine_hold_is_no_less_than_what_one_holds(module) -> None:
    server = socket.create_server(("127.0.0.1", 0))
    near = socket.create_connection(server.getsockname())
    near.setblocking(False)
    sent = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            sent += near.send(bytes(MB))
    assert sent > MB
    assert module("sockets")._internet_bytes_at_most() > sent
    near.close()
    server.close()


def test_who_has_very_many_files_open_is_looked_at_so_far_and_named(module, monkeypatch) -> None:
    owners = module("sockets")
    monkeypatch.setattr(owners, "FILES_MAX", 5)
    told = []
    known = owners.Owners(lambda: [("hoarder", [os.getpid()]), ("gone", [1 << 30])])
    known.tell = lambda actor, detail: told.append((actor, detail))
    known.callers([])
    assert told == [("hoarder", "had more than 5 files open: not all of them are looked at")]
    monkeypatch.setattr(owners, "FILES_MAX", 1 << 16)
    known.callers([])
    assert len(told) == 1


def header_of(**fields: str) -> bytes:
    parts = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(body)) + body


@pytest.fixture
def tcpros(monkeypatch):
    """ROS's own reading of headers, as far as these tests need it."""

    def decode(data: bytes) -> dict[str, str]:
        found, at = {}, 4
        while at < len(data):
            (size,) = struct.unpack_from("<I", data, at)
            name, _, value = data[at + 4 : at + 4 + size].decode().partition("=")
            found[name], at = value, at + 4 + size
        return found

    network = ModuleType("rosgraph.network")
    network.decode_ros_handshake_header = decode  # type: ignore[attr-defined]
    network.encode_ros_handshake_header = lambda fields: header_of(**fields)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "rosgraph", ModuleType("rosgraph"))
    monkeypatch.setitem(sys.modules, "rosgraph.network", network)
    for name in ("tcpros",):
        monkeypatch.delitem(sys.modules, name, raising=False)
    yield
    for name in ("tcpros",):
        sys.modules.pop(name, None)


@pytest.mark.usefixtures("tcpros")
@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (header_of(error="x" * 200_000), "x" * 500),
        (struct.pack("<I", 1 << 30), "connection header of"),
        (header_of(type="a/b") + b"\1" + struct.pack("<I", 1 << 30), "an answer of"),
        (header_of(type="a/b") + b"\0" + struct.pack("<I", 100_000) + b"y" * 100_000, "y" * 500),
        (header_of(type="a/b\x1b[31m"), "is not a name"),
    ],
)
def test_what_a_service_answers_is_bounded(module, answer: bytes, why: str) -> None:
    services = module("tcpros")
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            for _ in range(2):
                with contextlib.suppress(OSError):  # who has read enough hangs up
                    far, _ = server.accept()
                    with far:
                        far.recv(1 << 16)
                        far.sendall(answer)
                        far.recv(1 << 16)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        uri = f"rosrpc://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(services.ProtocolError) as failure:
            services.call_service("/s", uri, "/me", type_="a/b", request=b"", timeout_s=5)
    assert why in str(failure.value)
    assert len(str(failure.value)) <= 500
