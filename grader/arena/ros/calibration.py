"""Measures how well this machine keeps time, which says whether a rate may be judged.

`Lateness` is how late a thread wakes that asked for 20 ms. `Calibration` is a publisher whose loop is known: what is
wrong with what the recorder sees of it is the machine's doing. It is a process of its own, as a student's node is, and
sleeps for a tenth of a second in each turn, as a student's loop may. Each message says when it was sent: what a sleep
took too long shows in two that follow each other. They come to the recorder's loop over TCP, in the form of TCPROS, and
are recorded with the times of their arrival.
"""

import contextlib
import os
import signal
import socket
import struct
import threading
import time

from bounded_sockets import note_arrivals, receive
from namespaces import LIBC
from process_tree import TICKS_HZ
from wire import LENGTH, now_ns

TOPIC = "/grader/calibration"
PERIOD_S = 0.1
TYPE, MD5SUM = "std_msgs/Header", "2176decaecbce78abc3b96ef049fabed"
DEFINITION = "uint32 seq\ntime stamp\nstring frame_id\n"
HEADER = struct.Struct("<IIII")
FRAME_BYTES = LENGTH.size + HEADER.size
PR_SET_PDEATHSIG = 1
SLEEP_S = 0.02
REPORT_S = 0.5


class Calibration:
    """Make it before the first thread: its process is a copy of this one, which it outlives by nothing."""

    def __init__(self):
        self._sock, theirs = _connection()
        parent = os.getpid()
        self._pid = os.fork()
        if self._pid == 0:
            _live(theirs, parent)
        theirs.close()
        self._sock.setblocking(False)
        note_arrivals(self._sock)
        self._rest = b""

    def record(self, loop, wire, caller_id):
        """Make its messages evidence from now on."""
        self._loop, self._wire = loop, wire
        self._channel = wire.channel(
            topic=TOPIC, callerid=caller_id, type=TYPE, md5sum=MD5SUM, definition=DEFINITION, latching=False
        )
        loop.add_reader(self._sock, self._readable)
        self._sock.send(b"\n")

    def _readable(self):
        data, time_ns = receive(self._sock, FRAME_BYTES)
        if not data:
            self._loop.remove_reader(self._sock)
            return
        chunk = self._rest + data
        whole = len(chunk) - len(chunk) % FRAME_BYTES
        self._rest = chunk[whole:]
        if whole:
            self._wire.messages(self._channel, [chunk[:whole]], time_ns)

    def stop(self):
        """End its process; return the CPU seconds that it used."""
        with contextlib.suppress(ProcessLookupError):  # it has ended already
            os.kill(self._pid, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):  # others have waited for it
            _, _, usage = os.wait4(self._pid, 0)
            return usage.ru_utime + usage.ru_stime
        return 0.0


def _live(sock, parent):
    """Run the publisher from its start to its end, in a session of its own, with nothing of the arena's open."""
    try:
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        os.setsid()
        if sock.fileno() > 0:
            os.dup2(sock.fileno(), 0)
        # Above all the arena's stdout: its reader waits for the end of it.
        os.closerange(1, 1 << 16)
        # The parent may have ended before `prctl` took hold. The byte comes when the recorder is ready.
        if os.getppid() == parent and os.read(0, 1):
            _publish(0)
    finally:
        os._exit(0)


def _publish(descriptor):
    number = 0
    with contextlib.suppress(OSError):  # no one listens any more
        while True:
            stamp_ns = now_ns()
            header = HEADER.pack(number, stamp_ns // 10**9, stamp_ns % 10**9, 0)
            os.write(descriptor, LENGTH.pack(len(header)) + header)
            number += 1
            time.sleep(PERIOD_S)


def _connection():
    """Return both ends of a connection over the loopback; no one else's is taken for the other end."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        theirs = socket.create_connection(server.getsockname())
        theirs.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while True:
            mine, address = server.accept()
            # Without a network of its own, another user's process could connect to the port first.
            if address == theirs.getsockname():
                return mine, theirs
            mine.close()


def peak_bytes():
    """Return the peak of this process alone: what `getrusage` says holds its parent's, too (man 5 proc)."""
    with open("/proc/self/status") as file:
        found = [line.split()[1] for line in file if line.startswith("VmHWM:")]
    return int(found[0]) * 1024 if found else 0


def processor_ticks():
    """Return (busy, all) of all processors since the machine started (man 5 proc_stat)."""
    with open("/proc/stat") as file:
        user, nice, system, idle, iowait, *rest = [int(word) for word in file.readline().split()[1:9]]
    busy = user + nice + system + sum(rest)
    return busy, busy + idle + iowait


class Lateness:
    """`used_s` gives the CPU seconds that the student's processes have used so far, ended ones included."""

    def __init__(self, wire, used_s):
        self._wire = wire
        self._used_s = used_s
        self._own_s = 0.0
        self._stopping = False
        self._ticks = processor_ticks()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        self._thread.start()

    def stop(self):
        self._stopping = True
        self._thread.join()

    def _run(self):
        late_ms = []
        report_at = time.monotonic() + REPORT_S
        after = time.monotonic()
        while not self._stopping:
            before = after
            time.sleep(SLEEP_S)
            after = time.monotonic()
            late_ms.append(max(0.0, (after - before - SLEEP_S) * 1e3))
            if self._stopping or after >= report_at:
                self._report(late_ms)
                late_ms = []
                # to look at many processes takes time, and is not the machine's lateness
                after = time.monotonic()
                report_at = after + REPORT_S

    def _report(self, late_ms):
        late_ms.sort()
        (busy_before, all_before), self._ticks = self._ticks, processor_ticks()
        busy, ticks = self._ticks
        before_s, self._own_s = self._own_s, self._used_s()
        all_ticks = max(1, ticks - all_before)
        share = (busy - busy_before) / all_ticks
        own = (self._own_s - before_s) * TICKS_HZ / all_ticks
        record = {
            "samples": len(late_ms),
            "mean_ms": round(sum(late_ms) / len(late_ms), 3),
            "p95_ms": round(late_ms[int(0.95 * (len(late_ms) - 1))], 3),
            "max_ms": round(late_ms[-1], 3),
            "load_1min": round(os.getloadavg()[0], 2),
            "busy": round(share, 3),
            "own_busy": round(min(max(0.0, own), share), 3),
        }
        self._wire.event("/grader/host", record)
