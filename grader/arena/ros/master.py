"""The ROS master of one arena: ros_comm's own, with the recorder inside and its graph told to the grader.

Students' processes reach it only through `answer`, which asks `guard` first. `GraphLog` and `ParamLog` put what it
knows into the evidence: the graph after each change, and every parameter that is set. Both are bounded: the graph is
told often while there is little to tell and rarely when there is much; of parameters past the limits, the last value of
each name is told at the end.
"""

import collections
import functools
import json
import logging
import threading
import time

import rosmaster.master_api
import rosmaster.registrations
import tcpros
from bounded_sockets import ProtocolError, slave_api
from guard import OWN_NODE, ROSOUT, Rules
from links import Links
from quotas import Notifications, Pool, cut, depth, plain, weight
from rosgraph.names import resolve_name

NOTIFY_S = 10.0
OPENED_MAX, ARGUMENTS_MAX, ARGUMENT_CHARS = 100, 20, 1000
TOLD_MAX = 100
PROBE_S = 0.5
SUBSCRIBED_S = 0.3
LOOK_S = 0.01
EVERY_NODE_HAS = ("/get_loggers", "/set_logger_level")
METHODS = frozenset(
    (
        "deleteParam", "getParam", "getParamNames", "getPid", "getPublishedTopics", "getSystemState", "getTopicTypes",
        "getUri", "hasParam", "lookupNode", "lookupService", "noteOpened", "registerPublisher", "registerService",
        "registerSubscriber", "searchParam", "setParam", "shutdown", "subscribeParam", "unregisterPublisher",
        "unregisterService", "unregisterSubscriber", "unsubscribeParam",
    )
)  # fmt: skip
# rosmaster's own proxies wait without a limit: one node that never answers would hold back all later news.
_notified = functools.partial(slave_api, seconds=NOTIFY_S)
rosmaster.master_api.xmlrpcapi = rosmaster.registrations.xmlrpcapi = _notified
# Without a handler its warnings would go to stderr, whose last line the grader shows if the arena ends.
logging.getLogger("rosmaster").setLevel(logging.CRITICAL)


