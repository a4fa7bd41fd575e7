"""The grader's own node: it publishes probe messages and `/clock`, offers services (`services`), and is `/rosout` too.

The bytes come ready-made from the grader, so the arena needs no message classes. What is sent is recorded in the
moment of sending, not by a detour over the network.
"""

import base64
import collections
import contextlib
import os
import socket
import struct
import threading
import time

from bounded_sockets import LOOPBACK, UNKNOWN_PROCESS, BoundedSocket, ProtocolError
from guard import ROSOUT, shown
from services import Services
from tcpros import HEADER_BYTES_MAX, Closed, check_fields, read_header, write_header
from wire import LENGTH, now_ns

SUBSCRIBERS_MAX = 64
"""Of one process."""
OTHER_TYPES_MAX = 100
HELD_S = 10.0
CLOCK = {
    "topic": "/clock",
    "type": "rosgraph_msgs/Clock",
    "md5sum": "a9c97c1d230cfc112e270351a944ee47",
    "definition": "time clock\n",
    "latching": True,
}
LOG = {
    "topic": "/rosout_agg",
    "type": "rosgraph_msgs/Log",
    "md5sum": "acffd30cd6b6de30f120938c17c593fb",
    "definition": """byte DEBUG=1
byte INFO=2
byte WARN=4
byte ERROR=8
byte FATAL=16
Header header
byte level
string name
string msg
string file
string function
uint32 line
string[] topics
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
""",
    "latching": False,
}
LOGGERS = {
    "service": "/rosout/get_loggers",
    "type": "roscpp/GetLoggers",
    "md5sum": "32e97e85527d4678a8f9279894bb64b0",
}
SET_LEVEL = {
    "service": "/rosout/set_logger_level",
    "type": "roscpp/SetLoggerLevel",
    "md5sum": "51da076440d78ca1684d36c868df61ea",
}
NO_LOGGERS, NOTHING = base64.b64encode(bytes(LENGTH.size)).decode(), ""
TIME = struct.Struct("<II")
NS = 1000000000
HANDSHAKE_S = 2.0
WAITING_MAX = 128
SAME_ANSWERS = {
    "getBusInfo": [], "getBusStats": [[], [], []], "getSubscriptions": [], "paramUpdate": 0, "publisherUpdate": 0,
    "shutdown": 0,
}  # fmt: skip
"""Of methods of the slave API that say the same to every caller."""


class SlaveApi:
    """The part of the slave API that subscribers and tools use (wiki.ros.org/ROS/Slave_API)."""

    METHODS = frozenset(("getMasterUri", "getPid", "getPublications", "requestTopic"))

    def __init__(self, actor, guard):
        self._actor = actor
        self._guard = guard

    def answer(self, method, args, caller):
        """Answer a call from outside."""
        if method == "shutdown":
            self._guard.refused(caller.name, "told the grader's node to shut down")
        if method in SAME_ANSWERS:
            return 1, "", SAME_ANSWERS[method]
        if method not in self.METHODS:
            raise ValueError("no method {}".format(shown(method)))
        return getattr(self, method)(*args)

    def requestTopic(self, _caller_id, topic, protocols):
        if str(topic) not in self._actor.topics or ["TCPROS"] not in protocols:
            return 0, "no such topic or protocol", []
        return 1, "ready", ["TCPROS", LOOPBACK, self._actor.port]

    def getPid(self, _caller_id):
        return 1, "", os.getpid()

    def getMasterUri(self, _caller_id):
        return 1, "", os.environ["ROS_MASTER_URI"]

    def getPublications(self, _caller_id):
        return 1, "", [[t.name, t.type] for t in self._actor.topics.values()]


class _Topic:
    def __init__(self, fields, channel, known_as):
        self.name = fields["topic"]
        self.type = fields["type"]
        self.latching = fields["latching"]
        self.header = {
            "type": fields["type"],
            "md5sum": fields["md5sum"],
            "message_definition": fields["definition"],
            "latching": "1" if fields["latching"] else "0",
            "callerid": known_as,
        }
        self.channel = channel
        self.subscribers = {}
        self.last = None
        self.lock = threading.Lock()


