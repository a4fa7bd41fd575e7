"""The XML-RPC servers of the arena: what speaks to them is held to a size, a form, a pace and a number."""

import collections
import contextlib
import http.server
import socket
import socketserver
import sys
import threading
import xmlrpc.client

import xmlrpc_parser
from bounded_sockets import UNKNOWN_PROCESS, BoundedSocket, Caller, Pace
from guard import shown
from quotas import weight
from rosgraph.network import get_address_override, get_bind_address

BODY_BYTES_MAX = 8 << 20
ANSWER_BYTES_MAX = 24 << 20
LARGE_BYTES = 32 << 10
HEAD_BYTES_MAX = 64 << 10
CONNECTIONS_MAX = 256
TURN_OF_THREADS_S = 0.001
"""Python's own 5 ms would be too long for what is recorded beside threads that work on large calls."""
REQUEST_S, IDLE_S, TURN_S = 8.0, 120.0, 8.0
READ_AHEAD_BYTES = 8 << 10
CALLS_HZ, CALLS_AT_ONCE, PAUSE_S = 1000.0, 2000, 3.0
CLOSED_AT_ONCE = 64
MULTICALL, MULTICALLS_MAX = "system.multicall", 5000
REFUSED_CODE, NOT_KNOWN_CODE, TOO_LATE_CODE, TOO_LARGE_CODE = 400, 404, 408, 413
BUSY_CODE = 503


