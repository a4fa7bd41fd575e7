"""Subscribes to every publisher in the moment it registers, and records what comes, byte by byte.

A node may go on only when its publisher has taken the recorder's connection up: from then on nothing that it publishes
can be missed. rospy and roscpp answer a connection's header a moment before they add it to the topic, and they treat
connections one after the other: so the recorder knocks a second time, and the answer to that says that the first
connection is in its place. (Under another name: rospy replaces a connection by a second one of the same caller.)

A node that serves its slave API is held in `registerPublisher`; one that registers while it starts (rospy registers,
under its own lock, what was made before `init_node`) is held in the next call that it makes before `init_node`
returns: `gate`. Neither waits longer than 1 s. Reading is the loop's work.
"""

import collections
import contextlib
import threading
import time

from bounded_sockets import ProtocolError, call, connect, note_arrivals, slave_api
from connection import MESSAGE_BYTES_MAX, Connection
from guard import ROSOUT, shown
from quotas import Budget, Pool
from tcpros import HEADER_BYTES_MAX, check_fields, read_header, write_header
from wire import LENGTH

HOLD_S = 1.0
CONNECT_S = 10.0
RETRY_S = 0.05
KNOCK = "_knock"
LATCHING_S = 5.0
PENDING_BYTES_MAX = 32 << 20
"""Of messages that are not yet here as a whole, all together."""
LAST_READS_S = 0.5
OPEN_MAX, SAME_MAX = 600, 4
"""Connections at a time: of all publishers, and to one node for one topic."""
NOTES_MAX = 3000
COUNTED_MAX = 2000000
"""So many messages that are not recorded are counted one by one, of all publishers together."""