class Actor:
    """One node, `/grader_…`, with a TCPROS server for any number of topics and services."""

    def __init__(self, loop, wire, caller_id, guard, owners):
        self.topics = {}
        self._guard = guard
        self._whose = {}
        self._other_types = set()
        self.caller_id = caller_id
        self._wire = wire
        self._services = Services(wire, caller_id, guard)
        self.port = TcprosServer(loop, self._join, guard, owners).port
        self.uri = None

    def advertise(self, master, fields):
        """Register a topic; `fields` holds topic, type, md5sum, definition, latching.

        `known_as` is the node that subscribers are told of, in place of this one.
        """
        known_as = fields.pop("known_as", self.caller_id)
        channel = self._wire.channel(callerid=self.caller_id, **fields)
        self.topics[fields["topic"]] = _Topic(fields, channel, known_as)
        master.registerPublisher(self.caller_id, fields["topic"], fields["type"], self.uri)

    def serve(self, master, fields, node=None):
        """Register a service; `fields` holds service, type, md5sum, answers (base64), error, delay_s."""
        self._services.add(fields)
        address = "rosrpc://{}:{}".format(LOOPBACK, self.port)
        master.registerService(node or self.caller_id, fields["service"], address, self.uri)

    def stand_in_for_rosout(self, master):
        """Register what ROS's rosout has: roslaunch starts one of its own in a graph that has none."""
        self.topics[LOG["topic"]] = _Topic(LOG, None, ROSOUT)
        master.registerPublisher(ROSOUT, LOG["topic"], LOG["type"], self.uri)
        for fields, answer in ((LOGGERS, NO_LOGGERS), (SET_LEVEL, NOTHING)):
            self.serve(master, dict(fields, answers=[answer], error="", delay_s=0.0, told=False), ROSOUT)
        master.registerSubscriber(ROSOUT, ROSOUT, LOG["type"], self.uri)

    def pass_on_log(self, pieces):
        """Publish messages of `/rosout`, each behind its length, on `/rosout_agg`; where nobody listens, they are not
        recorded a second time."""
        topic = self.topics[LOG["topic"]]
        if topic.subscribers:
            with topic.lock:
                topic.channel = topic.channel or self._wire.channel(callerid=ROSOUT, **LOG)
                self._wire.messages(topic.channel, pieces, now_ns())
                for sock in list(topic.subscribers):
                    self._send(topic, sock, b"".join(pieces))

    def publish(self, topic_name, data):
        """Send and record one message."""
        topic = self.topics[topic_name]
        frame = LENGTH.pack(len(data)) + data
        with topic.lock:
            topic.last = frame
            self._wire.messages(topic.channel, [frame], now_ns())
            for sock in list(topic.subscribers):
                self._send(topic, sock, frame)

    def subscribers(self, topic_name):
        return list(self.topics[topic_name].subscribers.values())

    def processes(self, topic_name):
        """Return the processes whose nodes subscribe."""
        return {self._whose.get(sock, UNKNOWN_PROCESS) for sock in list(self.topics[topic_name].subscribers)}

    def _send(self, topic, sock, frame):
        try:
            # It does not block: a part that was sent would break the stream, so a full socket ends the subscription.
            if sock.send(frame) == len(frame):
                return
        except OSError:
            pass  # gone, or not reading any more: either way it is not a subscriber
        topic.subscribers.pop(sock, None)
        self._whose.pop(sock, None)
        sock.close()

    def _join(self, sock, header, who):
        """Serve a client, or take a subscriber up, or tell it why not."""
        if "service" in header:
            self._services.serve(sock, header, who)
            return
        topic = self.topics.get(header.get("topic"))
        problem = self._mismatch(topic, header)
        if not problem and list(self._whose.values()).count(who) >= SUBSCRIBERS_MAX:
            problem = "too many subscribers"
            self._guard.limit(
                who, "has more than {} subscribers to the grader's node".format(SUBSCRIBERS_MAX)
            )
        if problem:
            write_header(sock, {"error": problem})
            sock.close()
            return
        write_header(sock, topic.header)
        subscriber = str(header.get("callerid", ""))
        sock.allow(None, 0)
        sock.setblocking(False)
        with topic.lock:
            topic.subscribers[sock] = subscriber
            self._whose[sock] = who
            if topic.latching and topic.last:
                self._send(topic, sock, topic.last)
        self._wire.status("subscribed", topic=topic.name, subscriber=subscriber)

    def _mismatch(self, topic, header):
        if topic is None:
            return "no such topic"
        for field in ("type", "md5sum"):
            if header.get(field) not in ("*", topic.header[field]):
                self._note_other_type(topic, header)
                return "{} differs: this topic carries {}".format(field, topic.type)
        return ""

    def _note_other_type(self, topic, header):
        """Note a subscriber of another type, once: it tries again and again."""
        who, type_ = str(header.get("callerid")), header.get("type")
        key = topic.name, who, type_
        if key in self._other_types or len(self._other_types) >= OTHER_TYPES_MAX:
            return
        self._other_types.add(key)
        note = {"actor": who, "topic": topic.name, "type": type_, "value": topic.type}
        note["detail"] = "asks for another type"
        self._wire.event("/grader/actor", dict(note, action="note"))