class Busy(Exception):
    """Others have large calls, too."""


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
        self._open = set()
        self._waiting = collections.OrderedDict()
        self._lock = threading.Lock()

    def get_request(self):
        sock, address = self.socket.accept()
        return BoundedSocket(fileno=sock.detach()), address

    def process_request(self, request, client_address):
        """One thread a connection; where there are too many, those of the process that has most make way."""
        if self._admit(request) or (self._make_room() and self._admit(request)):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def _admit(self, request):
        with self._lock:
            if len(self._open) >= CONNECTIONS_MAX:
                return False
            self._open.add(request)
            return True

    def _make_room(self):
        """Close the oldest of the process that has most connections, as far as they are not being answered."""
        with self._lock:
            waiting = list(self._waiting)
        ends = [_ends(request) for request in waiting]
        whose = self.owners.callers(ends)
        ((most, _),) = collections.Counter(whose).most_common(1) or ((None, 0),)
        theirs = [number for number, who in enumerate(whose) if who == most]
        closed = [waiting[number] for number in theirs[:CLOSED_AT_ONCE]]
        detail = "opened more than {} connections to {}".format(CONNECTIONS_MAX, self.title)
        self.guard.limit(most or UNKNOWN_PROCESS, detail)
        for request in closed:
            self._forget(request)
            with contextlib.suppress(OSError):  # it was closed
                request.shutdown(socket.SHUT_RDWR)
        return bool(closed)

    def _forget(self, request):
        with self._lock:
            self._open.discard(request)
            self._waiting.pop(request, None)

    def process_request_thread(self, request, client_address):
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._forget(request)

    def waits(self, request, waiting):
        """A connection waits for its next call, or has one that is being answered."""
        with self._lock:
            if waiting:
                self._waiting[request] = True
            else:
                self._waiting.pop(request, None)

    def slow_down(self, caller, calls=1):
        """Let no process call so often that others do not come through."""
        pause_s = self._paces[caller.process].wait_s(calls)
        if pause_s > PAUSE_S:
            raise Refused(TOO_LARGE_CODE, "{} calls at once".format(calls))
        if pause_s > 0:
            self.guard.limit(
                caller.name, "called {} more than {:g} times a second".format(self.title, CALLS_HZ)
            )
            threading.Event().wait(pause_s)

    def handle_error(self, request, client_address):
        """A connection that breaks is nothing to be told; what is wrong here goes where it can be read."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class _Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    # Head and body of an answer go out in one packet.
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
        # The long limit is for a connection that is kept open between calls; from its first byte on, a call is short.
        if self.rfile.peek(1):
            sock.allow(REQUEST_S, HEAD_BYTES_MAX)
            super().handle_one_request()

    def do_POST(self):
        try:
            self.server.slow_down(self.caller)
            self._answer()
        except Refused as refused:
            self._refuse(*refused.args)
        except Busy:
            self.close_connection = True
            self._send(BUSY_CODE, b"")
        except socket.timeout:
            self._refuse(TOO_LATE_CODE, "a call that did not end")

    def _refuse(self, code, what):
        # A process that ended in the middle of a call has done nothing that is worth a remark.
        if self.caller.process is not None or not self._gone():
            self.server.guard.refused(self.caller.name, "sent {} {}".format(self.server.title, what))
        self.close_connection = True
        self._send(code, b"")

    def _gone(self):
        """Return whether the other side has ended, perhaps in the middle of a call."""
        try:
            return not self.connection.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except BlockingIOError:
            return False
        except OSError:
            return True

    def send_error(self, code, message=None, explain=None):  # noqa: ARG002 - http.server calls it so
        self._refuse(code, "something that is not a call")

    def _answer(self):
        size = self._size()
        with self._turn(size > LARGE_BYTES) as turn:
            self.connection.allow(REQUEST_S, size + READ_AHEAD_BYTES)
            body = self.rfile.read(size)
            if len(body) < size:
                self.close_connection = True
                return
            self.server.waits(self.connection, False)
            result = self._result(body)
            # Before the next large call has its turn: up to 8 MB.
            del body
            with self._turn(not turn and weight(result, LARGE_BYTES) > LARGE_BYTES):
                self._reply(result)

    def _size(self):
        """Return how long the body says it is."""
        if self.path not in ("/", "/RPC2"):
            raise Refused(NOT_KNOWN_CODE, "a request for {}".format(shown(self.path)))
        if self.headers.get("Content-Encoding", "identity").lower() != "identity":
            raise Refused(
                REFUSED_CODE, "an encoded call ({})".format(shown(self.headers["Content-Encoding"]))
            )
        text = self.headers.get("Content-Length", "")
        # `int` takes other alphabets' digits, and its time grows with the square of their number.
        if not (text.isascii() and text.isdigit() and len(text) < 20):
            raise Refused(REFUSED_CODE, "a call without its length")
        if int(text) > BODY_BYTES_MAX:
            raise Refused(TOO_LARGE_CODE, "a call of more than {} MB".format(BODY_BYTES_MAX >> 20))
        return int(text)

    @contextlib.contextmanager
    def _turn(self, large):
        """Wait for this call's turn if it is large, since one large call is worked on at a time. Raises Busy."""
        if not large:
            yield False
            return
        if not self.server.large.acquire(timeout=TURN_S):
            raise Busy
        try:
            yield True
        finally:
            self.server.large.release()

    def _result(self, body):
        """Return the value of a call, or a Fault."""
        try:
            args, method = xmlrpc_parser.read(body)
        except (xmlrpc_parser.Malformed, xmlrpc.client.Fault) as error:
            raise Refused(REFUSED_CODE, "something that is not a call: {}".format(shown(error))) from error
        if method != MULTICALL:
            return self._call(method, args)
        calls = args[0] if len(args) == 1 and isinstance(args[0], list) else []
        if len(calls) > MULTICALLS_MAX:
            raise Refused(TOO_LARGE_CODE, "more than {} calls at once".format(MULTICALLS_MAX))
        self.server.slow_down(self.caller, len(calls))
        return [self._one_of_many(one) for one in calls]

    def _one_of_many(self, one):
        one = one if isinstance(one, dict) else {}
        args = one.get("params")
        result = self._call(one.get("methodName"), args if isinstance(args, list) else [])
        if isinstance(result, xmlrpc.client.Fault):
            return {"faultCode": result.faultCode, "faultString": result.faultString}
        return [result]

    def _call(self, method, args):
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

    def log_request(self, *_):
        """It is not read."""

    log_message = log_request


def _ends(request):
    """Return both ends of a connection, each (address, port); as good as none where it is closed."""
    try:
        return request.getpeername(), request.getsockname()
    except OSError:
        return ("0.0.0.0", 0), ("0.0.0.0", 0)  # noqa: S104 - no one's address


def serve(port, answer, guard, owners, title):
    """Serve in a thread of its own; return the server, whose `uri` is what nodes are told."""
    sys.setswitchinterval(TURN_OF_THREADS_S)
    server = Server(port, answer, guard, owners, title)
    # It is never told to stop, so it need not wake to look.
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 60.0}, daemon=True).start()
    return server
