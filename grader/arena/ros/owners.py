"""Which process of the run a node belongs to, and which one calls: the one that holds the socket.

A node's is the one that listens on the port of its slave API, so nodes that `roslaunch` starts are known too, and two
copies that fight for one name. A caller's is the one that is connected from the port that the call comes from.
"""

import collections
import itertools
import os
import threading
import time

import sockets
from bounded import port_of

LOOKS_MAX = 3
AGAIN_S = 0.2
ASKED_MAX = 5000
FILES_MAX = 50000
"""Open files of one process, with all that runs below it, that a look looks at."""
REST = 2
"""So many times as long as the last look took, there is no other."""


class Owners:
    """`trees` gives, for each process of the run that lives, its name and the ids of all that runs below it. `tell` is
    told, as `guard.limit` is, which process has more than is looked at."""

    def __init__(self, trees):
        self._trees = trees
        self.tell = None
        self._known = {}
        self._asked = {}
        self._looking = threading.Lock()
        self._looked_s = self._look_took_s = 0.0
        self._holders = {}
        self._pids = {}

    def of(self, api):
        """The name of the process whose node has this address; None where it cannot be told."""
        if api not in self._known and self._may_look(api):
            self.look(api)
        return self._known.get(api)

    def known(self, api):
        """The same, without a look."""
        return self._known.get(api)

    def look(self, api):
        """The owner, found out anew: ports are used again."""
        port = port_of(api)
        owner = self._holder(sockets.listening(port)) if port else None
        if owner is not None:
            self._known[api] = owner
        return owner

    def caller(self, near, far):
        """The name of the process whose connection goes from `near` to `far`, both (address, port), or None."""
        return self._holder(sockets.connected(near, far))

    def callers(self, connections):
        """The same of many connections, each (near, far)."""
        inodes = [next(iter(sockets.connected(*ends)), None) for ends in connections]
        with self._looking:
            self._look_at_all()
            return [self._holders.get("socket:[{}]".format(inode)) for inode in inodes]

    def pids(self, inodes):
        """For each of these sockets the ids of the processes that have it open: one look at all of them."""
        with self._looking:
            self._look_at_all()
            return {inode: self._pids.get("socket:[{}]".format(inode), frozenset()) for inode in inodes}

    def _may_look(self, api):
        """An address that nobody listens on costs a few looks, not one at every change of the graph."""
        now_s = time.monotonic()
        looks, last_s = self._asked.get(api, (0, 0.0))
        if looks >= LOOKS_MAX or now_s - last_s < AGAIN_S or len(self._asked) > ASKED_MAX:
            return False
        self._asked[api] = looks + 1, now_s
        return True

    def _holder(self, inodes):
        """The process that has one of these sockets open. Many who ask at once share one look at all processes."""
        wanted = ["socket:[{}]".format(inode) for inode in inodes]
        if not wanted:
            return None
        asked_s = time.monotonic()
        with self._looking:
            if self._looked_s < asked_s:
                self._look_at_all()
            return next((self._holders[link] for link in wanted if link in self._holders), None)

    def _look_at_all(self):
        """Thousands of open files make looks rarer, not the arena slower."""
        pause_s = REST * self._look_took_s - (time.monotonic() - self._looked_s)
        if pause_s > 0:
            threading.Event().wait(pause_s)
        self._looked_s = time.monotonic()
        self._holders, self._pids = {}, collections.defaultdict(set)
        for name, pids in self._trees():
            for pid, link in self._open_sockets(name, pids):
                self._holders.setdefault(link, name)
                self._pids[link].add(pid)
        self._look_took_s = time.monotonic() - self._looked_s

    def _open_sockets(self, name, pids):
        files = ((pid, "/proc/{}/fd/{}".format(pid, number)) for pid in pids for number in _descriptors(pid))
        for pid, file in itertools.islice(files, FILES_MAX):
            link = _target(file)
            if link.startswith("socket:"):
                yield pid, link
        if self.tell and next(files, None) is not None:
            self.tell(name, "had more than {} files open: not all of them are looked at".format(FILES_MAX))


def _descriptors(pid):
    try:
        return os.listdir("/proc/{}/fd".format(pid))
    except OSError:
        return ()  # it has ended, or is not ours to look into


def _target(link):
    try:
        return os.readlink(link)
    except OSError:
        return ""  # closed meanwhile
