"""The ROS master of one arena: ros_comm's own, with the recorder inside and its graph told to the grader."""

import threading
import time

import rosmaster.master_api
import services
from rosgraph.xmlrpc import XmlRpcNode
from tcpros import ProtocolError, call, slave_api

GRAPH_QUIET_S = 0.02
BUS_INFO_S = 0.5
OPENED_MAX, ARGUMENTS_MAX, ARGUMENT_CHARS = 200, 50, 2000
PROBE_S = 0.5
SUBSCRIBED_S = 0.3
LOOK_S = 0.01
EVERY_NODE_HAS = ("/get_loggers", "/set_logger_level")


class RecordingMaster(rosmaster.master_api.ROSMasterHandler):
    """A node's publishers are recorded before it can publish (see `recorder`).

    `owner` gives the name of the process whose node has a slave API, or None; it is asked while the node registers,
    when the process is sure to be there.
    """

    def __init__(self, loop, wire, recorder, own_prefix, owner):
        super().__init__(3)
        self._owner = owner
        self._service_types = {}
        self._loop = loop
        self._wire = wire
        self._recorder = recorder
        self._own_prefix = own_prefix
        self._graph_due = False
        self._arrivals = False
        self._opened = 0
        self.listening = threading.Event()
        # Unset, every rospy.loginfo asks the master for it, and a SIGINT during that call locks the node up for ever.
        self.param_server.set_param("/rosout_disable_topics_generation", False)

    def _ready(self, uri):
        super()._ready(uri)
        self.listening.set()

    def registerPublisher(self, caller_id, topic, topic_type, caller_api):
        answer = super().registerPublisher(caller_id, topic, topic_type, caller_api)
        self._owner(caller_api)
        if answer[0] == 1 and not caller_id.startswith(self._own_prefix):
            held = self._recorder.connect(topic, caller_id, caller_api)
            if held:
                self._await_subscribers(topic, caller_id, caller_api)
        return self._arrived(answer)

    def _await_subscribers(self, topic, caller_id, caller_api):
        """Those that are there already shall not miss the first message because the publisher counts the recorder
        as one of them (`while pub.get_num_connections() == 0`)."""
        with self.ps_lock:
            there = {name for name, _ in self.subscribers.map.get(topic, ())}
        wanted = {n for n in there if n != caller_id and not n.startswith(self._own_prefix)}
        deadline = time.monotonic() + SUBSCRIBED_S
        pause = threading.Event()
        while wanted and time.monotonic() < deadline:
            found = {c["subscriber"] for c in self._connections(caller_id, caller_api) if c["topic"] == topic}
            if wanted <= found:
                return
            pause.wait(LOOK_S)

    def unregisterPublisher(self, caller_id, topic, caller_api):
        self._before_leaving()
        return self._after(super().unregisterPublisher(caller_id, topic, caller_api))

    def registerSubscriber(self, caller_id, topic, topic_type, caller_api):
        self._owner(caller_api)
        return self._arrived(super().registerSubscriber(caller_id, topic, topic_type, caller_api))

    def unregisterSubscriber(self, caller_id, topic, caller_api):
        self._before_leaving()
        return self._after(super().unregisterSubscriber(caller_id, topic, caller_api))

    def registerService(self, caller_id, service, service_api, caller_api):
        if str(service).endswith("/get_loggers"):
            self._recorder.gate(caller_id)
        self._owner(caller_api)
        if not str(service).endswith(EVERY_NODE_HAS):
            threading.Thread(target=self._learn_type, args=(service, service_api), daemon=True).start()
        return self._arrived(super().registerService(caller_id, service, service_api, caller_api))

    def getParam(self, caller_id, key):
        if key == "/use_sim_time":
            self._recorder.gate(caller_id)
        return super().getParam(caller_id, key)

    def unregisterService(self, caller_id, service, service_api):
        self._before_leaving()
        return self._after(super().unregisterService(caller_id, service, service_api))

    def setParam(self, caller_id, key, value):
        answer = super().setParam(caller_id, key, value)
        self._param("set", key, caller_id, value)
        return answer

    def deleteParam(self, caller_id, key):
        answer = super().deleteParam(caller_id, key)
        self._param("delete", key, caller_id, None)
        return answer

    def shutdown(self, caller_id, msg=""):  # noqa: ARG002 - the master API
        """A student's node has no business ending the master: refused, and noted."""
        self._wire.event(
            "/grader/actor",
            {"action": "note", "actor": str(caller_id), "detail": "asked the master to shut down; refused"},
        )
        return -1, "refused", 0

    def noteOpened(self, caller_id, program, arguments):  # noqa: ARG002 - shaped as the master API is
        """What a stand-in for a browser was asked to open (see `opener`)."""
        self._opened += 1
        if self._opened <= OPENED_MAX:
            shown = [str(argument)[:ARGUMENT_CHARS] for argument in arguments[:ARGUMENTS_MAX]]
            record = {"action": "open", "actor": str(program)[:ARGUMENT_CHARS], "value": shown}
            self._wire.event("/grader/actor", record)
        return 1, "noted", 0

    def graph(self, *, connections=False):
        """The state as a GraphEvent's fields."""
        with self.ps_lock:
            publishers = self.publishers.get_state()
            subscribers = self.subscribers.get_state()
            offered = self.services.get_state()
            service_apis = {name: self.services.get_service_api(name) for name, _ in offered}
            types = dict(self.topics_types)
            apis = {name: ref.api for name, ref in self.reg_manager.nodes.items()}
        record = {
            "nodes": sorted(apis),
            "topic_types": types,
            "publishers": dict(publishers),
            "subscribers": dict(subscribers),
            "services": dict(offered),
            "processes": {name: owner for name, api in apis.items() if (owner := self._owner(api))},
        }
        record["service_types"] = self._types_of(service_apis)
        if connections:
            publishing = {node for _, nodes in publishers for node in nodes}
            record["connections"] = [
                found
                for node in sorted(publishing)
                if not node.startswith(self._own_prefix) and apis.get(node)
                for found in self._connections(node, apis[node])
            ]
        return record

    def service_api(self, service):
        """Where a service is offered, or None."""
        with self.ps_lock:
            return self.services.get_service_api(service)

    def _types_of(self, apis):
        """What the services themselves said they are."""
        found = {name: self._service_types.get((name, api)) for name, api in apis.items()}
        return {name: type_ for name, type_ in found.items() if type_}

    def _learn_type(self, service, api):
        """Ask a service what it is, as soon as its node can answer."""
        deadline = time.monotonic() + PROBE_S
        pause = threading.Event()
        while time.monotonic() < deadline:
            found = self._type_of(service, api)
            if found:
                self._service_types[service, api] = found
                self._graph_changed()
                return
            pause.wait(LOOK_S)

    def _type_of(self, service, api):
        try:
            return services.probe(service, api, self._own_prefix, PROBE_S)
        except ProtocolError:
            return ""

    def _connections(self, node, api):
        """The node's outgoing connections, as the node itself reports them."""
        try:
            entries = call(slave_api(api, BUS_INFO_S).getBusInfo, self._own_prefix)
        except (ProtocolError, ValueError):
            return
        for entry in entries if isinstance(entries, list) else ():
            if isinstance(entry, list) and len(entry) >= 5 and entry[2] == "o":
                subscriber, topic = str(entry[1]), str(entry[4])
                if not subscriber.startswith(self._own_prefix):
                    yield {"topic": topic, "publisher": node, "subscriber": subscriber}

    def _after(self, answer):
        self._graph_changed()
        return answer

    def _arrived(self, answer):
        self._arrivals = True
        return self._after(answer)

    def _before_leaving(self):
        """A node that comes and goes between two looks at the graph shall be seen all the same."""
        if self._arrivals:
            self._arrivals = False
            self._wire.event("/grader/graph", self.graph())

    def _graph_changed(self):
        """Registrations come in bursts: tell the grader once they pause."""
        self._loop.call_soon(self._schedule_graph)

    def _schedule_graph(self):
        if not self._graph_due:
            self._graph_due = True
            self._loop.call_later(GRAPH_QUIET_S, self._tell_graph)

    def _tell_graph(self):
        self._graph_due = self._arrivals = False
        self._wire.event("/grader/graph", self.graph())

    def _param(self, action, key, caller_id, value):
        if isinstance(value, (bytes, bytearray)) or type(value).__name__ in ("Binary", "DateTime"):
            value = repr(value)
        record = {"action": action, "name": str(key), "caller_id": str(caller_id), "value": value}
        self._wire.event("/grader/param", record)


def serve(handler, port, patience_s=5.0):
    """Serve the XML-RPC API of a handler that sets its event `listening`; return its URI."""
    node = XmlRpcNode(port, handler)
    node.start()
    if not handler.listening.wait(patience_s):
        raise OSError("no XML-RPC server on port {} after {} s".format(port, patience_s))
    return node.uri
