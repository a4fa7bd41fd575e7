"""Subscribes to every publisher in the moment it registers, and records what comes, byte by byte.

A node may go on only when its publisher has taken the recorder's connection up: from then on nothing that it publishes
can be missed. rospy and roscpp answer a connection's header a moment before they add it to the topic, and they treat
connections one after the other: so the recorder knocks a second time, and the answer to that says that the first
connection is in its place. (Under another name: rospy replaces a connection by a second one of the same caller.)

A node that serves its slave API is held in `registerPublisher`; one that registers while it starts (rospy registers,
under its own lock, what was made before `init_node`) is held in the next call that it makes before `init_node`
returns: `gate`. Neither waits longer than 1 s. Reading is the loop's work.
"""

import threading
import time
from urllib.parse import urlparse

from tcpros import LENGTH, ProtocolError, call, connect, read_header, slave_api, write_header
from wire import now_ns

HOLD_S = 1.0
CONNECT_S = 10.0
RETRY_S = 0.05
KNOCK = "_knock"
READ_BYTES = 1 << 18
MESSAGE_BYTES_MAX = 64 << 20


class Recorder:
    def __init__(self, loop, wire, caller_id, limits):
        self._loop = loop
        self.wire = wire
        self._caller_id = caller_id
        self.messages_max = limits["channel_messages"]
        self.bytes_max = limits["channel_bytes"]
        self._open = {}
        self._pending = {}
        self._serving = set()
        self._lock = threading.Lock()
        self.forward = {}

    def connect(self, topic, caller_id, caller_api):
        """Connect to a publisher, beside the caller; hold the caller if the publisher is able to answer."""
        connected = threading.Event()
        with self._lock:
            self._pending.setdefault(caller_id, []).append(connected)
            serving = (caller_id, caller_api) in self._serving
        threading.Thread(
            target=self._connect, args=(topic, caller_id, caller_api, connected), daemon=True
        ).start()
        if serving:
            connected.wait(HOLD_S)

    def gate(self, caller_id):
        """Hold a node that is about to leave `init_node` until its publishers are recorded."""
        deadline = time.monotonic() + HOLD_S
        with self._lock:
            pending = list(self._pending.get(caller_id, ()))
        for connected in pending:
            connected.wait(max(0.0, deadline - time.monotonic()))

    def _connect(self, topic, caller_id, caller_api, connected):
        deadline = time.monotonic() + CONNECT_S
        pause = threading.Event()
        while True:
            try:
                sock, header = self._handshake(topic, caller_api, deadline)
                break
            except ProtocolError as error:
                if time.monotonic() > deadline:
                    self.note("refused", topic, caller_id, detail=str(error)[:300])
                    self._answered(caller_id, connected)
                    return
            pause.wait(RETRY_S)
        connection = _Connection(self, sock, topic, caller_id, header)
        with self._lock:
            self._open[sock] = connection
            self._serving.add((caller_id, caller_api))
        self.note("connected", topic, caller_id)
        self._loop.call_soon(lambda: self._loop.add_reader(sock, connection.readable))
        self._answered(caller_id, connected)

    def _answered(self, caller_id, connected):
        with self._lock:
            self._pending[caller_id].remove(connected)
        connected.set()

    def finish(self):
        """Read what has already arrived, then close every connection and give its totals."""
        with self._lock:
            connections = list(self._open.values())
        for connection in connections:
            connection.readable()
            connection.close()

    def _handshake(self, topic, caller_api, deadline):
        api = slave_api(caller_api, max(0.05, deadline - time.monotonic()))
        protocol = call(api.requestTopic, self._caller_id, topic, [["TCPROS"]])
        if not isinstance(protocol, list) or len(protocol) != 3 or not isinstance(protocol[2], int):
            raise ProtocolError("no TCPROS offered")
        address = urlparse(caller_api).hostname, protocol[2]
        try:
            sock, header = self._subscribe(self._caller_id, topic, address, deadline)
            self._subscribe(self._caller_id + KNOCK, topic, address, deadline)[0].close()
        except (OSError, ValueError) as error:
            raise ProtocolError(str(error)) from error
        sock.setblocking(False)
        return sock, header

    def _subscribe(self, caller_id, topic, address, deadline):
        sock = connect(address[0], address[1], max(0.05, deadline - time.monotonic()))
        request = {"callerid": caller_id, "topic": topic, "md5sum": "*", "type": "*", "tcp_nodelay": "1"}
        write_header(sock, request)
        header = read_header(sock)
        if "error" in header or "md5sum" not in header or "type" not in header:
            raise ProtocolError(header.get("error", "header without type and md5sum"))
        return sock, header

    def note(self, event, topic, caller_id, **fields):
        record = {"event": event, "topic": topic, "callerid": caller_id}
        record.update(fields)
        self.wire.event("/grader/recorder", record)

    def closed(self, connection):
        with self._lock:
            self._open.pop(connection.sock, None)
        self._loop.remove_reader(connection.sock)


class _Connection:
    def __init__(self, recorder, sock, topic, caller_id, header):
        self.sock = sock
        self._recorder = recorder
        self._topic = topic
        self._caller_id = caller_id
        self._buffer = bytearray()
        self._messages = 0
        self._bytes = 0
        self._dropped = 0
        self._closed = False
        self._channel = recorder.wire.channel(
            topic=topic,
            callerid=caller_id,
            type=header["type"],
            md5sum=header["md5sum"],
            definition=header.get("message_definition", ""),
            latching=header.get("latching", "0") == "1",
        )

    def readable(self):
        """Take all that the socket holds now."""
        while not self._closed:
            try:
                chunk = self.sock.recv(READ_BYTES)
            except BlockingIOError:
                return
            except OSError:
                chunk = b""
            if not chunk:
                self.close()
                return
            self._buffer += chunk
            self._record(self._frames())
            if len(chunk) < READ_BYTES:
                return

    def _frames(self):
        """Cut whole messages off the buffer."""
        frames = []
        start = 0
        buffer = self._buffer
        while len(buffer) - start >= LENGTH.size:
            (length,) = LENGTH.unpack_from(buffer, start)
            if length > MESSAGE_BYTES_MAX:
                self._recorder.note("invalid", self._topic, self._caller_id, detail="{} bytes".format(length))
                self.close()
                break
            end = start + LENGTH.size + length
            if end > len(buffer):
                break
            frames.append(bytes(buffer[start + LENGTH.size : end]))
            start = end
        del buffer[:start]
        return frames

    def _record(self, frames):
        if not frames:
            return
        recorder = self._recorder
        time_ns = now_ns()
        forward = recorder.forward.get(self._topic)
        if forward is not None:
            for frame in frames:
                forward(frame)
        room = recorder.messages_max - self._messages
        kept = frames if len(frames) <= room else frames[: max(0, room)]
        size = sum(map(len, kept))
        if self._bytes + size > recorder.bytes_max:
            kept, size = [], 0
        if kept:
            recorder.wire.messages(self._channel, kept, time_ns)
        self._messages += len(kept)
        self._bytes += size
        if len(kept) < len(frames):
            if not self._dropped:
                recorder.note("limit", self._topic, self._caller_id, messages=self._messages)
            self._dropped += len(frames) - len(kept)

    def close(self):
        if self._closed:
            return
        self._closed = True
        self._recorder.closed(self)
        self.sock.close()
        self._recorder.note(
            "closed", self._topic, self._caller_id, messages=self._messages, dropped=self._dropped
        )