class Clock:
    """`/clock`, `warp` times faster than the wall in steps of `step_s`. It begins near 0, as a simulator's does, and
    waits for the first node of the student's (for `HELD_S`, where only programs beside it listen): until a message
    comes, the time is 0 to rospy, and the next one may not be far from it.

    A late wake-up makes the clock slower, never jumpy: no step is ever caught up.
    """

    def __init__(self, actor, warp, step_s, helpers):
        self._actor = actor
        self._helpers = helpers
        self._step_s = step_s
        self._pause_s = step_s / warp
        self._step_ns = int(step_s * NS)
        # Not 0, which rospy takes for "no time has come yet".
        self._now_ns = self._step_ns
        self._held_until_s = None
        self._stopped = False

    def start(self):
        self._tick()
        threading.Thread(target=self._run, daemon=True).start()

    def set_warp(self, warp):
        self._pause_s = self._step_s / warp

    def stop(self):
        self._stopped = True

    def _run(self):
        while True:
            time.sleep(self._pause_s)  # to wait for an event takes half as much CPU again, 400 times a second
            if self._stopped:
                return
            if self._goes():
                self._now_ns += self._step_ns
                self._tick()

    def _goes(self):
        listening = self._actor.processes("/clock")
        if self._now_ns > self._step_ns or not listening:
            return bool(listening)
        self._held_until_s = self._held_until_s or time.monotonic() + HELD_S
        return time.monotonic() > self._held_until_s or not listening <= self._helpers()

    def _tick(self):
        self._actor.publish("/clock", TIME.pack(*divmod(self._now_ns, NS)))


class TcprosServer:
    """The port of the arena's own node: takes connections in, each for no longer than its header may take.

    `join(sock, header, who)` keeps a connection of the process `who`, or raises ProtocolError or OSError.

    Of those that have not yet said what they want, the one that has waited for longest makes way.
    """

    def __init__(self, loop, join, guard, owners):
        self._join = join
        self._guard = guard
        self._owners = owners
        self._waiting = collections.OrderedDict()
        self._crowded = False
        self._lock = threading.Lock()
        # A long queue: where it is full, the kernel lets a client try again only after a second.
        self._server = socket.create_server((LOOPBACK, 0), backlog=4096)
        self.port = self._server.getsockname()[1]
        loop.add_reader(self._server, self._accept)

    def _accept(self):
        sock, address = self._server.accept()
        sock = BoundedSocket(fileno=sock.detach())
        sock.allow(HANDSHAKE_S, HEADER_BYTES_MAX + LENGTH.size)
        with self._lock:
            oldest = self._waiting.popitem(last=False)[0] if len(self._waiting) >= WAITING_MAX else None
            self._waiting[sock] = address
        if oldest is not None:
            with contextlib.suppress(OSError):  # it was closed
                oldest.shutdown(socket.SHUT_RDWR)
        # A client that sends no header must not keep the loop.
        threading.Thread(target=self._handshake, args=(sock, address, oldest), daemon=True).start()

    def _handshake(self, sock, address, pushed_out):
        if pushed_out is not None:
            self._note_crowd()
        try:
            header = self._header(sock)
            self._join(sock, header, self._who(address))
        except (OSError, Closed):
            sock.close()
        except ProtocolError as error:
            detail = "sent the grader's node no header: {}".format(shown(error))
            self._guard.refused(self._who(address), detail)
            sock.close()

    def _header(self, sock):
        try:
            header = read_header(sock)
            check_fields(header)
            return header
        finally:
            with self._lock:
                self._waiting.pop(sock, None)

    def _who(self, address):
        return self._owners.caller(address, (LOOPBACK, self.port)) or UNKNOWN_PROCESS

    def _note_crowd(self):
        """Note the process that has most of the connections that said nothing. It is looked up once in a run."""
        with self._lock:
            waiting, self._crowded = None if self._crowded else list(self._waiting.values()), True
        if waiting is not None:
            whose = self._owners.callers([(address, (LOOPBACK, self.port)) for address in waiting])
            most = collections.Counter(whose).most_common(1)[0][0]
            detail = "opened more than {} connections to the grader's node that said nothing".format(
                WAITING_MAX
            )
            self._guard.limit(most or UNKNOWN_PROCESS, detail)
