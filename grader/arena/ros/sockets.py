"""The sockets of this network namespace, and which process of the run has each of them open.

The kernel is asked by `sock_diag` (man 7), which finds a socket at once; else /proc/net is read, a walk over a table
that may have half a million rows. A node belongs to the process that listens on the port of its slave API, so nodes
that `roslaunch` starts are known too, and two copies that compete for one name. A caller is the process that is
connected from the port that the call comes from.
"""

import collections
import contextlib
import errno
import itertools
import os
import socket
import struct
import threading
import time

from bounded_sockets import port_of
from process_tree import descriptors

# As linux/netlink.h, linux/sock_diag.h, linux/unix_diag.h and linux/inet_diag.h number them.
NETLINK_SOCK_DIAG = 4
SOCK_DIAG_BY_FAMILY = 20
UNIX_SHOW, UNIX_UNREAD, UNIX_MEMORY = 0x10 | 0x20, 4, 5
UNIX_SENT_BYTES_MAX = 425984
"""What one socket may send ahead, with its own wish for more (net.core.wmem_max, twice)."""
INET_SHOW_MEMORY, INET_MEMORY = 1 << 6, 7
UNIX_ANSWER_BYTES, INET_ANSWER_BYTES = 16, 72
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
PAGES_NOT_ADDED = 256
"""Each processor may keep so many back from the machine's sum (net.core.mem_pcpu_rsv)."""
REQUEST, DUMP = 0x1, 0x300
ERROR, DONE = 2, 3
# States as net/tcp_states.h numbers them, in sock_diag and in /proc/net/tcp alike.
ESTABLISHED, CLOSE_WAIT, LISTEN, ALL_STATES = 1, 8, 10, 0xFFFFFFFF
TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
DATAGRAM_TABLES = ("/proc/net/udp", "/proc/net/udp6")
ROWS_MAX = 20000
"""Of one answer: no run of nodes that are told apart by hand has a hundredth of it."""
_HEADER = struct.Struct("=IHHII")
_UNIX = struct.Struct("=BBHIIIQ")
_ATTRIBUTE = struct.Struct("=HH")
_MEMORY = struct.Struct("=6I")
_ID = struct.Struct("!HH16s16s4x8s")
_ANSWER_PORTS, _ANSWER_INODE = struct.Struct("!4xHH"), struct.Struct("=4x48x16xI")
_NO_COOKIE = b"\xff" * 8
_ANSWER_BYTES = 1 << 16
SOCKETS_MAX, TABLE_ROWS_MAX = 1000, 1000000
"""So many of one port are looked at, and so many rows of a table."""

LOOKS_MAX = 3
AGAIN_S = 0.2
ASKED_MAX = 5000
FILES_MAX = 50000
"""Open files of one process, with all that runs below it, that a look looks at."""
REST = 2
"""So many times as long as the last look took, there is no other."""

Row = collections.namedtuple("Row", "state near far inode")
"""A socket; `near` and `far` are ports."""


def listening(port):
    """Return the inodes of the sockets that listen on a port."""
    try:
        rows = _dump_sockets(1 << LISTEN, port)
    except OSError:
        rows = _list_sockets(TABLES, port)
    return [row.inode for row in rows if row.state == LISTEN]


def connected(near, far):
    """Return the inodes of the end `near` of a connection from `near` to `far`, both (IPv4 address, port)."""
    try:
        ends = [(socket.inet_aton(address), port) for address, port in (near, far)]
        found = _ask_kernel(socket.AF_INET, ALL_STATES, *ends)
    except OSError:
        found = _list_sockets(TABLES, near[1], far[1])
    return [row.inode for row in found if row.state != LISTEN]


def streams():
    """Return all TCP sockets that listen, are connected, or whose other end has closed; None where there are too
    many."""
    states = (LISTEN, ESTABLISHED, CLOSE_WAIT)
    try:
        rows = _dump_sockets(sum(1 << state for state in states), 0, ROWS_MAX + 1)
    except OSError:
        rows = list(itertools.islice(_list_sockets(TABLES), ROWS_MAX + 1))
    return [row for row in rows if row.state in states] if len(rows) <= ROWS_MAX else None


def datagrams():
    """Return all UDP sockets; None where there are too many."""
    rows = list(itertools.islice(_list_sockets(DATAGRAM_TABLES), ROWS_MAX + 1))
    return rows if len(rows) <= ROWS_MAX else None


