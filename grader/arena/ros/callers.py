"""Who is at the other end of a connection to the arena, and how often they may call."""

import threading
import time

SOMEBODY = "an unknown process"


class Pace:
    """At most so many a second, in the long run."""

    def __init__(self, per_s, at_once):
        self._per_s, self._at_once = per_s, at_once
        self._next_s = 0.0
        self._lock = threading.Lock()

    def wait_s(self, count):
        """How long these calls have to wait (s)."""
        now_s = time.monotonic()
        with self._lock:
            self._next_s = max(self._next_s, now_s - self._at_once / self._per_s) + count / self._per_s
            return self._next_s - now_s


class Caller:
    """Who is at the other end of a connection; `process` is looked up when it is first asked for."""

    def __init__(self, owners, near, far):
        self._owners = owners
        self._ends = near, far
        self._found = None
        self._looked = False

    @property
    def process(self):
        """The name of the process of the run, or None."""
        if not self._looked:
            self._looked = True
            self._found = self._owners.caller(*self._ends)
        return self._found

    @property
    def name(self):
        return self.process or SOMEBODY
