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

from connection import Connection
from tcpros import ProtocolError, call, connect, read_header, slave_api, write_header

HOLD_S = 1.0
CONNECT_S = 10.0
RETRY_S = 0.05
KNOCK = "_knock"
LATCHING_S = 1.0


class Recorder:
    def __init__(self, loop, wire, caller_id, limits):
        self.loop = loop
        self.wire = wire
        self._caller_id = caller_id
        self.messages_max = limits["channel_messages"]
        self.bytes_max = limits["channel_bytes"]
        self._open = {}
        self._pending = {}
        self._serving = set()
        self._lock = threading.Lock()

    def connect(self, topic, caller_id, caller_api):
        """Connect to a publisher, beside the caller; hold the caller, and say so, if the publisher can answer."""
        connected = threading.Event()
        with self._lock:
            self._pending.setdefault(caller_id, []).append(connected)
            serving = (caller_id, caller_api) in self._serving
        threading.Thread(
            target=self._connect, args=(topic, caller_id, caller_api, connected), daemon=True
        ).start()
        if serving:
            connected.wait(HOLD_S)
        return serving

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
        connection = Connection(self, sock, topic, caller_id, header)
        with self._lock:
            self._open[sock] = connection
            self._serving.add((caller_id, caller_api))
        self.note("connected", topic, caller_id)
        self.loop.call_soon(lambda: self.loop.add_reader(sock, connection.readable))
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
        try:
            api = slave_api(caller_api, max(0.05, deadline - time.monotonic()))
        except ValueError as error:
            raise ProtocolError(str(error)) from error
        protocol = call(api.requestTopic, self._caller_id, topic, [["TCPROS"]])
        if not isinstance(protocol, list) or len(protocol) != 3 or not isinstance(protocol[2], int):
            raise ProtocolError("no TCPROS offered")
        port = protocol[2]
        try:
            sock, header = self._subscribe(self._caller_id, topic, port, deadline)
            self._subscribe(self._caller_id + KNOCK, topic, port, deadline)[0].close()
        except (OSError, ValueError) as error:
            raise ProtocolError(str(error)) from error
        sock.setblocking(False)
        return sock, header

    def _subscribe(self, caller_id, topic, port, deadline):
        sock = connect(port, max(0.05, deadline - time.monotonic()))
        request = {"callerid": caller_id, "topic": topic, "md5sum": "*", "type": "*", "tcp_nodelay": "1"}
        write_header(sock, request)
        header = read_header(sock)
        if "error" in header or "md5sum" not in header or "type" not in header:
            raise ProtocolError(header.get("error", "header without type and md5sum"))
        return sock, header

    def ask_latching(self, topic, port):
        """Whether the publisher latches: rospy knows it only once its constructor is through."""
        try:
            sock, header = self._subscribe(
                self._caller_id + KNOCK, topic, port, time.monotonic() + LATCHING_S
            )
        except (OSError, ProtocolError):
            return False
        sock.close()
        return header.get("latching") == "1"

    def note(self, event, topic, caller_id, **fields):
        record = {"event": event, "topic": topic, "callerid": caller_id}
        record.update(fields)
        self.wire.event("/grader/recorder", record)

    def closed(self, connection):
        with self._lock:
            self._open.pop(connection.sock, None)
        self.loop.remove_reader(connection.sock)