class RecordingMaster(rosmaster.master_api.ROSMasterHandler):
    """A node's publishers are recorded before it can publish (see `recorder`).

    `own` is the name under which the arena itself calls; `owners` says which process a node belongs to: it is asked
    while the node registers, when the process is sure to be there.
    """

    def __init__(self, loop, wire, recorder, own, *, guard, owners, own_ports=()):
        # No worker threads of rosmaster's: its queue has no bound for each node, `Notifications` has.
        super().__init__(0)
        self.thread_pool = self.reg_manager.thread_pool = Notifications()
        self._owners = owners
        self._service_types = {}
        self._wire = wire
        self._recorder = recorder
        self._own = own
        self._opened = 0
        self._told = {"lookup": {}, "read": {}}
        self._pool = Pool()
        self._calling = threading.local()
        self._guard = guard
        self._links = Links(own, owners, guard)
        owners.tell = guard.limit
        self._rules = Rules(owners, self._node_address, own_ports)
        self._params = ParamLog(wire, self._guard)
        self._graph = GraphLog(loop, wire, self._guard, self.graph)
        # Unset, every rospy.loginfo asks the master for it, and a SIGINT during that call locks the node up for ever.
        self.setParam(own, "/rosout_disable_topics_generation", False)

    def answer(self, method, args, caller):
        """Answer a call from outside."""
        if method not in METHODS:
            raise ValueError("no method {}".format(cut(method, 100)))
        fault = self._rules.why_not(method, args, caller)
        if fault:
            self._guard.refused(caller.process or _name(args), fault)
            return -1, "refused: this {}".format(fault), 0
        if self._rules.too_much(method, args, caller):
            detail = "registered more topics and services than a process may"
            self._guard.limit(caller.process or _name(args), detail)
            return -1, "refused: this {}".format(detail), 0
        self._calling.caller = caller
        try:
            return getattr(self, method)(*args)
        finally:
            self._calling.caller = None

    @property
    def _caller(self):
        """Whose call this thread answers; None for the arena itself."""
        return getattr(self._calling, "caller", None)

    @property
    def _process(self):
        return self._caller.process if self._caller else None

    def _node_address(self, node):
        """Return the address of a node, or None."""
        # rosmaster changes these maps under this lock, in the threads of calls.
        with self.ps_lock:
            known = self.reg_manager.get_node(node)
        return known.api if known else None

    def registerPublisher(self, caller_id, topic, topic_type, caller_api):
        answer = super().registerPublisher(caller_id, topic, topic_type, caller_api)
        self._owners.of(caller_api)
        # What the arena itself publishes is recorded as it is sent.
        if answer[0] == 1 and self._caller is not None:
            held = self._recorder.connect(topic, caller_id, caller_api, self._process)
            if held:
                self._await_subscribers(topic, caller_id, caller_api)
        return self._note_arrival(answer)

    def _await_subscribers(self, topic, caller_id, caller_api):
        """Wait until the subscribers that are there already are connected to a new publisher, or have had their time.

        A node that waits for a first subscriber (`while pub.get_num_connections() == 0`) counts the recorder as one,
        and would send before the others hear it.
        """
        with self.ps_lock:
            there = {name for name, _ in self.subscribers.map.get(topic, ())}
        wanted = {n for n in there if n not in {caller_id, ROSOUT} and not OWN_NODE.fullmatch(n)}
        deadline = time.monotonic() + SUBSCRIBED_S
        pause = threading.Event()
        while wanted and time.monotonic() < deadline:
            if wanted <= self._links.subscribers(caller_api, topic):
                return
            pause.wait(LOOK_S)

    def unregisterPublisher(self, caller_id, topic, caller_api):
        self._graph.before_leaving()
        return self._after(super().unregisterPublisher(caller_id, topic, caller_api))

    def registerSubscriber(self, caller_id, topic, topic_type, caller_api):
        self._owners.of(caller_api)
        return self._note_arrival(super().registerSubscriber(caller_id, topic, topic_type, caller_api))

    def unregisterSubscriber(self, caller_id, topic, caller_api):
        self._graph.before_leaving()
        return self._after(super().unregisterSubscriber(caller_id, topic, caller_api))

    def registerService(self, caller_id, service, service_api, caller_api):
        # One of the last things that rospy does in `init_node`: held here, no publisher made before sends unrecorded.
        if str(service).endswith("/get_loggers"):
            self._recorder.gate(caller_id)
        self._owners.of(caller_api)
        answer = super().registerService(caller_id, service, service_api, caller_api)
        if answer[0] == 1 and not service.endswith(EVERY_NODE_HAS):
            self._pool.submit(self._process, lambda: self._learn_type(service, service_api))
        return self._note_arrival(answer)

    def lookupService(self, caller_id, service):
        """Return the address of a service, and note who asked for it: once, or twice for one that is not there, since
        `wait_for_service` asks again and again."""
        answer = super().lookupService(caller_id, service)
        self._note_lookup("lookup", caller_id, service, is_there=answer[0] == 1)
        return answer

    def getParam(self, caller_id, key):
        # rospy asks for it in `init_node`, after it has registered what was made before.
        if key == "/use_sim_time":
            self._recorder.gate(caller_id)
        answer = super().getParam(caller_id, key)
        self._note_lookup("read", caller_id, key, is_there=answer[0] == 1)
        return answer

    def hasParam(self, caller_id, key):
        answer = super().hasParam(caller_id, key)
        self._note_lookup("read", caller_id, key, is_there=answer[2] is True, by=" (has_param)")
        return answer

    def subscribeParam(self, caller_id, caller_api, key):
        """Return a parameter that the node will be told the changes of, as `get_param_cached` and roscpp read it. For a
        name that is not there the answer is an empty map."""
        answer = super().subscribeParam(caller_id, caller_api, key)
        self._note_lookup("read", caller_id, key, is_there=answer[2] != {})
        return answer

    def _note_lookup(self, action, caller_id, name, is_there, by=""):
        """Tell the first time that a node asks for a name, and the second for a service that is not there."""
        asked, key = self._told[action], (caller_id, str(name))
        times, most = asked.get(key, 0), 2 if action == "lookup" and not is_there else 1
        if self._caller is None or times >= most:
            return
        if times or len(asked) < TOLD_MAX:
            asked[key] = times + 1
            record = {"action": action, "actor": caller_id, "topic": cut(name, ARGUMENT_CHARS)}
            self._wire.event("/grader/actor", dict(record, detail="" if is_there else "not there" + by))

    def unregisterService(self, caller_id, service, service_api):
        self._graph.before_leaving()
        return self._after(super().unregisterService(caller_id, service, service_api))

    def setParam(self, caller_id, key, value):
        fault = self._params.why_not(str(key), value, self._process) if self._caller else ""
        if fault:
            self._guard.limit(self._process or caller_id, "tried to {}".format(fault))
            return -1, "refused: more than one may {}".format(fault), 0
        answer = super().setParam(caller_id, key, value)
        if answer[0] == 1:
            self._params.note("set", key, caller_id, value, self._process)
        return answer

    def deleteParam(self, caller_id, key):
        answer = super().deleteParam(caller_id, key)
        if answer[0] == 1:
            self._params.note("delete", key, caller_id, None, self._process)
        return answer

    def noteOpened(self, caller_id, program, arguments):  # noqa: ARG002 - shaped as the master API is
        """Note what a stand-in for a browser was asked to open (see `opener`)."""
        self._opened += 1
        if self._opened <= OPENED_MAX:
            shown = [cut(argument, ARGUMENT_CHARS) for argument in list(arguments)[:ARGUMENTS_MAX]]
            record = {"action": "open", "actor": cut(program, ARGUMENT_CHARS), "value": shown}
            self._wire.event("/grader/actor", record)
        else:
            self._guard.limit(
                self._process or cut(program, ARGUMENT_CHARS), "opened more than {} things".format(OPENED_MAX)
            )
        return 1, "noted", 0

    def finish(self):
        """Tell what was left out so far and matters in the end."""
        self._params.finish()
        self._graph.tell(self.graph(), last=True)

    def graph(self, *, connections=False):
        """Return the state as a GraphEvent's fields."""
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
            "processes": {name: owner for name, api in apis.items() if (owner := self._owners.known(api))},
        }
        record["service_types"] = self._types_of(service_apis)
        if connections:
            on_topics = {node for _, nodes in (*publishers, *subscribers) for node in nodes}
            asked = sorted(n for n in on_topics & apis.keys() if n != ROSOUT and not OWN_NODE.fullmatch(n))
            found = self._links.of({node: apis[node] for node in asked})
            record["connections"], record["answered"] = found
        return record

    def tell_connections(self):
        """Tell the graph with its connections, as an event; return the connections, and whether all nodes answered."""
        record = self.graph(connections=True)
        answered = record.pop("answered")
        self._graph.tell(record)
        return record["connections"], answered

    def service_api(self, service):
        """Return where a service is offered, or None."""
        with self.ps_lock:
            return self.services.get_service_api(service)

    def _types_of(self, apis):
        """Return what the services themselves said they are."""
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
                self._graph.changed(None)
                return
            pause.wait(LOOK_S)

    def _type_of(self, service, api):
        try:
            return tcpros.probe_service(service, api, self._own, PROBE_S)
        except ProtocolError:
            return ""

    def _after(self, answer):
        self._graph.changed(self._process)
        return answer

    def _note_arrival(self, answer):
        self._graph.changed(self._process, arrival=True)
        return answer


