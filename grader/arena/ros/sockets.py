"""The inodes of TCP sockets of this network namespace, by their ports: `sock_diag` (man 7), else /proc/net/tcp.

The kernel finds a socket at once; /proc lists it after a walk over a table that may have half a million rows.
"""

import collections
import contextlib
import errno
import itertools
import socket
import struct

NETLINK_SOCK_DIAG = 4
SOCK_DIAG_BY_FAMILY = 20
REQUEST, DUMP = 0x1, 0x300
ERROR, DONE = 2, 3
ESTABLISHED, CLOSE_WAIT, LISTEN, ALL_STATES = 1, 8, 10, 0xFFFFFFFF
TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
DATAGRAM_TABLES = ("/proc/net/udp", "/proc/net/udp6")
ROWS_MAX = 20000
"""Of one answer: no run of nodes that are told apart by hand has a hundredth of it."""
_HEADER = struct.Struct("=IHHII")
_ID = struct.Struct("!HH16s16s4x8s")
_ANSWER_PORTS, _ANSWER_INODE = struct.Struct("!4xHH"), struct.Struct("=4x48x16xI")
_NO_COOKIE = b"\xff" * 8
_ANSWER_BYTES = 1 << 16

Row = collections.namedtuple("Row", "state near far inode")
"""A socket; `near` and `far` are ports."""


def listening(port):
    """Of those that listen on a port."""
    try:
        rows = _dumped(1 << LISTEN, port)
    except OSError:
        rows = _listed(TABLES, port)
    return [row.inode for row in rows if row.state == LISTEN]


def connected(near, far):
    """Of the end `near` of a connection from `near` to `far`, both (IPv4 address, port)."""
    try:
        ends = [(socket.inet_aton(address), port) for address, port in (near, far)]
        found = _asked(socket.AF_INET, ALL_STATES, *ends)
    except OSError:
        found = _listed(TABLES, near[1], far[1])
    return [row.inode for row in found if row.state != LISTEN]


def streams():
    """All TCP sockets that listen, are connected, or whose other end has closed; None where there are too many."""
    states = (LISTEN, ESTABLISHED, CLOSE_WAIT)
    try:
        rows = _dumped(sum(1 << state for state in states), 0)
    except OSError:
        rows = list(itertools.islice(_listed(TABLES), ROWS_MAX + 1))
    return [row for row in rows if row.state in states] if len(rows) <= ROWS_MAX else None


def datagrams():
    """All UDP sockets; None where there are too many."""
    rows = list(itertools.islice(_listed(DATAGRAM_TABLES), ROWS_MAX + 1))
    return rows if len(rows) <= ROWS_MAX else None


def _dumped(states, port):
    """Of both families, on a port, or on all where it is 0; raise OSError as below."""
    families = (socket.AF_INET, socket.AF_INET6)
    return [row for family in families for row in _asked(family, states, (b"", port), (b"", 0), dump=True)]


def _asked(family, states, near, far, *, dump=False):
    """The rows of what the kernel answers; raise OSError where it does not answer such questions."""
    (source, port), (destination, far_port) = near, far
    identity = _ID.pack(port, far_port, source.ljust(16, b"\0"), destination.ljust(16, b"\0"), _NO_COOKIE)
    question = struct.pack("=BBBBI", family, socket.IPPROTO_TCP, 0, 0, states) + identity
    flags = REQUEST | (DUMP if dump else 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, NETLINK_SOCK_DIAG) as sock:
        sock.settimeout(1.0)
        sock.send(_HEADER.pack(_HEADER.size + len(question), SOCK_DIAG_BY_FAMILY, flags, 1, 0) + question)
        found, more = [], True
        while more and len(found) <= ROWS_MAX:
            more = _take(sock.recv(_ANSWER_BYTES), found) and dump
    return found


def _take(data, found):
    """Read one answer's parts; False after the last."""
    start = 0
    while start + _HEADER.size <= len(data):
        length, kind, *_ = _HEADER.unpack_from(data, start)
        body = start + _HEADER.size
        if kind == DONE:
            return False
        if kind == ERROR:
            (code,) = struct.unpack_from("=i", data, body)
            if code != -errno.ENOENT:
                raise OSError(-code, "sock_diag")
            return False
        (inode,) = _ANSWER_INODE.unpack_from(data, body)
        found.append(Row(data[body + 1], *_ANSWER_PORTS.unpack_from(data, body), inode))
        start += (length + 3) & ~3
    return True


def _listed(tables, port=None, far_port=None):
    """The same from /proc (man 5 proc); without a port, all."""
    ending = ":" if port is None else ":{:04X}".format(port)
    for table in tables:
        with contextlib.suppress(OSError), open(table) as file:
            for row in (line.split(None, 10) for line in file if ending in line):
                if row[0] != "sl" and port in (None, _port(row[1])) and far_port in (None, _port(row[2])):
                    yield Row(int(row[3], 16), _port(row[1]), _port(row[2]), int(row[9]))


def _port(address):
    return int(address.rpartition(":")[2], 16)
