"""The grader's own publishers: probe messages, `/clock`, `/rosout_agg`.

The bytes come ready-made from the grader, so the arena needs no message classes. What is sent is recorded in the
moment of sending, not by a detour over the network.
"""

import os
import socket
import struct
import threading
import time

from rosgraph.xmlrpc import XmlRpcHandler
from tcpros import LENGTH, ProtocolError, read_header, write_header
from wire import now_ns

HANDSHAKE_S = 2.0
CLOCK = {
    "topic": "/clock",
    "type": "rosgraph_msgs/Clock",
    "md5sum": "a9c97c1d230cfc112e270351a944ee47",
    "definition": "time clock\n",
    "latching": True,
}
TIME = struct.Struct("<II")
NS = 1000000000


class SlaveApi(XmlRpcHandler):
    """The part of the slave API that subscribers and tools use (wiki.ros.org/ROS/Slave_API)."""

    def __init__(self, actor):
        super().__init__()
        self._actor = actor
        self.listening = threading.Event()

    def _ready(self, uri):  # noqa: ARG002 - rosgraph calls it so
        self.listening.set()

    def requestTopic(self, _caller_id, topic, protocols):
        if topic not in self._actor.topics or ["TCPROS"] not in protocols:
            return 0, "no such topic or protocol", []
        return 1, "ready", ["TCPROS", self._actor.host, self._actor.port]

    def getPid(self, _caller_id):
        return 1, "", os.getpid()

    def getMasterUri(self, _caller_id):
        return 1, "", os.environ["ROS_MASTER_URI"]

    def getSubscriptions(self, _caller_id):
        return 1, "", []

    def getPublications(self, _caller_id):
        return 1, "", [[t.name, t.type] for t in self._actor.topics.values()]

    def getBusInfo(self, _caller_id):
        return 1, "", []

    def getBusStats(self, _caller_id):
        return 1, "", [[], [], []]

    def publisherUpdate(self, _caller_id, _topic, _publishers):
        return 1, "", 0

    def paramUpdate(self, _caller_id, _key, _value):
        return 1, "", 0

    def shutdown(self, _caller_id, _message=""):
        return 1, "", 0


class _Topic:
    def __init__(self, fields, channel):
        self.name = fields["topic"]
        self.type = fields["type"]
        self.latching = fields["latching"]
        self.header = {
            "type": fields["type"],
            "md5sum": fields["md5sum"],
            "message_definition": fields["definition"],
            "latching": "1" if fields["latching"] else "0",
        }
        self.channel = channel
        self.subscribers = {}
        self.last = None
        self.lock = threading.Lock()


class Actor:
    """One node, `/grader_…`, with a TCPROS server for any number of topics."""

    def __init__(self, loop, wire, caller_id):
        self.topics = {}
        self.caller_id = caller_id
        self.host = "127.0.0.1"
        self._loop = loop
        self._wire = wire
        self._server = socket.create_server((self.host, 0), backlog=64)
        self.port = self._server.getsockname()[1]
        self.uri = None
        loop.add_reader(self._server, self._accept)

    def advertise(self, master, fields):
        """Register a topic; `fields` holds topic, type, md5sum, definition, latching."""
        channel = self._wire.channel(callerid=self.caller_id, **fields)
        self.topics[fields["topic"]] = _Topic(fields, channel)
        master.registerPublisher(self.caller_id, fields["topic"], fields["type"], self.uri)

    def publish(self, topic_name, data):
        """Send and record one message."""
        topic = self.topics[topic_name]
        frame = LENGTH.pack(len(data)) + data
        with topic.lock:
            topic.last = frame
            self._wire.messages(topic.channel, [data], now_ns())
            for sock in list(topic.subscribers):
                self._send(topic, sock, frame)

    def subscribers(self, topic_name):
        return list(self.topics[topic_name].subscribers.values())

    def _send(self, topic, sock, frame):
        try:
            if sock.send(frame) == len(frame):
                return
        except OSError:
            pass  # gone, or not reading any more: either way it is no subscriber
        topic.subscribers.pop(sock, None)
        sock.close()

    def _accept(self):
        sock, _ = self._server.accept()
        sock.settimeout(HANDSHAKE_S)
        threading.Thread(target=self._handshake, args=(sock,), daemon=True).start()

    def _handshake(self, sock):
        try:
            header = read_header(sock)
            topic = self.topics.get(header.get("topic"))
            problem = self._mismatch(topic, header)
            if problem:
                write_header(sock, {"error": problem})
                sock.close()
                return
            write_header(sock, dict(topic.header, callerid=self.caller_id))
        except (OSError, ProtocolError):
            sock.close()
            return
        subscriber = str(header.get("callerid", ""))
        with topic.lock:
            if topic.latching and topic.last:
                sock.sendall(topic.last)
            sock.setblocking(False)
            topic.subscribers[sock] = subscriber
        self._wire.status("subscribed", topic=topic.name, subscriber=subscriber)

    def _mismatch(self, topic, header):
        if topic is None:
            return "no such topic"
        for field in ("type", "md5sum"):
            if header.get(field) not in ("*", topic.header[field]):
                asked = {"topic": topic.name, "type": header.get("type")}
                note = {
                    "action": "note",
                    "actor": str(header.get("callerid")),
                    "detail": "asks for another type",
                }
                self._wire.event("/grader/actor", dict(asked, **note))
                return "{} differs: this topic carries {}".format(field, topic.type)
        return ""


class Clock:
    """`/clock`, `warp` times faster than the wall in steps of `step_s`, once a node other than rosout listens.

    A late wake-up makes the clock slower, never jumpy: no step is ever caught up.
    """

    def __init__(self, actor, warp, step_s):
        self._actor = actor
        self._step_s = step_s
        self._pause_s = step_s / warp
        self._step_ns = int(step_s * NS)
        self._now_ns = int(time.time()) * NS
        self._stopped = threading.Event()

    def start(self):
        self._tick()
        threading.Thread(target=self._run, daemon=True).start()

    def set_warp(self, warp):
        self._pause_s = self._step_s / warp

    def stop(self):
        self._stopped.set()

    def _run(self):
        while not self._stopped.wait(self._pause_s):
            if any(name != "/rosout" for name in self._actor.subscribers("/clock")):
                self._now_ns += self._step_ns
                self._tick()

    def _tick(self):
        self._actor.publish("/clock", TIME.pack(*divmod(self._now_ns, NS)))
