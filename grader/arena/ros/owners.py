"""Which process of the run a node belongs to, and which one calls: the one that holds the socket.

A node's is the one that listens on the port of its slave API, so nodes that `roslaunch` starts are known too, and two
copies that fight for one name. A caller's is the one that is connected from the port that the call comes from.
"""

import contextlib
import os
import time

from bounded import port_of

TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
CONNECTED, LISTENING = "01", "0A"
LOOKS_MAX = 3
AGAIN_S = 0.2
ASKED_MAX = 5000


class Owners:
    """`trees` gives, for each process of the run that lives, its name and the ids of all that runs below it."""

    def __init__(self, trees):
        self._trees = trees
        self._known = {}
        self._looked = {}

    def of(self, api):
        """The name of the process whose node has this address; None where it cannot be told."""
        if api not in self._known and self._may_look(api):
            self.look(api)
        return self._known.get(api)

    def look(self, api):
        """The same, found out anew: ports are used again."""
        port = port_of(api)
        owner = self._holder(_sockets(port, None, LISTENING)) if port else None
        if owner is not None:
            self._known[api] = owner
        return owner

    def caller(self, port, own_port):
        """The name of the process that is connected from `port` to `own_port`; None where it cannot be told."""
        return self._holder(_sockets(port, own_port, CONNECTED))

    def _may_look(self, api):
        """An address that nobody listens on costs a few looks, not one at every change of the graph."""
        now_s = time.monotonic()
        looks, last_s = self._looked.get(api, (0, 0.0))
        if looks >= LOOKS_MAX or now_s - last_s < AGAIN_S or len(self._looked) > ASKED_MAX:
            return False
        self._looked[api] = looks + 1, now_s
        return True

    def _holder(self, sockets):
        inodes = {"socket:[{}]".format(inode) for inode in sockets}
        if not inodes:
            return None
        return next((name for name, pids in self._trees() if any(_holds(pid, inodes) for pid in pids)), None)


def _sockets(local, remote, state):
    """The inodes of sockets of this network namespace that have these ports and this state (man 5 proc)."""
    ending = ":{:04X}".format(local)
    for table in TABLES:
        with contextlib.suppress(OSError), open(table) as file:
            for row in (line.split(None, 10) for line in file if ending in line):
                if row[1].endswith(ending) and row[3] == state and remote in (None, _port(row[2])):
                    yield row[9]


def _port(address):
    return int(address.rpartition(":")[2], 16)


def _holds(pid, inodes):
    folder = "/proc/{}/fd".format(pid)
    try:
        numbers = os.listdir(folder)
    except OSError:
        return False  # it has ended, or is not ours to look into
    return any(_target("{}/{}".format(folder, number)) in inodes for number in numbers)


def _target(link):
    try:
        return os.readlink(link)
    except OSError:
        return ""  # closed meanwhile