def _name(args):
    return args[0] if args else "a node"


QUIET_S = 0.02
OFTEN_BYTES, ALL_BYTES = 3 << 20, 6 << 20
"""Of all events of a run: past the first, one in `RARELY_S`; past the second, only the last."""
RARELY_S = 2.0


class GraphLog:
    """Events of `/grader/graph`; `look` gives one's fields."""

    def __init__(self, loop, wire, guard, look):
        self._loop = loop
        self._wire = wire
        self._guard = guard
        self._look = look
        self._due = self._arrivals = False
        self._bytes = 0
        self._last_s = 0.0
        self._changes = collections.Counter()
        self._lock = threading.Lock()

    def changed(self, by, *, arrival=False):
        """Registrations come in bursts: tell once they pause. `by` is the process that made the change."""
        self._changes[by or ""] += 1
        self._arrivals = self._arrivals or arrival
        # Calls come in threads of their own; timers are the loop's.
        self._loop.call_soon(self._schedule)

    def before_leaving(self):
        """Tell the graph as it is before something leaves it, so that a node is seen however shortly it is there."""
        if self._arrivals:
            self._arrivals = False
            self.tell(self._look())

    def tell(self, record, *, last=False):
        """Write the graph as an event; where there is no room for it, note whose changes are too many."""
        size = len(json.dumps(record))
        with self._lock:
            now_s = time.monotonic()
            rarely = self._bytes + size > OFTEN_BYTES and now_s - self._last_s < RARELY_S
            if not last and (rarely or self._bytes + size > ALL_BYTES):
                left_out = True
            else:
                left_out = False
                self._bytes += size
                self._last_s = now_s
        if left_out:
            ((most, _),) = self._changes.most_common(1) or (("", 0),)
            detail = "registered and unregistered so much that not every change is recorded"
            self._guard.limit(most, detail)
        else:
            self._wire.event("/grader/graph", record)

    def _schedule(self):
        if not self._due:
            self._due = True
            self._loop.call_later(self._pause_s(), self._tell_change)

    def _pause_s(self):
        return QUIET_S if self._bytes < OFTEN_BYTES else RARELY_S

    def _tell_change(self):
        self._due = self._arrivals = False
        self.tell(self._look())


