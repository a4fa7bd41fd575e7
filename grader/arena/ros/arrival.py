"""When bytes came in, as the kernel noted it (socket(7), SO_TIMESTAMPNS): a reader that wakes late changes no times."""

import socket
import struct
import time

from wire import now_ns

SO_TIMESTAMPNS = 35
TIMESPEC = struct.Struct("@ll")
SPACE = socket.CMSG_SPACE(TIMESPEC.size)
AGE_NS_MAX = 5 * 10**9
"""Older ones come from a clock that was set meanwhile."""


def note_arrivals(sock):
    """From now on the kernel notes for this socket when its bytes arrive; some kernels do not."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    except OSError:
        return False
    return True


def receive(sock, size):
    """(bytes, when the last of them arrived, on the arena's clock). Raises what `recv` raises."""
    data, notes, _, _ = sock.recvmsg(size, SPACE)
    return data, now_ns() - _age_ns(notes)


def receive_into(sock, view):
    """(how many bytes, when the last of them arrived)."""
    count, notes, _, _ = sock.recvmsg_into([view], SPACE)
    return count, now_ns() - _age_ns(notes)


def _age_ns(notes):
    for level, kind, value in notes:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS and len(value) >= TIMESPEC.size:
            seconds, nanoseconds = TIMESPEC.unpack_from(value)
            age_ns = time.time_ns() - seconds * 10**9 - nanoseconds
            return age_ns if 0 <= age_ns < AGE_NS_MAX else 0
    return 0
