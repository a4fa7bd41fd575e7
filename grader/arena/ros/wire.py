"""What the arena tells the grader, as frames on one pipe: `Wire` writes them, `FrameReader` takes them apart (in the
grader's own Python).

A frame is `<B I Q`: kind, length of the payload, time in ns; then the payload. Kinds:
    C  a channel opens: JSON {id, topic, callerid, type, md5sum, definition, latching, student}
    M  messages that came together: `<I` channel id, then each as sent, behind its length (`<I`)
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
MESSAGES = struct.Struct("<BIQI")
CHANNEL_ID = LENGTH = struct.Struct("<I")
F_SETPIPE_SZ = 1031
PIPE_BYTES = 1 << 20
WRITE_BYTES = 256 << 10
# Publishers that send much wait from the first on, so that the rest is left to all others.
CONGESTED_BYTES, QUEUE_BYTES_MAX = 40 << 20, 48 << 20
GATHER_S = 0.1
"""Messages wait so long for others to be written with them: each time that something comes, the grader looks at the
whole run again. Their times are those of their arrival."""
# More than a message (16 MB) or a kept file in base64 has: a longer length is a sign of damage.
FRAME_BYTES_MAX = 24 << 20
PATIENT = ("/grader/console", "/grader/host")

_offset_ns = time.time_ns() - time.monotonic_ns()


def set_clock():
    """Start counting the arena's time."""
    # The template may have been imported hours ago, and the wall clock set since.
    global _offset_ns  # noqa: PLW0603 - a process has one clock
    _offset_ns = time.time_ns() - time.monotonic_ns()


def now_ns():
    """Return the wall clock at the arena's start plus monotonic time: never set back while a run lasts."""
    return _offset_ns + time.monotonic_ns()


class Wire:
    """Frames onto a file descriptor, whole and in order, from any thread.

    They are written beside the callers: a grader that reads slowly does not make what arrives late. Past
    `QUEUE_BYTES_MAX` callers wait all the same.
    """

    def __init__(self, fd):
        self._fd = fd
        self._lock = threading.Lock()
        self._came = threading.Condition(self._lock)
        self._went = threading.Condition(self._lock)
        self._queue = collections.deque()
        self._bytes = 0
        self._urgent = self._idle = False
        self._channels = 0
        with contextlib.suppress(OSError):  # smaller pipes only mean more writes
            fcntl.fcntl(fd, F_SETPIPE_SZ, PIPE_BYTES)
        self._writes = False  # a process that is to enter namespaces has no other thread yet

    @property
    def congested(self):
        """Whether the grader is so far behind that publishers that send much should wait."""
        return self._bytes > CONGESTED_BYTES

    def flush(self):
        """Wait until all is written."""
        with self._lock:
            self._urgent = True
            self._came.notify()
            self._went.wait_for(lambda: not self._bytes)

    def event(self, topic, record, time_ns=None):
        self._json(b"E", {"topic": topic, "record": record}, time_ns, urgent=topic not in PATIENT)

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

    def messages(self, channel_id, pieces, time_ns):
        """Send messages of one channel that came together, as TCPROS has them: each behind its length."""
        size = CHANNEL_ID.size + sum(map(len, pieces))
        self._put([MESSAGES.pack(ord("M"), size, time_ns, channel_id), *pieces], urgent=False)

    def _json(self, kind, value, time_ns=None, *, urgent=True):
        payload = json.dumps(value).encode("utf-8", "surrogatepass")
        self._put([HEADER.pack(ord(kind), len(payload), time_ns or now_ns()), payload], urgent=urgent)

    def _put(self, parts, *, urgent):
        size = sum(map(len, parts))
        if size < WRITE_BYTES:
            parts = [b"".join(parts)]
        with self._lock:
            if not self._writes:
                self._writes = True
                threading.Thread(target=self._write, daemon=True).start()
            while self._bytes >= QUEUE_BYTES_MAX:
                self._went.wait()
            self._queue += parts
            self._bytes += size
            self._urgent = self._urgent or urgent or self._bytes >= WRITE_BYTES
            # While the writer gathers, only what is urgent wakes it before its time.
            if self._idle or self._urgent:
                self._came.notify()

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
                gone = True  # no one reads any more: the end of stdin says so, too
            with self._lock:
                self._bytes -= size
                self._went.notify_all()

    def _take(self):
        """Return some of what waits: small parts together, a large one alone."""
        with self._lock:
            self._await_work()
            parts = [self._queue.popleft()]
            size = len(parts[0])
            while self._queue and size + len(self._queue[0]) < WRITE_BYTES:
                parts.append(self._queue.popleft())
                size += len(parts[-1])
            self._urgent = self._urgent and bool(self._queue)
        return parts

    def _await_work(self):
        self._idle = True
        while not self._queue:
            self._came.wait()
        self._idle = False
        if not self._urgent:
            self._came.wait(GATHER_S)


class NoFrame(ValueError):
    """Bytes that no arena sends."""


Frame = collections.namedtuple("Frame", "kind time_ns channel datas fields")
"""`kind` is one of C, M, E, S; `channel` and `datas` (messages) belong to M, `fields` to the others."""


class FrameReader:
    """Bytes in, whole frames out. Raises NoFrame."""

    def __init__(self):
        self._pieces = []
        self._size = 0
        self._needed = HEADER.size

    def feed(self, chunk):
        """Yield the frames that end in this piece."""
        self._pieces.append(chunk)
        self._size += len(chunk)
        if self._size < self._needed:
            return
        data, start = b"".join(self._pieces), 0
        self._needed = HEADER.size
        while len(data) - start >= HEADER.size:
            kind, length, time_ns = HEADER.unpack_from(data, start)
            if length > FRAME_BYTES_MAX:
                raise NoFrame("a frame of {} bytes".format(length))
            end = start + HEADER.size + length
            if end > len(data):
                self._needed = end - start
                break
            yield _frame(chr(kind), time_ns, data, start + HEADER.size, end)
            start = end
        self._pieces = [data[start:]]
        self._size = len(data) - start


def _frame(kind, time_ns, data, start, end):
    try:
        if kind == "M":
            (channel,) = CHANNEL_ID.unpack_from(data[start : min(end, start + CHANNEL_ID.size)])
            return Frame(kind, time_ns, channel, _messages(data, start + CHANNEL_ID.size, end), {})
        return Frame(kind, time_ns, 0, [], _fields(data[start:end]))
    except (struct.error, ValueError, TypeError, RecursionError) as error:
        raise NoFrame("{}: {}".format(type(error).__name__, error)) from error


def _messages(data, start, end):
    found, unpack_from = [], LENGTH.unpack_from
    while start < end:
        (length,) = unpack_from(data, start)
        start += LENGTH.size
        found.append(data[start : start + length])
        start += length
    if start != end:
        raise NoFrame("a message that is not whole")
    return found


def _fields(payload):
    """Return the fields of a frame. Halves of surrogate pairs, which no record can hold, become question marks."""
    fields = json.loads(payload)
    # Nearly every frame has neither, and is parsed only once.
    if b"\\ud" in payload or b"\xed" in payload:
        fields = json.loads(json.dumps(fields, ensure_ascii=False).encode(errors="replace"))
    return dict(fields)
