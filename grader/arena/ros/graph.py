"""Tells the grader what is registered, after each change: often while there is little to tell, rarely when much."""

import collections
import json
import threading
import time

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
