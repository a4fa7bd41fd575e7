"""Waits for student's nodes in threads of which there are never too many."""

import collections
import contextlib
import threading

from bounded import port_of
from values import weight

WORKERS_MAX, EACH_MAX = 256, 64
WAITING_MAX = 1000
"""Jobs of one key."""
IDLE_S = 5.0
LARGE_BYTES = 64 << 10


class Pool:
    """At most `workers_max` jobs at a time, and `each_max` of one key (a process): who never answers takes no more
    than its own share. Jobs of one key start in order."""

    def __init__(self, workers_max=WORKERS_MAX, each_max=EACH_MAX):
        self._workers_max = workers_max
        self._each_max = each_max
        self._changed = threading.Condition()
        self._waiting = collections.OrderedDict()
        self._busy = collections.Counter()
        self._workers = self._idle = 0

    def submit(self, key, job):
        """Run it beside the caller; False where too much of that key waits already."""
        with self._changed:
            jobs = self._waiting.setdefault(key, collections.deque())
            if len(jobs) >= WAITING_MAX:
                return False
            jobs.append(job)
            if self._idle:
                self._changed.notify()
            elif self._workers < self._workers_max:
                self._workers += 1
                threading.Thread(target=self._work, daemon=True).start()
        return True

    def _work(self):
        try:
            while self._work_once():
                pass
        finally:
            with self._changed:
                self._workers -= 1

    def _work_once(self):
        """Run one job; False where none came for a while."""
        with self._changed:
            found = self._next()
            if found is None:
                self._idle += 1
                self._changed.wait(IDLE_S)
                self._idle -= 1
                found = self._next()
        if found is None:
            return False
        key, job = found
        try:
            job()
        finally:
            self._done(key)
        return True

    def _next(self):
        for key, jobs in self._waiting.items():
            if self._busy[key] < self._each_max:
                job = jobs.popleft()
                self._busy[key] += 1
                del self._waiting[key]
                if jobs:
                    self._waiting[key] = jobs
                return key, job
        return None

    def _done(self, key):
        with self._changed:
            self._busy[key] -= 1
            if not self._busy[key]:
                del self._busy[key]
            if self._waiting and self._idle:
                self._changed.notify()


class Notifications:
    """What rosmaster queues for nodes (a new publisher, a changed parameter, a name that was taken over), in the
    shape of its own thread pool. One node gets them one after the other, in order; large ones, of which each takes
    memory anew, are told to one node at a time."""

    def __init__(self):
        self._pool = Pool(each_max=1)
        self._large = Pool(workers_max=1)

    def queue_task(self, marker, task, args):
        """`marker` is the address of the node that the task speaks to."""

        def job():
            with contextlib.suppress(Exception):  # whatever a node answers, or does not: nobody waits for it
                task(*args)

        large = weight(args, LARGE_BYTES) > LARGE_BYTES
        return (self._large if large else self._pool).submit(port_of(marker), job)

    def join_all(self, wait_for_tasks=True, wait_for_threads=True):
        """Its threads end with the arena."""
