"""Which nodes are connected as the kernel has it: whose processes hold the two ends of a connection.

A node's processes are those that have the socket open on which its slave API listens. A connection to that port is a
call, no topic's.
"""

import collections

import sockets
from bounded import port_of

UDP = "UDPROS"


class Ties:
    """The kernel's table at one moment."""

    def __init__(self, owners):
        self._owners = owners
        self._joined = {}
        self._listening = collections.defaultdict(set)
        self._half_closed = set()
        rows = sockets.streams() or ()
        pids = owners.pids({row.inode for row in rows})
        self._streams = _Ends(pids, [row for row in rows if row.state == sockets.ESTABLISHED])
        self._datagrams = None
        for row in rows:
            if row.state == sockets.LISTEN:
                self._listening[row.near] |= pids[row.inode]
            elif row.state == sockets.CLOSE_WAIT:
                self._half_closed |= pids[row.inode]

    def joined(self, publisher, subscriber, transport):
        """Whether two processes, one of each node (an address), hold the ends of a connection; None where the kernel
        does not say whose sockets they are."""
        key = publisher, subscriber, transport == UDP
        if key not in self._joined:
            self._joined[key] = self._join(port_of(publisher), port_of(subscriber), udp=transport == UDP)
        return self._joined[key]

    def half_closed(self, node):
        """Whether the node (an address) has a connection whose other end is gone and may not have noticed; True where
        that is not known."""
        pids = self._listening.get(port_of(node))
        return not pids or not pids.isdisjoint(self._half_closed)

    def _join(self, publisher, subscriber, *, udp):
        ours, theirs = self._listening.get(publisher), self._listening.get(subscriber)
        if not ours or not theirs:
            return None
        if not udp:
            return self._streams.meet(ours, theirs, {publisher, subscriber})
        if self._datagrams is None:
            rows = sockets.datagrams() or ()
            self._datagrams = _Ends(self._owners.pids({row.inode for row in rows}), rows)
        return self._datagrams.meet(ours, theirs, set(), receiver_is_connected=False)


class _Ends:
    """Sockets by their ports and by the processes that hold them, `pids` by inode."""

    def __init__(self, pids, rows):
        self._holders = collections.defaultdict(set)
        self._held = collections.defaultdict(set)
        for row in rows:
            self._holders[row.near, row.far] |= pids[row.inode]
            for pid in pids[row.inode]:
                self._held[pid].add((row.near, row.far))

    def meet(self, ours, theirs, calls, *, receiver_is_connected=True):
        """Whether a process of `ours` and another one of `theirs` hold two ends that belong together, on no port of
        `calls`. The receiver of datagrams knows no sender."""
        for pid in ours:
            for near, far in self._held.get(pid, ()):
                other = (far, near if receiver_is_connected else 0)
                holders = self._holders.get(other, set()) & theirs
                if holders - {pid} and calls.isdisjoint((near, far)):
                    return True
        return False
