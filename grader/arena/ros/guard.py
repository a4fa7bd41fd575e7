"""What students' processes may not do to the arena, and what they may not have too much of: told, and bounded.

ROS lets everybody do everything in everybody's name. What honest programs do is let through: a second node of a name
takes the first one's place, `rosnode cleanup` unregisters nodes that are gone, anybody sets any parameter.
"""

import collections
import json
import re
import threading

from bounded_sockets import port_of
from quotas import cut

EVENTS_MAX = 50
NAME_CHARS_MAX = 256
KEY_CHARS_MAX = 1024
SHOWN_CHARS = 80
NAMES_MAX, NAME_BYTES_MAX = 2000, 256 << 10
"""Of one process: topics and services with the nodes that have them."""
OWN_NODE = re.compile(r"/grader_(recorder|actor|calibration)_[0-9a-f]{8}(_knock)?")
ROSOUT = "/rosout"
"""ROS's node that collects log messages, and their topic: the grader's own node stands in for it."""
REGISTER = {
    "registerPublisher": (3,),
    "registerSubscriber": (3,),
    "registerService": (3, 2),
    "subscribeParam": (1,),
}
UNREGISTER = {
    "unregisterPublisher": 2,
    "unregisterSubscriber": 2,
    "unregisterService": 2,
    "unsubscribeParam": 1,
}
"""Methods of the master, and which of their arguments are addresses; the first is a node's, or the service's."""


class Guard:
    """Tells what was refused or too much: at most `EVENTS_MAX` events of each kind, equal ones once."""

    def __init__(self, wire):
        self._wire = wire
        self._told = collections.defaultdict(set)
        self._lock = threading.Lock()

    def refused(self, actor, detail):
        self._tell("refused", actor, detail)

    def limit(self, actor, detail):
        self._tell("limit", actor, detail)

    def _tell(self, action, actor, detail):
        record = {
            "action": action,
            "actor": cut(actor, NAME_CHARS_MAX),
            "detail": cut(detail, 2 * NAME_CHARS_MAX),
        }
        with self._lock:
            told = self._told[action]
            key = record["actor"], record["detail"]
            if key in told or len(told) >= EVENTS_MAX:
                return
            told.add(key)
        self._wire.event("/grader/actor", record)


class Rules:
    """Whether a process may make a call of the master API.

    `registered` gives the address that a node has registered, or None; `own_ports` are the arena's own.
    """

    def __init__(self, owners, registered, own_ports):
        self._owners = owners
        self._registered = registered
        self._own_ports = own_ports
        self._names = Names()

    def why_not(self, method, args, caller):
        """Return what the caller tried that it may not do, in words; "" where it may."""
        node = args[0] if args else ""
        fault = self._no_name(args) or self._foreign_name(node)
        if fault:
            return fault
        if method == "shutdown":
            return "asked the master to shut down"
        if method in REGISTER:
            return self._may_register(method, args, caller)
        if method in UNREGISTER:
            return self._may_unregister(method, args, caller)
        return ""

    def too_much(self, method, args, caller):
        """Return whether a registration is one more than its process may have."""
        return method in REGISTER and not self._names.take(caller.process, (method, *map(str, args)))

    def _no_name(self, args):
        for number, text in enumerate(args):
            most = KEY_CHARS_MAX if number else NAME_CHARS_MAX
            if isinstance(text, str) and number < 2 and (len(text) > most or not text.isprintable()):
                return "called the master with something that is not a name: {}".format(shown(text))
        if args and not isinstance(args[0], str):
            return "called the master with a name that is not a string"
        return ""

    def _foreign_name(self, node):
        if OWN_NODE.fullmatch(node):
            return "called the master in the name of the grader's node {}".format(node)
        if node == ROSOUT:
            return "called the master in the name of {}".format(ROSOUT)
        return ""

    def _may_register(self, method, args, caller):
        if len(args) <= max(REGISTER[method]) or not all(isinstance(text, str) for text in args):
            return ""  # the master itself says what is wrong with it
        node, name = args[0], args[1]
        # Names go into events and reports.
        if any(len(text) > NAME_CHARS_MAX or not text.isprintable() for text in args):
            return "registered {} with something that is not a name: {}".format(
                shown(node), shown(max(args, key=len))
            )
        addresses = [args[number] for number in REGISTER[method]]
        for address in addresses:
            port = port_of(address)
            if port is None or port in self._own_ports:
                return "registered {} with the address {}, which is not its own".format(
                    shown(node), shown(address)
                )
        for address in addresses:
            owner = self._other_owner(address, caller)
            if owner:
                return "registered {} with an address of {}".format(shown(node), owner)
        return self._may_take(node, name, addresses[0], caller)

    def _may_take(self, node, name, address, caller):
        """Return what is wrong with taking over a node's name, "" if nothing is: another process's node gives way only
        to an address at which a process listens."""
        # rosmaster tells the old node to shut down, so an address that no one has would end another process's node.
        known = self._registered(node)
        if known is None or known == address or self._owners.of(address) is not None:
            return ""
        owner = self._other_owner(known, caller)
        if owner:
            return "registered {} for {}, a node of {}, with an address that no process has".format(
                shown(name), shown(node), owner
            )
        return ""

    def _may_unregister(self, method, args, caller):
        number = UNREGISTER[method]
        if len(args) <= number:
            return ""
        owner = self._other_owner(args[number], caller)
        if owner:
            name = args[2] if method == "unsubscribeParam" and len(args) > 2 else args[1]
            return "unregistered {} of {}, a node of {}".format(shown(name), shown(args[0]), owner)
        return ""

    def _other_owner(self, address, caller):
        """Return the process, other than the caller, that is at this address now; None where there is none."""
        # What is known already decides most cases: a look at all processes is dear. Only a conflict is worth one.
        if self._owners.of(address) in (None, caller.process):
            return None
        owner = self._owners.look(address)
        return None if owner in (None, caller.process) else owner


class Names:
    """What each process has registered in the run, gone or not."""

    def __init__(self):
        self._held = collections.defaultdict(set)
        self._bytes = collections.Counter()
        self._lock = threading.Lock()

    def take(self, process, entry):
        """Take a name for the process; return False where it has too many already, or too long ones."""
        with self._lock:
            held = self._held[process]
            if entry in held:
                return True
            size = sum(len(json.dumps(text)) for text in entry)  # as an event of the graph holds them
            if len(held) >= NAMES_MAX or self._bytes[process] + size > NAME_BYTES_MAX:
                return False
            held.add(entry)
            self._bytes[process] += size
        return True


def shown(text):
    """Return the text as it can stand in a sentence: short, and nothing that is not to be seen."""
    text = str(text)
    clean = "".join(c if c.isprintable() else "?" for c in text[: SHOWN_CHARS + 1])
    return cut(clean, SHOWN_CHARS)