class Recorder:
    def __init__(self, loop, wire, caller_id, limits, *, guard, own_ports):
        self.loop = loop
        self.wire = wire
        self.caller_id = caller_id
        self._guard = guard
        self._own_ports = own_ports
        self._budget = Budget(limits)
        self._pool = Pool()
        self._pending_bytes = 0
        self._notes = 0
        self._to_count = COUNTED_MAX
        self._open = {}
        self._same = collections.Counter()
        self._pending = {}
        self._serving = set()
        self._processes = {}
        self._lock = threading.Lock()
        self.on_log = None

    def connect(self, topic, caller_id, caller_api, process):
        """Connect to a publisher, beside the caller; hold the caller, and say so, if the publisher can answer."""
        connected = threading.Event()
        with self._lock:
            self._pending.setdefault(caller_id, []).append(connected)
            self._processes[caller_id] = process
            # A node that answered before serves its slave API. Another one may hold the lock that it needs to answer,
            # and would wait for itself.
            serving = (caller_id, caller_api) in self._serving
        deadline = time.monotonic() + CONNECT_S

        def work():
            self._connect(topic, caller_id, caller_api, deadline)
            self._note_answer(caller_id, connected)

        if not self._pool.submit(process, work):
            self._guard.limit(process or caller_id, "registered publishers faster than they can be recorded")
            self._note_answer(caller_id, connected)
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

    def _connect(self, topic, caller_id, caller_api, deadline):
        pause = threading.Event()
        while True:
            try:
                sock, header = self._handshake(topic, caller_api, deadline)
                break
            except ProtocolError as error:
                if time.monotonic() > deadline:
                    self.note("refused", topic, caller_id, detail=shown(error))
                    return
            pause.wait(RETRY_S)
        account = self._account(topic, caller_id, header)
        connection = Connection(self, sock, topic=topic, caller_id=caller_id, header=header, account=account)
        with self._lock:
            full = len(self._open) >= OPEN_MAX or self._same[topic, caller_id] >= SAME_MAX
            if not full:
                self._open[sock] = connection
                self._same[topic, caller_id] += 1
                self._serving.add((caller_id, caller_api))
        if full:
            self._guard.limit(
                self._processes.get(caller_id) or caller_id,
                "registered the same publishers again and again",
            )
            sock.close()
            return
        self.note("connected", topic, caller_id)
        # This is a thread of the pool's, and connections belong to the loop.
        self.loop.call_soon(connection.watch)

    def _account(self, topic, caller_id, header):
        """Return where the channel's messages are counted, or None where there are too many channels."""
        process = self._processes.get(caller_id)
        definition = header.get("message_definition", "")
        account = self._budget.open((topic, caller_id, header["type"], header["md5sum"], definition), process)
        if account is None:
            self._guard.limit(process or caller_id, "published on so many topics that not all are recorded")
        return account

    def _note_answer(self, caller_id, connected):
        with self._lock:
            pending = self._pending[caller_id]
            pending.remove(connected)
            if not pending:
                del self._pending[caller_id]
        connected.set()

    def finish(self):
        """Read what has already arrived, then close every connection and give its totals."""
        with self._lock:
            connections = list(self._open.values())
        # By turns, and not for ever: a node that still sends must not keep the others' last messages from being read.
        until_s, talking = time.monotonic() + LAST_READS_S, connections
        while talking and time.monotonic() < until_s:
            talking = [connection for connection in talking if connection.readable()]
        for connection in connections:
            connection.close()

    def _handshake(self, topic, caller_api, deadline):
        try:
            api = slave_api(caller_api, max(0.05, deadline - time.monotonic()))
        except ValueError as error:
            raise ProtocolError(str(error)) from error
        protocol = call(api.requestTopic, self.caller_id, topic, [["TCPROS"]])
        if not isinstance(protocol, list) or len(protocol) != 3 or not isinstance(protocol[2], int):
            raise ProtocolError("no TCPROS offered")
        port = protocol[2]
        if port in self._own_ports:
            raise ProtocolError("a port of the grader's")
        known_as = ROSOUT if topic == ROSOUT else self.caller_id  # as which a node knows who collects its log
        sock, header = self._subscribe(known_as, topic, port, deadline - time.monotonic())
        try:
            self._subscribe(self.caller_id + KNOCK, topic, port, deadline - time.monotonic())[0].close()
        except ProtocolError:
            sock.close()
            raise
        # From here on the loop reads, and takes only what is there.
        sock.allow(None, 0)
        sock.setblocking(False)
        note_arrivals(sock)
        return sock, header

    def _subscribe(self, caller_id, topic, port, seconds):
        """Return a connection whose header was answered rightly; raise ProtocolError."""
        sock = None
        try:
            sock = connect(port, max(0.05, seconds), LENGTH.size + HEADER_BYTES_MAX)
            # Any type: what the publisher sends is recorded, whatever it registered.
            request = {"callerid": caller_id, "topic": topic, "md5sum": "*", "type": "*", "tcp_nodelay": "1"}
            write_header(sock, request)
            header = _answered_header(sock)
        except (OSError, ValueError, ProtocolError) as error:
            if sock is not None:
                sock.close()
            raise ProtocolError(str(error)) from error
        return sock, header

    def pass_on(self, topic, pieces):
        """Pass log messages on to the subscribers of /rosout_agg."""
        if topic == ROSOUT and self.on_log is not None:
            self.on_log(pieces)

    def ask_latching(self, connection):
        """Return whether the publisher latches: rospy knows it only once its constructor is through."""

        def work():
            latching = False
            with contextlib.suppress(ProtocolError):  # then no one knows
                sock, header = self._subscribe(
                    self.caller_id + KNOCK, connection.topic, connection.port, LATCHING_S
                )
                sock.close()
                latching = header.get("latching") == "1"
            self.loop.call_soon(lambda: connection.open(latching=latching))

        self._pool.submit(self._processes.get(connection.caller_id), work)

    def reserve(self, size):
        """Reserve room in memory for a message that is still coming; return whether there is any."""
        with self._lock:
            if size and self._pending_bytes + size > PENDING_BYTES_MAX:
                return False
            self._pending_bytes += size
        return True

    def release(self, size):
        with self._lock:
            self._pending_bytes -= size

    @property
    def counts(self):
        """Whether messages that are not recorded are still counted one by one."""
        return self._to_count > 0

    def count(self, messages):
        self._to_count -= messages

    def overflows(self, connection, messages, time_ns):
        """Note that from now on messages of this publisher are not recorded."""
        topic, caller_id = connection.topic, connection.caller_id
        self.note("limit", topic, caller_id, time_ns, messages=messages)
        detail = "sent more on {} than is recorded".format(shown(topic))
        self._guard.limit(self._processes.get(caller_id) or caller_id, detail)

    def too_large(self, connection, length):
        detail = "began a message of {} MB on {}; at most {} MB are allowed".format(
            length >> 20, shown(connection.topic), MESSAGE_BYTES_MAX >> 20
        )
        caller_id = connection.caller_id
        self._guard.limit(self._processes.get(caller_id) or caller_id, detail)

    def note(self, event, topic, caller_id, time_ns=None, **fields):
        self._notes += 1
        # The totals at the end are told even where all other notes were too many.
        if self._notes > (2 * NOTES_MAX if event == "closed" else NOTES_MAX):
            return
        record = {"event": event, "topic": topic, "callerid": caller_id}
        record.update(fields)
        self.wire.event("/grader/recorder", record, time_ns)

    def closed(self, connection):
        with self._lock:
            self._open.pop(connection.sock, None)
            self._same[connection.topic, connection.caller_id] -= 1
        self.loop.remove_reader(connection.sock)


def _answered_header(sock):
    header = read_header(sock)
    if "error" in header or "md5sum" not in header or "type" not in header:
        raise ProtocolError(header.get("error", "header without type and md5sum"))
    check_fields(header)
    return header
