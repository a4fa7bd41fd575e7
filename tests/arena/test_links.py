"""Whose word counts when two nodes say whether they are connected, and what the kernel says of it."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from typing_extensions import Self

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "grader" / "arena" / "ros"))
import links
import sockets
from guard import Guard
from links import Ties
from sockets import Owners

Entries = list[Any]


class Node:
    """Says of itself what it is told to."""

    def __init__(self, *answers: Entries) -> None:
        """One answer a round, the last one for ever."""
        self._answers = list(answers)
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._server.register_function(self._say, "getBusInfo")
        self.api = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def _say(self, _caller: str) -> list[Any]:
        answer = self._answers.pop(0) if len(self._answers) > 1 else self._answers[0]
        return [1, "", answer]

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


class Kernel:
    """Stands for `Ties`."""

    def __init__(self, *, joined: bool | None = True, half_closed: bool = False) -> None:
        self._joined, self._half_closed = joined, half_closed

    def __call__(self, _owners: object, _calls: object) -> Kernel:
        return self

    def joined(self, *_: str) -> bool | None:
        return self._joined

    def half_closed(self, _node: str) -> bool:
        return self._half_closed


class Wire:
    def __init__(self) -> None:
        self.refused: list[str] = []

    def event(self, _topic: str, record: dict[str, str]) -> None:
        self.refused.append(f"{record['actor']} {record['detail']}")


class Known:
    """Stands for `Owners`."""

    def known(self, _api: str) -> str:
        return "process"


@pytest.fixture
def node() -> Iterator[Callable[..., Node]]:
    made: list[Node] = []

    def make(*answers: Entries) -> Node:
        made.append(Node(*answers))
        return made[-1]

    yield make
    for one in made:
        one.close()


def serves(subscriber: str = "/b", topic: str = "/t") -> Entries:
    return [
        1,
        subscriber,
        "o",
        "TCPROS",
        topic,
        True,
        "TCPROS connection on port 1 to [127.0.0.1:2 on socket 3]",
    ]


def hears(publisher: str, topic: str = "/t") -> Entries:
    return [1, publisher, "i", "TCPROS", topic, 1]


def rounds(monkeypatch: pytest.MonkeyPatch, kernel: Kernel, apis: dict[str, str], count: int = 4) -> Any:
    """What each of some rounds gives, and what was refused in them."""
    wire = Wire()
    monkeypatch.setattr(links, "Ties", kernel)
    asked = links.Links("/grader", Known(), Guard(wire))
    return [asked.of(apis)[0] for _ in range(count)], wire.refused


REFUSED = ["process said that /b is connected to /a over /t, which is not so"]
FOUND = [{"topic": "/t", "publisher": "/a", "subscriber": "/b"}]


@pytest.mark.parametrize("joined", [True, None])
def test_both_say_so_and_the_kernel_does_not_deny_it(node, monkeypatch, joined) -> None:
    publisher = node([serves()])
    subscriber = node([hears(publisher.api)])
    apis = {"/a": publisher.api, "/b": subscriber.api}
    assert rounds(monkeypatch, Kernel(joined=joined), apis) == ([FOUND] * 4, [])


@pytest.mark.parametrize("host", ["robot", "localhost", "[::1]"])
def test_a_subscriber_may_call_the_publishers_host_what_it_likes(node, monkeypatch, host) -> None:
    publisher = node([serves()])
    subscriber = node([hears(publisher.api.replace("127.0.0.1", host))])
    apis = {"/a": publisher.api, "/b": subscriber.api}
    assert rounds(monkeypatch, Kernel(), apis) == ([FOUND] * 4, [])


def test_a_subscriber_may_name_the_publisher(node, monkeypatch) -> None:
    publisher, subscriber = node([serves()]), node([hears("/a")])
    apis = {"/a": publisher.api, "/b": subscriber.api}
    assert rounds(monkeypatch, Kernel(), apis) == ([FOUND] * 4, [])


def test_what_the_kernel_denies_is_refused_though_both_say_so(node, monkeypatch) -> None:
    publisher = node([serves()])
    subscriber = node([hears(publisher.api)])
    apis = {"/a": publisher.api, "/b": subscriber.api}
    assert rounds(monkeypatch, Kernel(joined=False), apis) == ([[]] * 4, REFUSED)


@pytest.mark.parametrize("other", [[], [hears("http://127.0.0.1:9/")], "another topic", "no list"])
def test_what_the_publisher_alone_says_is_refused(node, monkeypatch, other) -> None:
    publisher = node([serves()])
    said = [hears(publisher.api, "/u")] if other == "another topic" else other
    apis = {"/a": publisher.api, "/b": node(said).api}
    assert rounds(monkeypatch, Kernel(), apis) == ([[]] * 4, REFUSED)


def test_a_subscriber_that_is_no_node_is_refused(node, monkeypatch) -> None:
    assert rounds(monkeypatch, Kernel(), {"/a": node([serves()]).api}) == ([[]] * 4, REFUSED)


def test_what_the_subscriber_alone_says_does_not_count(node, monkeypatch) -> None:
    publisher = node([])
    apis = {"/a": publisher.api, "/b": node([hears(publisher.api)]).api}
    assert rounds(monkeypatch, Kernel(), apis) == ([[]] * 4, [])


def test_one_end_may_know_later_than_the_other(node, monkeypatch) -> None:
    """Two rounds in which they differ are nothing; the third is refused."""
    publisher = node([serves()])
    subscriber = node([], [], [hears(publisher.api)])
    apis = {"/a": publisher.api, "/b": subscriber.api}
    assert rounds(monkeypatch, Kernel(), apis) == ([[], [], FOUND, FOUND], [])


@pytest.mark.full
def test_who_does_not_answer_makes_nobody_a_liar(node, monkeypatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:
        apis = {"/a": node([serves()]).api, "/b": f"http://127.0.0.1:{mute.getsockname()[1]}/"}
        assert rounds(monkeypatch, Kernel(), apis) == ([[]] * 4, [])


def test_who_is_late_is_told_apart_from_who_has_ended(node, monkeypatch) -> None:
    monkeypatch.setattr(links, "Ties", Kernel())
    monkeypatch.setattr(links, "BUS_INFO_S", 0.1)
    asked = links.Links("/grader", Known(), Guard(Wire()))
    with socket.create_server(("127.0.0.1", 0)) as mute:
        apis = {"/a": node([]).api, "/b": f"http://127.0.0.1:{mute.getsockname()[1]}/"}
        assert asked.of(apis) == ([], False)
    assert asked.of(apis) == ([], True)


def test_a_publisher_that_does_not_notice_is_no_liar(node, monkeypatch) -> None:
    """rospy notices that a subscriber has gone when it sends the next message."""
    apis = {"/a": node([serves()]).api, "/b": node([]).api}
    assert rounds(monkeypatch, Kernel(half_closed=True), apis) == ([[]] * 4, [])


@pytest.mark.parametrize("said", [5, "x", {}, [5, [], [1, "/b"], [1, "/c", "o", 5, []], [1, {}, [], "o", 1]]])
def test_what_is_no_answer_says_nothing(node, monkeypatch, said) -> None:
    apis = {"/a": node(said).api, "/b": node(said).api}
    found, _ = rounds(monkeypatch, Kernel(), apis)
    assert found == [[]] * 4


def test_what_a_node_says_of_itself_needs_nobody_else(node, monkeypatch) -> None:
    found, refused = rounds(monkeypatch, Kernel(joined=False), {"/a": node([serves("/a")]).api})
    assert (found[0], refused) == ([{"topic": "/t", "publisher": "/a", "subscriber": "/a"}], [])


PUBLISHER = """
import socket, sys
api, data = (socket.create_server(("127.0.0.1", 0)) for _ in range(2))
print(api.getsockname()[1], data.getsockname()[1], flush=True)
kept = []
for line in sys.stdin:
    if line.strip() == "self":
        kept.append(socket.create_connection(data.getsockname()))
    elif line.strip().isdigit():
        kept.append(socket.socket(type=socket.SOCK_DGRAM))
        kept[-1].connect(("127.0.0.1", int(line)))
        print("sent to", flush=True)
        continue
    kept.append((api if line.strip() == "call" else data).accept()[0])
    print("accepted", flush=True)