PROCESS_BYTES_MAX, RUN_BYTES_MAX = 8 << 20, 24 << 20
"""Of all values that a process, or all of them, set in a run."""
LEVELS_MAX = 24
EVENTS_MAX, EVENTS_BYTES_MAX = 4000, 4 << 20
VALUE_BYTES_MAX = 256 << 10
LATEST_MAX = 200
# Without it, no one could tell by which clock a run was timed: a flood of other parameters must not hide it.
ALWAYS = "/use_sim_time"
ALWAYS_MAX = 100
LEFT_OUT = "(more than {} KB, left out)".format(VALUE_BYTES_MAX >> 10)


class ParamLog:
    """Every change is an event of `/grader/param`, as far as there is room for it."""

    def __init__(self, wire, guard):
        self._wire = wire
        self._guard = guard
        self._set_bytes = collections.Counter()
        self._events = self._events_bytes = self._always = 0
        self._latest = collections.OrderedDict()
        self._lock = threading.Lock()

    def why_not(self, key, value, process):
        """Return why a process may not set a value, as words that follow on `tried to`; "" where it may."""
        levels = key.count("/") + depth(value, LEVELS_MAX)
        if levels > LEVELS_MAX:
            return "set parameters nested more than {} levels deep".format(LEVELS_MAX)
        size = len(key) + weight(value, PROCESS_BYTES_MAX)
        with self._lock:
            if (
                self._set_bytes[process] + size > PROCESS_BYTES_MAX
                or sum(self._set_bytes.values()) + size > RUN_BYTES_MAX
            ):
                return "set more than {} MB of parameters".format(PROCESS_BYTES_MAX >> 20)
            self._set_bytes[process] += size
        return ""

    def note(self, action, key, caller_id, value, process):
        shown = plain(value, VALUE_BYTES_MAX)
        if shown is None and value is not None:
            self._guard.limit(process or caller_id, "set a parameter that is too large for the evidence")
            shown = LEFT_OUT
        record = {"action": action, "name": str(key), "caller_id": cut(caller_id, 256), "value": shown}
        if self._has_room(record):
            self._wire.event("/grader/param", record)
            return
        self._guard.limit(
            process or caller_id, "changed parameters so often that not every change is recorded"
        )
        name = resolve_name(record["name"], record["caller_id"])
        with self._lock:
            # Taken out first, so that the order is that of the last changes.
            self._latest.pop(name, None)
            if len(self._latest) < LATEST_MAX:
                self._latest[name] = record

    def finish(self):
        """Tell the last change of each name that was left out."""
        with self._lock:
            left, self._latest = self._latest, collections.OrderedDict()
        for record in left.values():
            self._wire.event("/grader/param", record)

    def _has_room(self, record):
        # 200 for the record's other fields.
        size = 200 + weight(record["value"], VALUE_BYTES_MAX)
        with self._lock:
            if record["name"] == ALWAYS and self._always < ALWAYS_MAX:
                self._always += 1
                return True
            if self._events >= EVENTS_MAX or self._events_bytes + size > EVENTS_BYTES_MAX:
                return False
            self._events += 1
            self._events_bytes += size
        return True
