"""The process of which every arena is a copy: it has imported all that an arena needs, and does nothing else.

Reads requests from a socket of packets on stdin. `s` with three descriptors (an arena's stdin, stdout, stderr) starts
an arena; the answer is its process id and the CPU seconds that this process took since the last answer. `e` with a
process id waits for an arena that has ended, or was killed; the answer has the same id. Until then nobody else gets
that id. When the socket closes, so does this process: arenas live on as long as their own stdin.
"""

import array
import contextlib
import gc
import importlib
import os
import resource
import signal
import socket
import struct

ANSWER = struct.Struct("<id")
DESCRIPTORS = 3
REQUEST_BYTES = 64
OPEN_MAX = 4096
PYTHONS = (signal.SIGPIPE, signal.SIGXFSZ)
"""Ignored by Python itself, and not in what it starts."""


def serve(sock, live):
    """Start arenas, each of which is `live()` in a session of its own, until nobody asks any more."""
    gc.freeze()  # what is here is shared with every copy for as long as nobody touches it
    told_s = 0.0
    while True:
        request, descriptors = _receive(sock)
        if not request:
            return
        if request[:1] == b"s":
            pid = _start(sock, descriptors, live)
        else:
            (pid,) = struct.unpack_from("<i", request, 1)
            with contextlib.suppress(ChildProcessError):  # none of ours
                os.waitpid(pid, 0)
        used = resource.getrusage(resource.RUSAGE_SELF)
        used_s = used.ru_utime + used.ru_stime
        sock.send(ANSWER.pack(pid, used_s - told_s))
        told_s = used_s


def _start(sock, descriptors, live):
    pid = os.fork()
    if pid:
        for number in descriptors:
            os.close(number)
        return pid
    try:
        os.setsid()
        sock.detach()
        for target, number in enumerate(descriptors):
            os.dup2(number, target)
        os.closerange(DESCRIPTORS, OPEN_MAX)
        live()
    except BaseException as error:  # noqa: BLE001 - the copy must not go on as the template; the grader reads this
        os.write(2, "{}: {}\n".format(type(error).__name__, error).encode("utf-8", "replace"))
    finally:
        os._exit(1)


def _receive(sock):
    numbers = array.array("i")
    data, notes, _, _ = sock.recvmsg(REQUEST_BYTES, socket.CMSG_SPACE(DESCRIPTORS * numbers.itemsize))
    for level, kind, value in notes:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            numbers.frombytes(value[: len(value) - len(value) % numbers.itemsize])
    return data, list(numbers)


def usual_signals():
    """Signals that are ignored or blocked here would be so in all that is started from here, students' nodes too: how
    the grader was started must not change what they do."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    for number in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP, *PYTHONS}:
        signal.signal(number, signal.SIG_DFL)


def stand_by(live, modules):
    """The template's whole life. `modules` are loaded now; what cannot be loaded is missed by who needs it."""
    usual_signals()
    for name in modules:
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    with contextlib.suppress(ConnectionError), socket.socket(fileno=0) as sock:
        serve(sock, live)
    os._exit(0)
