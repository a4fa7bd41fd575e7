"""The fuzzing process of ROS's side: its parsers need ROS's own Python. Spoken to by `parent.py`."""

import io
import json
import sys
import xmlrpc.client
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent.parent / "grader" / "arena" / "ros")]

import bounded_sockets  # noqa: E402 - found by the path above
import connection  # noqa: E402
import quotas  # noqa: E402
import tcpros  # noqa: E402
import xmlrpc_parser  # noqa: E402
from loop import serve  # noqa: E402

CPU_S = 10.0
MEMORY_BYTES = 200 << 20
PIECE_BYTES = 7


class Socket:
    """Gives the bytes of a case in small pieces."""

    def __init__(self, data):
        self._stream = io.BytesIO(data)

    def recv(self, size, *_):
        return self._stream.read(min(size, PIECE_BYTES))

    def recv_into(self, buffer, *_):
        piece = self.recv(len(buffer))
        buffer[: len(piece)] = piece
        return len(piece)

    def recvmsg(self, size, _room):
        return self.recv(size), [], 0, None

    def recvmsg_into(self, buffers, _room):
        return self.recv_into(*buffers), [], 0, None

    def sendall(self, data):
        """Nobody hears it."""

    def getpeername(self):
        return "127.0.0.1", 1

    def close(self):
        """There is nothing to close."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def header(data):
    fields = tcpros.read_header(Socket(data))
    tcpros.check_fields(fields)
    json.dumps(fields).encode()


def xmlrpc_answer(data):
    json.dumps(plain(xmlrpc_parser.read(data)[0])).encode()


def plain(value):
    """As it goes into an event."""
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return repr(value) if type(value).__name__ in ("Binary", "DateTime") else value


def service_answer(data):
    """The same answer to the probe and to the call."""
    tcpros.connect = lambda *_: Socket(data)
    tcpros.call_service("/s", "rosrpc://127.0.0.1:9", "/n", type_="demo/Call", request=b"", timeout_s=1.0)


def topic_stream(data):
    """Every message that is whole comes out as it was sent, and all memory that was reserved is given back."""
    recorder = _Recorder()
    header_ = {"type": "demo/A", "md5sum": "x"}
    account = quotas.Budget({"channel_messages": 50, "channel_bytes": 1 << 16}).open(("/c", "/n"), "p")
    found = connection.Connection(
        recorder, Socket(data), topic="/c", caller_id="/n", header=header_, account=account
    )
    while found.readable():
        pass
    found.close()
    assert recorder.reserved == 0, "memory is still reserved"
    assert all(frame in data for frame in recorder.frames)


class _Recorder:
    """As much of the recorder, of its wire and of its loop as a connection speaks to."""

    def __init__(self):
        self.reserved = 0
        self.frames = []
        self.wire = self.loop = self

    def reserve(self, size):
        self.reserved += size
        return True

    def release(self, size):
        self.reserved -= size

    def messages(self, _channel, frames, _time_ns):
        self.frames += frames

    def __getattr__(self, _name):
        return lambda *_, **__: 1


NOTHING = ()
TARGETS = {
    "header": (header, (bounded_sockets.ProtocolError,)),
    "xmlrpc": (xmlrpc_answer, (xmlrpc_parser.Malformed, xmlrpc.client.Fault)),
    "service-answer": (service_answer, (bounded_sockets.ProtocolError,)),
    "topic-stream": (topic_stream, NOTHING),
}

if __name__ == "__main__":
    serve(TARGETS, CPU_S, MEMORY_BYTES)