"""
SUBSCRIBER = """
import socket, sys
api, datagrams = socket.create_server(("127.0.0.1", 0)), socket.socket(type=socket.SOCK_DGRAM)
datagrams.bind(("127.0.0.1", 0))
print(api.getsockname()[1], datagrams.getsockname()[1], flush=True)
for line in sys.stdin:
    if line.strip() == "close":
        kept.close()
    else:
        kept = socket.create_connection(("127.0.0.1", int(line)))
    print("done", flush=True)
"""


class Program:
    """A node in a process of its own that does one thing for each line: `ports` are those of its API and its data."""

    def __init__(self, code: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.ports = [int(word) for word in self.process.stdout.readline().split()]
        self.api = f"http://127.0.0.1:{self.ports[0]}/"

    def tell(self, line: object) -> None:
        assert self.process.stdin is not None
        print(line, file=self.process.stdin, flush=True)

    def wait(self) -> None:
        assert self.process.stdout is not None
        assert self.process.stdout.readline()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture(params=["sock_diag", "proc"])
def two(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Program, Program]]:
    """A publisher and a subscriber, told apart by either of the ways to ask the kernel."""

    def not_here(*_: object, **__: object) -> None:
        raise OSError

    if request.param == "proc":
        monkeypatch.setattr(sockets, "_ask_kernel", not_here)
    with Program(PUBLISHER) as publisher, Program(SUBSCRIBER) as subscriber:
        yield publisher, subscriber


def ties(*programs: Program) -> Ties:
    owners = Owners(lambda: [("all", [program.process.pid for program in programs])])
    return Ties(owners, {program.ports[0] for program in programs})


def joined(two: tuple[Program, Program], transport: str = "TCPROS") -> bool | None:
    return ties(*two).joined(two[0].api, two[1].api, transport)


def test_a_connection_between_two_processes(two) -> None:
    publisher, subscriber = two
    assert joined(two) is False
    publisher.tell("data")
    subscriber.tell(publisher.ports[1])
    publisher.wait()
    assert joined(two) is True
    assert ties(*two).joined(subscriber.api, publisher.api, "TCPROS") is True
    assert not ties(*two).half_closed(publisher.api)


def test_a_call_is_no_connection(two) -> None:
    publisher, subscriber = two
    publisher.tell("call")
    subscriber.tell(publisher.ports[0])
    publisher.wait()
    assert joined(two) is False


def test_nobody_is_connected_to_itself(two) -> None:
    publisher, _ = two
    publisher.tell("self")
    publisher.wait()
    assert joined(two) is False
    assert ties(*two).joined(publisher.api, publisher.api, "TCPROS") is False


def test_datagrams(two) -> None:
    publisher, subscriber = two
    assert joined(two, "UDPROS") is False
    publisher.tell(subscriber.ports[1])
    publisher.wait()
    assert joined(two, "UDPROS") is True
    assert joined(two) is False


@pytest.mark.parametrize(("port", "of"), [("call", 0), ("data", 1)])
def test_whose_other_end_has_gone(two, port, of) -> None:
    """Whoever asked the node something a moment ago has gone too, and is no subscriber."""
    publisher, subscriber = two
    publisher.tell(port)
    subscriber.tell(publisher.ports[of])
    publisher.wait()
    subscriber.wait()
    subscriber.tell("close")
    subscriber.wait()
    assert joined(two) is False
    assert ties(*two).half_closed(publisher.api) == (port == "data")


def test_in_a_sandbox_a_process_that_is_in_no_tree_is_ending(two) -> None:
    publisher, subscriber = two
    owners = Owners(lambda: [("all", [publisher.process.pid])], whole=True)
    assert Ties(owners, set()).joined(publisher.api, subscriber.api, "TCPROS") is False


@pytest.mark.parametrize("ended", [0, 1])
def test_who_has_ended_since_it_was_asked_is_not_connected(two, ended) -> None:
    two[ended].process.kill()
    two[ended].process.wait()
    assert joined(two) is False


def test_what_the_kernel_does_not_say(two, monkeypatch) -> None:
    """A process that is not looked into, an address that is none, and more sockets than are read."""
    publisher, subscriber = two
    assert ties(publisher).joined(publisher.api, subscriber.api, "TCPROS") is None
    assert ties(*two).joined(publisher.api, "nonsense", "TCPROS") is None
    assert ties(publisher).half_closed(subscriber.api)
    monkeypatch.setattr(sockets, "ROWS_MAX", 1)
    assert joined(two) is None