def _dump_sockets(states, port, most=SOCKETS_MAX):
    """Return the TCP sockets of IPv4 and IPv6 in these states, on one port, or on all for 0. Raises OSError."""
    families = (socket.AF_INET, socket.AF_INET6)
    ends = (b"", port), (b"", 0)
    return [row for family in families for row in _ask_kernel(family, states, *ends, dump=True, most=most)]


def buffer_bytes(limit_bytes):
    """Return what the buffers of all sockets of this network namespace hold: no process's memory counts it.

    Up to the limit, they may hold less than this: the kernel is asked about each TCP and UDP socket only where those of
    the whole machine hold enough to matter.
    """
    unix = _UNIX.pack(socket.AF_UNIX, 0, 0, ALL_STATES, 0, UNIX_SHOW, 0)
    held = _memory_bytes(unix, UNIX_ANSWER_BYTES, UNIX_MEMORY)
    most = held + _internet_bytes_at_most()
    if most <= limit_bytes:
        return most
    for family in (socket.AF_INET, socket.AF_INET6):
        for protocol in (socket.IPPROTO_TCP, socket.IPPROTO_UDP):
            head = struct.pack("=BBBBI", family, protocol, INET_SHOW_MEMORY, 0, ALL_STATES)
            question = head + _ID.pack(0, 0, bytes(16), bytes(16), _NO_COOKIE)
            held += _memory_bytes(question, INET_ANSWER_BYTES, INET_MEMORY)
    return held


def _internet_bytes_at_most():
    """Return what all TCP and UDP sockets of the machine hold, with what the kernel may not have added up yet."""
    pages = PAGES_NOT_ADDED * (os.cpu_count() or 1)
    try:
        with open("/proc/net/sockstat") as file:
            rows = [line.split() for line in file if line.startswith(("TCP:", "UDP:"))]
        return (pages + sum(int(row[row.index("mem") + 1]) for row in rows)) * PAGE_BYTES
    except (OSError, ValueError, IndexError):
        # Then the kernel is asked about each socket, which is slow and right.
        return 1 << 62


def _memory_bytes(question, answer_bytes, wanted):
    """Return the bytes in the buffers of the sockets that the kernel lists; 0 where it does not answer such
    questions."""
    held = 0
    with contextlib.suppress(OSError):
        for body in _answers(question, dump=True):
            at = answer_bytes
            while at + _ATTRIBUTE.size <= len(body):
                length, kind = _ATTRIBUTE.unpack_from(body, at)
                if kind == UNIX_UNREAD and wanted == UNIX_MEMORY and any(body[at + 4 : at + 8]):
                    held += UNIX_SENT_BYTES_MAX  # charged to the sender, which may be gone
                elif kind == wanted and length >= _ATTRIBUTE.size + _MEMORY.size:
                    received, _, sent, _, _, queued = _MEMORY.unpack_from(body, at + _ATTRIBUTE.size)
                    held += received + max(sent, queued)  # TCP counts as sent what is on its way alone
                at += max(_ATTRIBUTE.size, (length + 3) & ~3)
    return held


def _ask_kernel(family, states, near, far, *, dump=False, most=SOCKETS_MAX):
    """Return the TCP sockets that the kernel lists. Raises OSError where it does not answer such questions."""
    (source, port), (destination, far_port) = near, far
    identity = _ID.pack(port, far_port, source.ljust(16, b"\0"), destination.ljust(16, b"\0"), _NO_COOKIE)
    question = struct.pack("=BBBBI", family, socket.IPPROTO_TCP, 0, 0, states) + identity
    return [
        Row(body[1], *_ANSWER_PORTS.unpack_from(body), *_ANSWER_INODE.unpack_from(body))
        for body in itertools.islice(_answers(question, dump=dump), most)
    ]


def _answers(question, *, dump):
    """Yield the body of each answer to a question about one socket, or with `dump` about all. Raises OSError."""
    flags = REQUEST | (DUMP if dump else 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, NETLINK_SOCK_DIAG) as sock:
        sock.settimeout(1.0)
        sock.send(_HEADER.pack(_HEADER.size + len(question), SOCK_DIAG_BY_FAMILY, flags, 1, 0) + question)
        more = True
        while more:
            data, start = sock.recv(_ANSWER_BYTES), 0
            while start + _HEADER.size <= len(data):
                length, kind, *_ = _HEADER.unpack_from(data, start)
                body = data[start + _HEADER.size : start + length]
                if kind == ERROR:
                    (code,) = struct.unpack_from("=i", body)
                    # No such socket is an answer, too: none.
                    if code != -errno.ENOENT:
                        raise OSError(-code, "sock_diag")
                if kind in (DONE, ERROR):
                    return
                yield body
                # Netlink aligns each message to four bytes.
                start += (length + 3) & ~3
            # A question about one socket has one answer; a dump ends with DONE.
            more = dump


