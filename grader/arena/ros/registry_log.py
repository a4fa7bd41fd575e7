"""Puts what the master knows into the evidence: the graph after each change, and every parameter that is set.

Both are bounded: the graph is told often while there is little to tell and rarely when there is much; of parameters
past the limits, the last value of each name is told at the end.
"""

import collections
import json
import threading
import time

from quotas import cut, depth, plain, weight
from rosgraph.names import resolve_name

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
        self._loop.call_soon(self._schedule)

    def before_leaving(self):
        """A node that comes and goes between two looks at the graph shall be seen all the same."""
        if self._arrivals:
            self._arrivals = False
            self.tell(self._look())

    def tell(self, record, *, last=False):
        """As an event, where there is room for it."""
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
            self._loop.call_later(self._pause_s(), self._changed)

    def _pause_s(self):
        return QUIET_S if self._bytes < OFTEN_BYTES else RARELY_S

    def _changed(self):
        self._due = self._arrivals = False
        self.tell(self._look())


PROCESS_BYTES_MAX, RUN_BYTES_MAX = 8 << 20, 24 << 20
"""Of all values that a process, or all of them, set in a run."""
LEVELS_MAX = 24
EVENTS_MAX, EVENTS_BYTES_MAX = 4000, 4 << 20
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
