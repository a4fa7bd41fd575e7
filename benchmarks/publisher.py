"""A ROS node of sockets alone, whose load and times are known: what it sends, and when, is not up to a library.

Runs under ROS's own interpreter (Python 3.8, standard library and std_msgs) with one argument, a JSON object: `topics`
(how many), `type`, `bytes` of each message (the pulse's carry the time instead), `count` in all, `rate_hz` in all.
Sends when every topic has a subscriber, prints one line of JSON when all has left, and waits for its end.
"""

from __future__ import annotations

import array
import contextlib
import fcntl
import importlib
import json
import os
import signal
import socket
import struct
import sys
import termios
import threading
import time
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

NAME = "/load"
LENGTH = struct.Struct("<I")
TIME = struct.Struct("<Q")
SETTLE_S, PAUSE_S, SPIN_S, LEAVE_S = 0.5, 0.001, 0.0005, 20.0


class Topic:
    """One publisher: its name, its subscribers' sockets, and how many messages went to them."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.sockets: list[socket.socket] = []
        self.sent = 0

    def send(self, frame: bytes) -> None:
        """To all. Who has gone is forgotten, unless nobody would be left."""
        for sock in tuple(self.sockets):
            if not _sent(sock, frame, last=len(self.sockets) == 1):
                self.sockets.remove(sock)
        self.sent += 1

    def drop_closed(self) -> None:
        self.sockets = [sock for sock in self.sockets if not _closed(sock)]


class Api:
    """What subscribers and the master may ask of a node."""

    def __init__(self, port: int) -> None:
        self._port = port

    def _dispatch(self, method: str, _params: tuple[object, ...]) -> list[object]:
        answers = {"requestTopic": ["TCPROS", "127.0.0.1", self._port], "getPid": os.getpid()}
        return [1, "", answers.get(method, [])]


def main() -> None:
    asked = json.loads(sys.argv[1])
    signal.signal(signal.SIGINT, signal.default_int_handler)
    package, _, name = asked["type"].partition("/")
    message = getattr(importlib.import_module(package + ".msg"), name)
    topics = {f"{NAME}/{number}": Topic(f"{NAME}/{number}") for number in range(asked["topics"])}
    listener = socket.create_server(("127.0.0.1", 0), backlog=128)
    threading.Thread(target=_accept, args=(listener, topics, message), daemon=True).start()
    _register(list(topics), asked["type"], listener.getsockname()[1])
    _await_subscribers(list(topics.values()))
    told = _publish(list(topics.values()), asked)
    _await_left(list(topics.values()))
    with contextlib.suppress(KeyboardInterrupt):
        print(json.dumps(told), flush=True)
        signal.pause()


def _register(topics: list[str], type_: str, port: int) -> None:
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    server.register_instance(Api(port))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    uri = f"http://127.0.0.1:{server.server_address[1]}/"
    for topic in topics:
        ServerProxy(os.environ["ROS_MASTER_URI"]).registerPublisher(NAME, topic, type_, uri)


def _accept(listener: socket.socket, topics: dict[str, Topic], message: object) -> None:
    while True:
        sock, _ = listener.accept()
        fields = _read_header(sock)
        topic = topics[fields["topic"]]
        answer = {
            "callerid": NAME,
            "latching": "0",
            "md5sum": message._md5sum,  # type: ignore[attr-defined] # noqa: SLF001 - genpy's own names
            "message_definition": message._full_text,  # type: ignore[attr-defined] # noqa: SLF001
            "topic": topic.name,
            "type": message._type,  # type: ignore[attr-defined] # noqa: SLF001
        }
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.sendall(_header(answer))
        topic.sockets.append(sock)


def _read_header(sock: socket.socket) -> dict[str, str]:
    (size,) = LENGTH.unpack(sock.recv(LENGTH.size, socket.MSG_WAITALL))
    data, fields = sock.recv(size, socket.MSG_WAITALL), {}
    while data:
        (length,) = LENGTH.unpack_from(data)
        key, _, value = data[LENGTH.size : LENGTH.size + length].decode().partition("=")
        fields[key], data = value, data[LENGTH.size + length :]
    return fields


def _header(fields: dict[str, str]) -> bytes:
    parts = [f"{key}={value}".encode() for key, value in fields.items()]
    data = b"".join(LENGTH.pack(len(part)) + part for part in parts)
    return LENGTH.pack(len(data)) + data


def _await_subscribers(topics: list[Topic]) -> None:
    """Until each has one that stays: some only knock."""
    while True:
        time.sleep(SETTLE_S)
        for topic in topics:
            topic.drop_closed()
        if all(topic.sockets for topic in topics):
            return


def _sent(sock: socket.socket, frame: bytes, *, last: bool) -> bool:
    try:
        sock.sendall(frame)
    except OSError:
        if last:
            raise
        return False
    return True


def _closed(sock: socket.socket) -> bool:
    try:
        return not sock.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
    except BlockingIOError:
        return False
    except OSError:
        return True


def _publish(topics: list[Topic], asked: dict[str, object]) -> dict[str, float]:
    """Each topic in turn, every message at its time or as soon after it as the readers let it."""
    count, period_s = int(str(asked["count"])), 1 / float(str(asked["rate_hz"]))
    pulse = asked["type"] == "std_msgs/UInt64"
    frame = b"" if pulse else _frame(str(asked["type"]), int(str(asked["bytes"])))
    begin_s = time.monotonic() + period_s
    first_s = last_s = 0.0
    for number in range(count):
        _await(begin_s + number * period_s, spin_s=SPIN_S if pulse else 0.0)
        if pulse:
            frame = LENGTH.pack(TIME.size) + TIME.pack(time.monotonic_ns())
        last_s = time.monotonic()
        first_s = first_s or last_s
        topics[number % len(topics)].send(frame)
    sent = sum(topic.sent for topic in topics)
    mean_hz = (count - 1) / (last_s - first_s)
    return {"sent": sent, "begin_s": begin_s, "end_s": time.monotonic(), "mean_hz": mean_hz}


def _await(due_s: float, *, spin_s: float) -> None:
    """Sleeps never shorter than `PAUSE_S` where nothing depends on the moment: what is due meanwhile goes at once."""
    left_s = due_s - time.monotonic()
    if left_s > spin_s:
        time.sleep(left_s - spin_s if spin_s else max(left_s, PAUSE_S))
    while spin_s and time.monotonic() < due_s:
        pass


def _frame(type_: str, size: int) -> bytes:
    """A message as it goes over the wire: an array of bytes that no compressor makes smaller, or one byte."""
    data = os.urandom(size)
    if type_ == "std_msgs/UInt8MultiArray":
        data = bytes(2 * LENGTH.size) + LENGTH.pack(size) + data
    return LENGTH.pack(len(data)) + data


def _await_left(topics: list[Topic]) -> None:
    """Until the readers' machines have it all."""
    until_s, left = time.monotonic() + LEAVE_S, array.array("i", [1])
    while left[0] and time.monotonic() < until_s:
        for topic in topics:
            for sock in topic.sockets:
                fcntl.ioctl(sock.fileno(), termios.TIOCOUTQ, left)
                if left[0]:
                    break
        if left[0]:
            time.sleep(PAUSE_S)


if __name__ == "__main__":
    main()