def _list_sockets(tables, port=None, far_port=None):
    """Yield the sockets of these tables in /proc (man 5 proc), on one port or on all."""
    ending = ":" if port is None else ":{:04X}".format(port)
    for table in tables:
        with contextlib.suppress(OSError), open(table) as file:
            # `ending in line` is much cheaper than to split a line, and leaves out nearly all.
            lines = itertools.islice(file, TABLE_ROWS_MAX)
            for row in (line.split(None, 10) for line in lines if ending in line):
                if row[0] != "sl" and port in (None, _port(row[1])) and far_port in (None, _port(row[2])):
                    yield Row(int(row[3], 16), _port(row[1]), _port(row[2]), int(row[9]))


def _port(address):
    return int(address.rpartition(":")[2], 16)


class Owners:
    """`trees` gives, for each process of the run that lives, its name and the ids of all that runs below it: nothing of
    the run is anywhere else, if they are `whole`, as in a sandbox. `tell` is told, as `guard.limit` is, which process
    has more than is looked at."""

    def __init__(self, trees, *, whole=False):
        self._trees = trees
        self.whole = whole
        self.tell = None
        self._known = {}
        self._asked = {}
        self._looking = threading.Lock()
        self._looked_s = self._look_took_s = 0.0
        self._holders = {}
        self._pids = {}

    def of(self, api):
        """Return the name of the process whose node has this address; None where it cannot be told."""
        if api not in self._known and self._may_look(api):
            self.look(api)
        return self._known.get(api)

    def known(self, api):
        """Return the same, without a look."""
        return self._known.get(api)

    def look(self, api):
        """Return the owner, looked up each time: ports are used again."""
        port = port_of(api)
        # None does not overwrite: a node that is ending still belongs to its process.
        owner = self._holder(listening(port)) if port else None
        if owner is not None:
            self._known[api] = owner
        return owner

    def caller(self, near, far):
        """Return the name of the process whose connection goes from `near` to `far`, both (address, port), or None."""
        return self._holder(connected(near, far))

    def callers(self, connections):
        """Return the same of many connections, each (near, far)."""
        inodes = [next(iter(connected(*ends)), None) for ends in connections]
        with self._looking:
            self._look_at_all()
            return [self._holders.get("socket:[{}]".format(inode)) for inode in inodes]

    def pids(self, inodes):
        """Return for each of these sockets the ids of the processes that have it open: one look at all of them."""
        with self._looking:
            self._look_at_all()
            return {inode: self._pids.get("socket:[{}]".format(inode), frozenset()) for inode in inodes}

    def _may_look(self, api):
        """Return whether to look: an address without a listener costs a few looks, not one at every change of the
        graph."""
        now_s = time.monotonic()
        looks, last_s = self._asked.get(api, (0, 0.0))
        if looks >= LOOKS_MAX or now_s - last_s < AGAIN_S or len(self._asked) > ASKED_MAX:
            return False
        self._asked[api] = looks + 1, now_s
        return True

    def _holder(self, inodes):
        """Return the process that has one of these sockets open, or None. Threads that ask at the same time share one
        look at all processes."""
        wanted = ["socket:[{}]".format(inode) for inode in inodes]
        if not wanted:
            return None
        asked_s = time.monotonic()
        with self._looking:
            if self._looked_s < asked_s:
                self._look_at_all()
            return next((self._holders[link] for link in wanted if link in self._holders), None)

    def _look_at_all(self):
        """Look at the open files of all processes, after a pause that grows with the time that the last look took:
        thousands of open files must not make the arena slow."""
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
        files = ((pid, "/proc/{}/fd/{}".format(pid, number)) for pid in pids for number in descriptors(pid))
        for pid, file in itertools.islice(files, FILES_MAX):
            link = _target(file)
            if link.startswith("socket:"):
                yield pid, link
        if self.tell and next(files, None) is not None:
            self.tell(name, "had more than {} files open: not all of them are looked at".format(FILES_MAX))


def _target(link):
    try:
        return os.readlink(link)
    except OSError:
        return ""  # it was closed
