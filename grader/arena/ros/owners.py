"""Which process a node belongs to: the one that listens on the port of the node's slave API.

So nodes that `roslaunch` starts are known too, and two copies that fight for one name.
"""

import os
from urllib.parse import urlparse

TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
LISTENING = "0A"


class Owners:
    """`trees` gives, for each process of the run, its name and the ids of all that runs below it."""

    def __init__(self, trees):
        self._trees = trees
        self._known = {}

    def of(self, api):
        """The name of the process whose node has this slave API; None where it cannot be told."""
        if api not in self._known:
            owner = self._find(api)
            if owner is None:
                return None
            self._known[api] = owner
        return self._known[api]

    def _find(self, api):
        try:
            port = urlparse(api).port
        except ValueError:
            return None
        inodes = {"socket:[{}]".format(inode) for inode in _listening(port)} if port else set()
        if not inodes:
            return None
        return next((name for name, pids in self._trees() if any(_holds(pid, inodes) for pid in pids)), None)


def _listening(port):
    """The inodes of the sockets that listen on a port of this network namespace (man 5 proc)."""
    for table in TABLES:
        try:
            with open(table) as file:
                rows = [line.split() for line in file][1:]
        except OSError:
            continue
        for row in rows:
            if row[3] == LISTENING and int(row[1].rpartition(":")[2], 16) == port:
                yield row[9]


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
