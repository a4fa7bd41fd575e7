"""The grader's own services: they answer with bytes that the grader has serialised, one after the other.

They answer as rospy's own do (wiki.ros.org/ROS/TCPROS): a probe (`wait_for_service`) gets the header alone, and a
client of another type an error.
"""

import base64
import collections
import contextlib
import threading

from guard import shown
from tcpros import ANY, Closed, read_exactly, write_header
from wire import LENGTH

REQUEST_BYTES_MAX = 1 << 20
REQUEST_S = 5.0
CONNECTIONS_MAX = 64
"""Of one process at a time."""
REQUESTS_MAX, RECORDED_BYTES_MAX = 1000, 8 << 20
"""Of a run: what comes after them is answered and not recorded."""
OTHER_TYPES_MAX = 100


class Service:
    """`answers` take turns, the last one stays; `error` is said in their place.

    `told`: the grader hears of each call.
    """

    def __init__(self, fields):
        self.name = fields["service"]
        self.header = {"service": self.name, "type": fields["type"], "md5sum": fields["md5sum"]}
        self._answers = [base64.b64decode(answer) for answer in fields["answers"]]
        self._error = fields["error"]
        self.delay_s = fields["delay_s"]
        self.told = fields.get("told", True)
        self._given = 0
        self._lock = threading.Lock()

    def next_answer(self):
        """Return (its number, its bytes as TCPROS has them)."""
        with self._lock:
            number = min(self._given, len(self._answers) - 1)
            self._given += 1
        data = self._error.encode() if self._error else self._answers[number]
        return number, bytes([not self._error]) + LENGTH.pack(len(data)) + data


class Services:
    """All services of one node; each call of theirs is a status for the grader, who can read its bytes."""

    def __init__(self, wire, caller_id, guard):
        self._wire = wire
        self._caller_id = caller_id
        self._guard = guard
        self._services = {}
        self._open = collections.Counter()
        self._other_types = set()
        self._requests = self._recorded_bytes = 0
        self._lock = threading.Lock()

    def add(self, fields):
        self._services[fields["service"]] = Service(fields)

    def serve(self, sock, header, who):
        """Serve one connection to its end, in its own thread. Raises OSError or Closed once the client has gone."""
        with self._count_connection(who) as number:
            service = self._services.get(header.get("service"))
            problem = self._problem(service, header)
            if number > CONNECTIONS_MAX:
                problem = "too many connections"
                detail = "has more than {} connections to the grader's services".format(CONNECTIONS_MAX)
                self._guard.limit(who, detail)
            write_header(
                sock, {"error": problem} if problem else dict(service.header, callerid=self._caller_id)
            )
            if not problem and header.get("probe") != "1":
                self._converse(sock, service, header, who)
            sock.close()

    @contextlib.contextmanager
    def _count_connection(self, who):
        """Count a connection as one of that process's for as long as the block runs, and give their number."""
        with self._lock:
            self._open[who] += 1
            number = self._open[who]
        try:
            yield number
        finally:
            with self._lock:
                self._open[who] -= 1

    def _problem(self, service, header):
        caller, md5sum = str(header.get("callerid", "")), header.get("md5sum")
        if service is None:
            return "[{}] is not a provider of [{}]".format(self._caller_id, shown(header.get("service")))
        if md5sum in (ANY, service.header["md5sum"]):
            return ""
        with self._lock:
            key = service.name, caller, md5sum
            if service.told and key not in self._other_types and len(self._other_types) < OTHER_TYPES_MAX:
                self._other_types.add(key)
                self._wire.status("other-type", service=service.name, caller=caller, md5sum=str(md5sum))
        words = "request from [{}]: md5sums do not match: [{}] vs. [{}]"
        return words.format(caller, shown(md5sum), service.header["md5sum"])

    def _converse(self, sock, service, header, who):
        persistent = str(header.get("persistent", "")).lower() in ("1", "true")
        again = True
        while again:
            sock.allow(None, 0)
            # A persistent client may wait between its calls for as long as it likes.
            sock.settimeout(None)
            (length,) = LENGTH.unpack(read_exactly(sock, LENGTH.size))
            if length > REQUEST_BYTES_MAX:
                self._guard.limit(who, "called {} with {} bytes".format(service.name, length))
                raise Closed("a request of {} bytes".format(length))
            sock.allow(REQUEST_S, length)
            request = read_exactly(sock, length)
            number, answer = service.next_answer()
            if service.told:
                self._tell(service, str(header.get("callerid", "")), request, number, who)
            # In the connection's own thread, so no other client waits for this one.
            threading.Event().wait(service.delay_s)
            sock.allow(REQUEST_S, 0)
            sock.sendall(answer)
            again = persistent

    def _tell(self, service, caller, request, number, who):
        with self._lock:
            self._requests += 1
            self._recorded_bytes += len(request)
            kept = self._requests <= REQUESTS_MAX and self._recorded_bytes <= RECORDED_BYTES_MAX
        if not kept:
            detail = "called the grader's services more often than is recorded ({} times)".format(
                REQUESTS_MAX
            )
            self._guard.limit(who, detail)
            return
        data = base64.b64encode(request).decode()
        self._wire.status("request", service=service.name, caller=caller, data=data, answer=number)
