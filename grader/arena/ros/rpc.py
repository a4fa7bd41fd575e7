"""The XML-RPC servers of the arena: what speaks to them is held to a size, a form, a pace and a number."""

import collections
import contextlib
import http.server
import socket
import socketserver
import sys
import threading
import time
import xmlrpc.client

import strict
from bounded import BoundedSocket
from guard import shown
from rosgraph.network import get_address_override, get_bind_address
from values import weight

BODY_BYTES_MAX = 8 << 20
ANSWER_BYTES_MAX = 24 << 20
LARGE_BYTES = 32 << 10
HEAD_BYTES_MAX = 64 << 10
CONNECTIONS_MAX = 256
TURN_OF_THREADS_S = 0.001
"""What is read and recorded does not wait long for threads that work on calls."""
REQUEST_S, IDLE_S, TURN_S = 8.0, 120.0, 8.0
READ_AHEAD_BYTES = 8 << 10
CALLS_HZ, CALLS_AT_ONCE = 1000.0, 2000
LOOK_EVERY = 64
MULTICALL, MULTICALLS_MAX = "system.multicall", 10000
REFUSED_CODE, NOT_KNOWN_CODE, TOO_LATE_CODE, TOO_LARGE_CODE = 400, 404, 408, 413


class Refused(Exception):
    """`args`: HTTP's code, and what came, in words."""


