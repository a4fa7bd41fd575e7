"""Sockets to and from students' programs: bounded in time and in bytes, with who is at the other end and how often they
may call, and with the times at which the kernel saw bytes arrive (socket(7), SO_TIMESTAMPNS)."""

import http.client
import socket
import struct
import threading
import time
import xmlrpc.client
from urllib.parse import urlparse

import xmlrpc_parser
from wire import now_ns

LOOPBACK = "127.0.0.1"
ANSWER_BYTES_MAX = 1 << 20
UNKNOWN_PROCESS = "an unknown process"
SO_TIMESTAMPNS = 35
TIMESPEC = struct.Struct("@ll")
SPACE = socket.CMSG_SPACE(TIMESPEC.size)
# Two clocks that are read one after the other are a microsecond apart.
APART_NS_MAX = 100_000
AGE_NS_MAX = 5 * 10**9
"""Older ones come from a clock that has been set since."""


class ProtocolError(Exception):
    """The other side does not keep to TCPROS or to the slave API."""


class BoundedSocket(socket.socket):
    """All reading and writing since `allow` takes at most so many seconds and bytes together: a byte now and then
    does not buy more time."""

    _until_s = None
    _bytes_left = 0

    def allow(self, seconds, size):
        """`seconds` of None lift both bounds."""
        self._until_s = None if seconds is None else time.monotonic() + seconds
        self._bytes_left = size

    def recv(self, size, *flags):
        self._before()
        data = super().recv(size, *flags)
        self._after(len(data))
        return data

    def recv_into(self, *args):
        self._before()
        count = super().recv_into(*args)
        self._after(count)
        return count

    def sendall(self, data, *flags):
        self._before()
        super().sendall(data, *flags)

    def _before(self):
        if self._until_s is not None:
            left_s = self._until_s - time.monotonic()
            # A timeout of 0 would make the socket non-blocking.
            if left_s <= 0:
                raise socket.timeout("timed out")
            self.settimeout(left_s)

    def _after(self, count):
        if self._until_s is not None:
            self._bytes_left -= count
            if self._bytes_left < 0:
                raise ConnectionAbortedError("more bytes than allowed")


def connect(port, seconds, size):
    """Return a bounded connection to a port of this machine; raise OSError."""
    sock = BoundedSocket(socket.AF_INET, socket.SOCK_STREAM)
    sock.allow(seconds, size)
    sock.settimeout(seconds)
    try:
        sock.connect((LOOPBACK, port))
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except (OSError, OverflowError, TypeError) as error:
        sock.close()
        raise OSError(str(error)) from error
    return sock


def port_of(uri):
    """Return the port of `http://…:port/` or `rosrpc://…:port`; None where there is none.

    Nodes are on this machine, by whatever name they call it.
    """
    try:
        return urlparse(uri).port or None
    except (ValueError, AttributeError, TypeError):
        return None


class _Connection(http.client.HTTPConnection):
    def __init__(self, port, seconds):
        super().__init__(LOOPBACK, port)
        self._seconds = seconds

    def connect(self):
        self.sock = connect(self.port, self._seconds, 2 * ANSWER_BYTES_MAX)


class _Transport(xmlrpc.client.Transport):
    accept_gzip_encoding = False

    def __init__(self, port, seconds):
        super().__init__()
        self._port, self._seconds = port, seconds

    def make_connection(self, host):
        self._connection = host, _Connection(self._port, self._seconds)
        return self._connection[1]

    def parse_response(self, response):
        try:
            if response.getheader("Content-Encoding", "identity") != "identity":
                # A few compressed bytes could become any number of them.
                raise xmlrpc_parser.Malformed("an encoded answer")
            data = response.read(ANSWER_BYTES_MAX + 1)
            if len(data) > ANSWER_BYTES_MAX:
                raise xmlrpc_parser.Malformed("an answer of more than {} bytes".format(ANSWER_BYTES_MAX))
            return xmlrpc_parser.read(data)[0]
        finally:
            self.close()


def slave_api(uri, seconds):
    """Return a proxy of a node's slave API, each of whose calls takes at most so many seconds; raise ValueError."""
    port = port_of(uri)
    if port is None:
        raise ValueError("not the address of a node: {}".format(str(uri)[:100]))
    return xmlrpc.client.ServerProxy(
        "http://{}:{}/".format(LOOPBACK, port), transport=_Transport(port, seconds)
    )


def call(method, *args):
    """Call a method of the slave API and return its value; raise ProtocolError for anything but success."""
    try:
        code, message, value = method(*args)
    except Exception as error:
        raise ProtocolError("{}: {}".format(type(error).__name__, str(error)[:200])) from error
    if code != 1:
        raise ProtocolError(str(message)[:200])
    return value


class Pace:
    """At most so many a second, in the long run."""

    def __init__(self, per_s, at_once):
        self._per_s, self._at_once = per_s, at_once
        self._next_s = 0.0
        self._lock = threading.Lock()

    def wait_s(self, count):
        """Return how long these calls have to wait (s)."""
        now_s = time.monotonic()
        with self._lock:
            self._next_s = max(self._next_s, now_s - self._at_once / self._per_s) + count / self._per_s
            return self._next_s - now_s


class Caller:
    """Who is at the other end of a connection; `process` is looked up when it is first asked for."""

    def __init__(self, owners, near, far):
        self._owners = owners
        self._ends = near, far
        self._found = None
        self._looked = False

    @property
    def process(self):
        """The name of the process of the run, or None."""
        if not self._looked:
            self._looked = True
            self._found = self._owners.caller(*self._ends)
        return self._found

    @property
    def name(self):
        return self.process or UNKNOWN_PROCESS


def note_arrivals(sock):
    """Let the kernel note when this socket's bytes arrive; return whether this kernel does."""
    try:
        sock.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    except OSError:
        return False
    return True


def receive(sock, size):
    """Return (bytes, when the last of them arrived, on the arena's clock). Raises what `recv` raises."""
    data, notes, _, _ = sock.recvmsg(size, SPACE)
    return data, _arrived_ns(notes)


def receive_into(sock, view):
    """Return (how many bytes, when the last of them arrived)."""
    count, notes, _, _ = sock.recvmsg_into([view], SPACE)
    return count, _arrived_ns(notes)


def _arrived_ns(notes):
    """Return when the bytes arrived, on the arena's clock. The kernel's note is by the wall clock, so what is taken
    from it is how long ago that was."""
    for level, kind, value in notes:
        if level == socket.SOL_SOCKET and kind == SO_TIMESTAMPNS and len(value) >= TIMESPEC.size:
            seconds, nanoseconds = TIMESPEC.unpack_from(value)
            before_ns, wall_ns, after_ns = now_ns(), time.time_ns(), now_ns()
            if after_ns - before_ns > APART_NS_MAX:  # someone else had the processor between the two clocks
                before_ns, wall_ns = now_ns(), time.time_ns()
            age_ns = wall_ns - seconds * 10**9 - nanoseconds
            return before_ns - age_ns if 0 <= age_ns < AGE_NS_MAX else before_ns
    return now_ns()
