"""When bytes came in, as the kernel noted it (socket(7), SO_TIMESTAMPNS): a reader that wakes late changes no times."""

import socket
import struct
import time

from wire import now_ns

SO_TIMESTAMPNS = 35
TIMESPEC = struct.Struct("@ll")
SPACE = socket.CMSG_SPACE(TIMESPEC.size)
APART_NS_MAX = 100_000
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
    return data, _arrived_ns(notes)


def receive_into(sock, view):
    """(how many bytes, when the last of them arrived)."""
    count, notes, _, _ = sock.recvmsg_into([view], SPACE)
    return count, _arrived_ns(notes)


def _arrived_ns(notes):
    """The kernel's time is the wall clock's: how long ago that was tells it on the arena's clock."""
    for level, kind, value in notes:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS and len(value) >= TIMESPEC.size:
            seconds, nanoseconds = TIMESPEC.unpack_from(value)
            before_ns, wall_ns, after_ns = now_ns(), time.time_ns(), now_ns()
            if after_ns - before_ns > APART_NS_MAX:  # somebody else had the processor between the two clocks
                before_ns, wall_ns = now_ns(), time.time_ns()
            age_ns = wall_ns - seconds * 10**9 - nanoseconds
            return before_ns - age_ns if 0 <= age_ns < AGE_NS_MAX else before_ns
    return now_ns()
