"""What students set on the parameter server: how much, and what of it goes into the evidence.

Changes past the limits of the evidence are left out; the last value of each such name comes at the end.
"""

import collections
import threading

from rosgraph.names import resolve_name
from values import cut, depth, plain, weight

PROCESS_BYTES_MAX, RUN_BYTES_MAX = 8 << 20, 24 << 20
"""Of all values that a process, or all of them, set in a run."""
LEVELS_MAX = 24
PARAM_EVENTS_MAX, PARAM_EVENTS_BYTES_MAX = 4000, 4 << 20
VALUE_BYTES_MAX = 256 << 10
LATEST_MAX = 200
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
        """Why a process may not set a value, as words that follow on `tried to`; "" where it may."""
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
            self._latest.pop(name, None)
            if len(self._latest) < LATEST_MAX:
                self._latest[name] = record

    def finish(self):
        """The last change of each name that was left out."""
        with self._lock:
            left, self._latest = self._latest, collections.OrderedDict()
        for record in left.values():
            self._wire.event("/grader/param", record)

    def _has_room(self, record):
        size = 200 + weight(record["value"], VALUE_BYTES_MAX)
        with self._lock:
            if record["name"] == ALWAYS and self._always < ALWAYS_MAX:
                self._always += 1
                return True
            if self._events >= PARAM_EVENTS_MAX or self._events_bytes + size > PARAM_EVENTS_BYTES_MAX:
                return False
            self._events += 1
            self._events_bytes += size
        return True
