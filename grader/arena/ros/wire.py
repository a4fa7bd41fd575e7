"""What the arena tells the grader, as frames on one pipe.

A frame is `<B I Q`: kind, length of the payload, time in ns; then the payload. Kinds:
    C  a channel opens: JSON {id, topic, callerid, type, md5sum, definition, latching, student}
    M  a message: `<I` channel id, then the bytes as sent
    E  an event for the evidence: JSON {topic, record}
    S  a status for the grader alone: JSON {status, …}
"""

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
LARGE_BYTES = 256 << 10

_OFFSET_NS = time.time_ns() - time.monotonic_ns()


def now_ns():
    """The wall clock at the arena's start plus monotonic time: never set back while a run lasts."""
    return _OFFSET_NS + time.monotonic_ns()


class Wire:
    """Frames onto a file descriptor, whole, from any thread."""

    def __init__(self, fd):
        self._fd = fd
        self._lock = threading.Lock()
        self._channels = 0
        with contextlib.suppress(OSError):  # smaller pipes only mean more writes
            fcntl.fcntl(fd, F_SETPIPE_SZ, PIPE_BYTES)

    def event(self, topic, record, time_ns=None):
        self._json(b"E", {"topic": topic, "record": record}, time_ns)

    def status(self, status, **fields):
        fields["status"] = status
        self._json(b"S", fields)

    def channel(self, **fields):
        """Open a channel and return its id."""
        with self._lock:
            self._channels += 1
            fields["id"] = self._channels
        self._json(b"C", fields)
        return fields["id"]

    def messages(self, channel_id, datas, time_ns):
        """Several messages of one channel, small ones in one write."""
        head = CHANNEL_ID.pack(channel_id)
        parts, size = [], 0
        for data in datas:
            parts += [HEADER.pack(ord("M"), len(data) + len(head), time_ns), head]
            size += len(data)
            if size > LARGE_BYTES:
                self._write(b"".join(parts), data)
                parts, size = [], 0
            else:
                parts.append(data)
        if parts:
            self._write(b"".join(parts))

    def _json(self, kind, value, time_ns=None):
        payload = json.dumps(value).encode("utf-8", "surrogatepass")
        self._write(HEADER.pack(ord(kind), len(payload), time_ns or now_ns()) + payload)

    def _write(self, *pieces):
        """Where the grader does not read, this waits, and with it whoever floods it."""
        with self._lock:
            for piece in pieces:
                view = memoryview(piece)
                with contextlib.suppress(
                    BrokenPipeError
                ):  # nobody reads any more: the end of stdin says so too
                    while view:
                        view = view[os.write(self._fd, view) :]
