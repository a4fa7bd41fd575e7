"""The inodes of TCP sockets of this network namespace, by their ports: `sock_diag` (man 7), else /proc/net/tcp.

The kernel finds a socket at once; /proc lists it after a walk over a table that may have half a million rows.
"""

import contextlib
import errno
import itertools
import socket
import struct

NETLINK_SOCK_DIAG = 4
SOCK_DIAG_BY_FAMILY = 20
REQUEST, DUMP = 0x1, 0x300
ERROR, DONE = 2, 3
LISTEN, ALL_STATES = 10, 0xFFFFFFFF
TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
_HEADER = struct.Struct("=IHHII")
_ID = struct.Struct("!HH16s16s4x8s")
_ANSWER_INODE = struct.Struct("=4x48x16xI")
_NO_COOKIE = b"\xff" * 8
_ANSWER_BYTES = 1 << 16
SOCKETS_MAX, ROWS_MAX = 1000, 1000000
"""So many of one port are looked at, and so many rows of a table."""


def listening(port):
    """Of those that listen on a port."""
    try:
        return [
            inode
            for family in (socket.AF_INET, socket.AF_INET6)
            for state, inode in _asked(family, 1 << LISTEN, (b"", port), (b"", 0), dump=True)
            if state == LISTEN
        ]
    except OSError:
        return [inode for state, inode in _listed(port, None) if state == LISTEN]


def connected(near, far):
    """Of the end `near` of a connection from `near` to `far`, both (IPv4 address, port)."""
    try:
        ends = [(socket.inet_aton(address), port) for address, port in (near, far)]
        found = _asked(socket.AF_INET, ALL_STATES, *ends)
    except OSError:
        found = _listed(near[1], far[1])
    return [inode for state, inode in found if state != LISTEN]


def _asked(family, states, near, far, *, dump=False):
    """(state, inode) of what the kernel answers; raise OSError where it does not answer such questions."""
    (source, port), (destination, far_port) = near, far
    identity = _ID.pack(port, far_port, source.ljust(16, b"\0"), destination.ljust(16, b"\0"), _NO_COOKIE)
    question = struct.pack("=BBBBI", family, socket.IPPROTO_TCP, 0, 0, states) + identity
    flags = REQUEST | (DUMP if dump else 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, NETLINK_SOCK_DIAG) as sock:
        sock.settimeout(1.0)
        sock.send(_HEADER.pack(_HEADER.size + len(question), SOCK_DIAG_BY_FAMILY, flags, 1, 0) + question)
        found, more = [], True
        while more and len(found) < SOCKETS_MAX:
            more = _take(sock.recv(_ANSWER_BYTES), found) and dump
    return found[:SOCKETS_MAX]


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
        found.append((data[body + 1], inode))
        start += (length + 3) & ~3
    return True


def _listed(port, far_port):
    """The same from /proc (man 5 proc)."""
    ending = ":{:04X}".format(port)
    for table in TABLES:
        with contextlib.suppress(OSError), open(table) as file:
            lines = itertools.islice(file, ROWS_MAX)
            for row in (line.split(None, 10) for line in lines if ending in line):
                if row[1].endswith(ending) and far_port in (None, _port(row[2])):
                    yield int(row[3], 16), int(row[9])


def _port(address):
    return int(address.rpartition(":")[2], 16)
