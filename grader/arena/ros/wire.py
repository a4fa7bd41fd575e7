"""What the arena tells the grader, as frames on one pipe.

A frame is `<B I Q`: kind, length of the payload, time in ns; then the payload. Kinds:
    C  a channel opens: JSON {id, topic, callerid, type, md5sum, definition, latching, student}
    M  a message: `<I` channel id, then the bytes as sent
    E  an event for the evidence: JSON {topic, record}
    S  a status for the grader alone: JSON {status, …}
"""

import collections
import contextlib
import fcntl
import json
import os
import struct
import threading
import time

HEADER = struct.Struct("<BIQ")
CHANNEL_ID = struct.Struct("<I")
F_SETPIPE_SZ = 1031
PIPE_BYTES = 1 << 20
WRITE_BYTES = 256 << 10
CONGESTED_BYTES, QUEUE_BYTES_MAX = 4 << 20, 32 << 20

_OFFSET_NS = time.time_ns() - time.monotonic_ns()


def now_ns():
    """The wall clock at the arena's start plus monotonic time: never set back while a run lasts."""
    return _OFFSET_NS + time.monotonic_ns()


class Wire:
    """Frames onto a file descriptor, whole and in order, from any thread.

    They are written beside the callers: a grader that reads slowly does not make what arrives late. Past
    `QUEUE_BYTES_MAX` callers wait all the same.
    """

    def __init__(self, fd):
        self._fd = fd
        self._changed = threading.Condition()
        self._queue = collections.deque()
        self._bytes = 0
        self._channels = 0
        with contextlib.suppress(OSError):  # smaller pipes only mean more writes
            fcntl.fcntl(fd, F_SETPIPE_SZ, PIPE_BYTES)
        self._writes = False  # a process that is to enter namespaces has no other thread yet

    @property
    def congested(self):
        """Whether the grader is so far behind that who sends much should wait."""
        return self._bytes > CONGESTED_BYTES

    def flush(self):
        """Wait until all is written."""
        with self._changed:
            self._changed.wait_for(lambda: not self._bytes)

    def event(self, topic, record, time_ns=None):
        self._json(b"E", {"topic": topic, "record": record}, time_ns)

    def status(self, status, **fields):
        fields["status"] = status
        self._json(b"S", fields)

    def channel(self, **fields):
        """Open a channel and return its id."""
        with self._changed:
            self._channels += 1
            fields["id"] = self._channels
        self._json(b"C", fields)
        return fields["id"]

    def messages(self, channel_id, datas, time_ns):
        """Several messages of one channel."""
        head = CHANNEL_ID.pack(channel_id)
        parts = []
        for data in datas:
            parts += [HEADER.pack(ord("M"), len(data) + len(head), time_ns), head, data]
        self._put(parts)

    def _json(self, kind, value, time_ns=None):
        payload = json.dumps(value).encode("utf-8", "surrogatepass")
        self._put([HEADER.pack(ord(kind), len(payload), time_ns or now_ns()), payload])

    def _put(self, parts):
        size = sum(map(len, parts))
        if size < WRITE_BYTES:
            parts = [b"".join(parts)]
        with self._changed:
            if not self._writes:
                self._writes = True
                threading.Thread(target=self._write, daemon=True).start()
            self._changed.wait_for(lambda: self._bytes < QUEUE_BYTES_MAX)
            self._queue += parts
            self._bytes += size
            self._changed.notify_all()

    def _write(self):
        gone = False
        while True:
            parts = self._take()
            data = memoryview(b"".join(parts) if len(parts) > 1 else parts[0])
            size = len(data)
            try:
                while data and not gone:
                    data = data[os.write(self._fd, data) :]
            except BrokenPipeError:
                gone = True  # nobody reads any more: the end of stdin says so, too
            with self._changed:
                self._bytes -= size
                self._changed.notify_all()

    def _take(self):
        """Some of what waits: small parts together, a large one alone."""
        with self._changed:
            self._changed.wait_for(lambda: self._queue)
            parts = [self._queue.popleft()]
            size = len(parts[0])
            while self._queue and size + len(self._queue[0]) < WRITE_BYTES:
                parts.append(self._queue.popleft())
                size += len(parts[-1])
        return parts
