"""How much of the arena students' programs may take: recorded messages, threads that wait for them, memory of values.

No program's flood takes what is another's.
"""

import collections
import contextlib
import itertools
import threading

from bounded_sockets import port_of

MESSAGE_BYTES = 150
"""What a message takes beside its own bytes, in the evidence and where it is judged."""
WORKERS_MAX, EACH_MAX = 256, 64
WAITING_MAX = 1000
"""Jobs of one key."""
IDLE_S = 5.0
LARGE_BYTES = 64 << 10
ITEM_BYTES = 64


class Budget:
    """How many messages and bytes of a run are recorded, and of which channel. `limits` holds `channel_messages`,
    `channel_bytes`, `run_bytes` and `channels`.

    A quarter of the run's bytes is set apart, the same for each channel that there may be. Of the rest a channel takes
    no more than a part that gets smaller with every other one that needs more than was set apart for it; of the
    channels a process has at most half of what is left.
    """

    def __init__(self, limits):
        self.channel_messages = limits["channel_messages"]
        self.channel_bytes = limits["channel_bytes"]
        self.run_bytes = limits.get("run_bytes", 64 << 20)
        self.channels_max = limits.get("channels", 300)
        self.own_share = self.run_bytes // 4 // self.channels_max
        self._shared_left = self.run_bytes - self.run_bytes // 4
        self._channels = {}
        self._heavy = set()
        self._of_process = {}
        self._lock = threading.Lock()

    def open(self, key, process):
        """Return the account of a channel, a new one if there is room for it, else None. `key` is all that makes the
        channel what it is: topic, publisher, type, MD5 sum and definition."""
        with self._lock:
            if key not in self._channels:
                held = self._of_process.get(process, 0)
                others = len(self._channels) - held
                size = sum(map(len, key))
                # Half of what is left: the first process to advertise many topics leaves room for the next.
                if held >= (self.channels_max - others + 1) // 2 or size > self._shared_left:
                    return None
                self._shared_left -= size
                self._of_process[process] = held + 1
                self._channels[key] = Account(self)
            return self._channels[key]

    def take(self, account, size, messages):
        """Return whether so many more messages, of so many bytes together, are recorded."""
        size += MESSAGE_BYTES * messages
        with self._lock:
            total = account.messages + messages
            if total > self.channel_messages or account.bytes + size > self.channel_bytes:
                return False
            if account.bytes + size > self.own_share:
                self._heavy.add(account)
                share = self.run_bytes // (len(self._heavy) + 1)
                if size > self._shared_left or account.bytes + size > share:
                    return False
                self._shared_left -= size
            account.bytes += size
            account.messages = total
        return True


class Account:
    """What a channel has used, and the id under which the grader knows it."""

    def __init__(self, budget):
        self.budget = budget
        self.messages = self.bytes = 0
        self.channel = None

    @property
    def heavy(self):
        """Whether it has more than was set apart for it."""
        return self.bytes > self.budget.own_share

    def take(self, size, messages=1):
        return self.budget.take(self, size, messages)


class Pool:
    """Threads that wait for students' nodes: at most `workers_max` jobs at a time, and `each_max` of one key (a
    process). So a node that never answers takes no more than its process's share. Jobs of one key start in order."""

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
            # A worker that was woken counts as idle until it runs: it takes one job only, and that may wait for long.
            # How many may begin is counted last: with all workers at work, a flood of keys would be counted each time.
            if self._workers < self._workers_max and self._startable() > self._idle:
                self._workers += 1
                threading.Thread(target=self._work, daemon=True).start()
            else:
                self._changed.notify()
        return True

    def _startable(self):
        """Return how many of the jobs that wait may begin now, as far as their keys' shares go."""
        return sum(min(len(jobs), self._each_max - self._busy[key]) for key, jobs in self._waiting.items())

    def _work(self):
        while self._work_once():
            pass

    def _work_once(self):
        """Run one job; return False, and leave, where none came for a while."""
        with self._changed:
            found = self._next()
            if found is None:
                self._idle += 1
                self._changed.wait(IDLE_S)
                self._idle -= 1
                found = self._next()
            if found is None:
                self._workers -= 1  # under the same lock: a job that comes next is not left to this one
                return False
        key, job = found
        try:
            job()
        except BaseException:
            with self._changed:
                self._workers -= 1
            raise
        finally:
            self._finish(key)
        return True

    def _next(self):
        # In order of their turns; a key with its share of threads is passed over.
        for key, jobs in self._waiting.items():
            if self._busy[key] < self._each_max:
                job = jobs.popleft()
                self._busy[key] += 1
                # To the end of the queue, so that the keys take turns.
                del self._waiting[key]
                if jobs:
                    self._waiting[key] = jobs
                return key, job
        return None

    def _finish(self, key):
        with self._changed:
            self._busy[key] -= 1
            if not self._busy[key]:
                del self._busy[key]
            if self._waiting and self._idle:
                self._changed.notify()


class Notifications:
    """What rosmaster queues for nodes (a new publisher, a changed parameter, a name that was taken over), in the
    shape of its own thread pool. One node gets them one after the other, in order; large ones, of which each takes
    memory again, are told to one node at a time."""

    def __init__(self):
        self._pool = Pool(each_max=1)
        self._large = Pool(workers_max=1)

    def queue_task(self, marker, task, args):
        """Queue a task of rosmaster's; `marker` is the address of the node that it speaks to."""

        def job():
            with contextlib.suppress(
                Exception
            ):  # rosmaster's tasks raise whatever the node's answer makes them
                task(*args)

        large = weight(args, LARGE_BYTES) > LARGE_BYTES
        return (self._large if large else self._pool).submit(port_of(marker), job)

    def join_all(self, wait_for_tasks=True, wait_for_threads=True):
        """Its threads end with the arena."""


def weight(value, most):
    """Return about how many bytes of memory it takes; counting ends past `most`."""
    total, waiting = 0, [iter((value,))]
    while waiting and total <= most:
        for item in waiting.pop():
            total += ITEM_BYTES
            if isinstance(item, (str, bytes)):
                total += len(item)
            elif isinstance(item, dict):
                waiting += [iter(item), iter(item.values())]
            elif isinstance(item, (list, tuple)):
                waiting.append(iter(item))
            elif hasattr(item, "data"):  # xmlrpc.client.Binary
                total += len(item.data)
            if total > most:
                break
    return total


def depth(value, most):
    """Return how many maps and lists are one inside the other; counting ends past `most`."""
    level, inside = 0, [value]
    while level <= most:
        inside = list(itertools.chain.from_iterable(_items(item) for item in inside))
        if not inside:
            return level
        level += 1
    return level


def plain(value, most):
    """Return a copy that JSON can hold, or None if that is more than `most` bytes."""
    return _plain(value) if weight(value, most) <= most else None


def _plain(value):
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return repr(value)


def _items(value):
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, (list, tuple)) else ()


def cut(text, chars_max):
    """Return a value as text that is no longer than that."""
    text = str(text)
    return text if len(text) <= chars_max else text[: chars_max - 1] + "…"