class Server(socketserver.ThreadingMixIn, socketserver.TCPServer):
    """`answer(method, args, caller)` gives a call's value; `guard` is told what was refused, `title` is whose it is.

    Large calls and answers come one after the other, so that memory holds no more than one.
    """

    allow_reuse_address = True
    daemon_threads = True
    request_queue_size = 4096  # where it is full, the kernel lets everybody wait for a second

    def __init__(self, port, answer, guard, owners, title):
        super().__init__((get_bind_address(), port), _Handler)
        self.answer = answer
        self.guard = guard
        self.owners = owners
        self.title = title
        self.port = self.server_address[1]
        self.uri = "http://{}:{}/".format(get_address_override() or self.server_address[0], self.port)
        self.large = threading.Lock()
        self._paces = collections.defaultdict(lambda: Pace(CALLS_HZ, CALLS_AT_ONCE))
        self._count = self._refused = 0
        self._idle = collections.OrderedDict()
        self._lock = threading.Lock()

    def get_request(self):
        sock, address = self.socket.accept()
        return BoundedSocket(fileno=sock.detach()), address

    def process_request(self, request, client_address):
        """One thread a connection. Past the limit the one that has said nothing for longest makes way."""
        with self._lock:
            full = self._count >= CONNECTIONS_MAX
            oldest = next(iter(self._idle), None) if full else None
            self._idle.pop(oldest, None)
            if not full or oldest is not None:
                self._count += 1
        if full:
            self._note_flood(client_address, request.getsockname())
        if full and oldest is None:
            self.shutdown_request(request)
            return
        if oldest is not None:
            with contextlib.suppress(OSError):  # closed meanwhile
                oldest.shutdown(socket.SHUT_RDWR)
        super().process_request(request, client_address)

    def _note_flood(self, *ends):
        """Who it was is not asked for each of thousands."""
        self._refused += 1
        if self._refused % LOOK_EVERY == 1:
            detail = "opened more than {} connections to {}".format(CONNECTIONS_MAX, self.title)
            self.guard.limit(Caller(self.owners, *ends).name, detail)

    def process_request_thread(self, request, client_address):
        try:
            super().process_request_thread(request, client_address)
        finally:
            with self._lock:
                self._count -= 1
                self._idle.pop(request, None)

    def waits(self, request, waiting):
        """A connection waits for its next request, or got one."""
        with self._lock:
            if waiting:
                self._idle[request] = True
            else:
                self._idle.pop(request, None)

    def slow_down(self, caller):
        """Let no process call so often that nobody else comes through."""
        pause_s = self._paces[caller.process].wait_s()
        if pause_s > 0:
            self.guard.limit(
                caller.name, "called {} more than {:g} times a second".format(self.title, CALLS_HZ)
            )
            threading.Event().wait(pause_s)

    def handle_error(self, request, client_address):
        """A connection that breaks is nothing to be told; what is wrong here goes where it can be read."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class Pace:
    """At most so many a second, in the long run."""

    def __init__(self, per_s, at_once):
        self._per_s, self._at_once = per_s, at_once
        self._next_s = 0.0
        self._lock = threading.Lock()

    def wait_s(self):
        """How long this one has to wait (s)."""
        now_s = time.monotonic()
        with self._lock:
            self._next_s = max(self._next_s, now_s - self._at_once / self._per_s) + 1 / self._per_s
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
        return self.process or "an unknown process"


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    wbufsize = -1
    disable_nagle_algorithm = True

    def setup(self):
        super().setup()
        self.caller = Caller(self.server.owners, self.client_address, self.connection.getsockname())

    def handle_one_request(self):
        sock = self.connection
        self.close_connection = True
        sock.allow(IDLE_S, HEAD_BYTES_MAX)
        self.server.waits(sock, True)
        try:
            begun = self.rfile.peek(1)
        finally:
            self.server.waits(sock, False)
        if begun:
            sock.allow(REQUEST_S, HEAD_BYTES_MAX)
            super().handle_one_request()

    def do_POST(self):
        self.server.slow_down(self.caller)
        try:
            self._answer()
        except Refused as refused:
            self._refuse(*refused.args)
        except socket.timeout:
            self._refuse(TOO_LATE_CODE, "a call that did not end")

    def _refuse(self, code, what):
        self.server.guard.refused(self.caller.name, "sent {} {}".format(self.server.title, what))
        self.close_connection = True
        self._send(code, b"")

    def send_error(self, code, message=None, explain=None):  # noqa: ARG002 - http.server calls it so
        self._refuse(code, "what is no call")

    def _answer(self):
        size = self._size()
        with self._turn(size > LARGE_BYTES) as turn:
            self.connection.allow(REQUEST_S, size + READ_AHEAD_BYTES)
            body = self.rfile.read(size)
            if len(body) < size:
                self.close_connection = True
                return
            result = self._result(body)
            del body
            with self._turn(not turn and weight(result, LARGE_BYTES) > LARGE_BYTES):
                self._reply(result)

    def _size(self):
        """How long the body says it is."""
        if self.path not in ("/", "/RPC2"):
            raise Refused(NOT_KNOWN_CODE, "a request for {}".format(shown(self.path)))
        if self.headers.get("Content-Encoding", "identity").lower() != "identity":
            raise Refused(
                REFUSED_CODE, "an encoded call ({})".format(shown(self.headers["Content-Encoding"]))
            )
        text = self.headers.get("Content-Length", "")
        if not (text.isascii() and text.isdigit() and len(text) < 20):
            raise Refused(REFUSED_CODE, "a call without its length")
        if int(text) > BODY_BYTES_MAX:
            raise Refused(TOO_LARGE_CODE, "a call of more than {} MB".format(BODY_BYTES_MAX >> 20))
        return int(text)

    @contextlib.contextmanager
    def _turn(self, large):
        """Large ones take turns."""
        if not large:
            yield False
            return
        if not self.server.large.acquire(timeout=TURN_S):
            raise Refused(TOO_LARGE_CODE, "too many large calls at once")
        try:
            yield True
        finally:
            self.server.large.release()

    def _result(self, body):
        """The value of a call, or a Fault."""
        try:
            args, method = strict.read(body)
        except (strict.Malformed, xmlrpc.client.Fault) as error:
            raise Refused(REFUSED_CODE, "what is no call: {}".format(shown(error))) from error
        if method != MULTICALL:
            return self._called(method, args)
        calls = args[0] if len(args) == 1 and isinstance(args[0], list) else []
        if len(calls) > MULTICALLS_MAX:
            raise Refused(TOO_LARGE_CODE, "more than {} calls at once".format(MULTICALLS_MAX))
        return [self._one_of_many(one) for one in calls]

    def _one_of_many(self, one):
        self.server.slow_down(self.caller)
        one = one if isinstance(one, dict) else {}
        args = one.get("params")
        result = self._called(one.get("methodName"), args if isinstance(args, list) else [])
        if isinstance(result, xmlrpc.client.Fault):
            return {"faultCode": result.faultCode, "faultString": result.faultString}
        return [result]

    def _called(self, method, args):
        try:
            return self.server.answer(method, tuple(args), self.caller)
        except Exception as error:  # noqa: BLE001 - whatever it was, the caller is told, as Python's own server does
            return xmlrpc.client.Fault(1, "{}: {}".format(type(error).__name__, str(error)[:200]))

    def _reply(self, result):
        if weight(result, ANSWER_BYTES_MAX) > ANSWER_BYTES_MAX:
            result = xmlrpc.client.Fault(1, "the answer is too large")
        if not isinstance(result, xmlrpc.client.Fault):
            result = (result,)
        try:
            text = xmlrpc.client.dumps(result, methodresponse=True)
        except (TypeError, OverflowError, RecursionError) as error:
            text = xmlrpc.client.dumps(xmlrpc.client.Fault(1, str(error)[:200]), methodresponse=True)
        self._send(200, text.encode("utf-8", "xmlcharrefreplace"))

    def _send(self, code, body):
        self.connection.allow(REQUEST_S, 0)
        self.send_response(code)
        self.send_header("Content-Type", "text/xml")
        self.send_header("Content-Length", str(len(body)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(body)
        self.wfile.flush()

    def log_message(self, *_):
        """Nobody reads it."""


def serve(port, answer, guard, owners, title):
    """Serve in a thread of its own; give the server, of which `uri` is what nodes are told."""
    sys.setswitchinterval(TURN_OF_THREADS_S)
    server = Server(port, answer, guard, owners, title)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 60.0}, daemon=True).start()
    return server
