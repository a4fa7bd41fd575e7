"""Calls services as `rosservice` does (wiki.ros.org/ROS/TCPROS), with bytes that the grader has serialised."""

import socket
import time

from bounded import ProtocolError, connect, port_of
from tcpros import HEADER_BYTES_MAX, LENGTH, check_fields, read_exactly, read_header, write_header

ANSWER_BYTES_MAX = 4 << 20
WORDS_CHARS_MAX = 500
ANY = "*"


def probe_service(service, uri, caller_id, timeout_s):
    """The type that the service says it has; raise ProtocolError where it says none."""
    with _connected(service, uri, caller_id, timeout_s, probe="1") as sock:
        header = _header(sock)
    if "type" not in header:
        raise ProtocolError("header without type")
    return header["type"]


def call_service(service, uri, caller_id, *, type_, request, timeout_s):
    """The bytes of the response; raise ProtocolError, with the service's own words, for anything else.

    A service of another type would wait for bytes that never come, so it is asked first.
    """
    until_s = time.monotonic() + timeout_s
    found = probe_service(service, uri, caller_id, timeout_s)
    if found != type_:
        raise ProtocolError("the service is of type {}".format(found))
    with _connected(service, uri, caller_id, until_s - time.monotonic()) as sock:
        try:
            _header(sock)
            sock.sendall(LENGTH.pack(len(request)) + request)
            (ok,) = read_exactly(sock, 1)
            (length,) = LENGTH.unpack(read_exactly(sock, LENGTH.size))
            if length > ANSWER_BYTES_MAX:
                raise ProtocolError("an answer of {} bytes".format(length))
            data = read_exactly(sock, length)
        except socket.timeout as error:
            raise ProtocolError("no answer within {:g} s".format(timeout_s)) from error
        except OSError as error:
            raise ProtocolError(str(error)) from error
    if not ok:
        raise ProtocolError(data.decode("utf-8", "replace")[:WORDS_CHARS_MAX] or "the service failed")
    return data


def _connected(service, uri, caller_id, timeout_s, **more):
    try:
        sock = connect(port_of(uri), max(0.05, timeout_s), HEADER_BYTES_MAX + ANSWER_BYTES_MAX)
    except OSError as error:
        raise ProtocolError(str(error)) from error
    try:
        write_header(sock, dict(service=service, md5sum=ANY, callerid=caller_id, **more))
    except (OSError, ValueError) as error:
        sock.close()
        raise ProtocolError(str(error)) from error
    return sock


def _header(sock):
    try:
        header = read_header(sock)
    except OSError as error:
        raise ProtocolError(str(error)) from error
    if "error" in header:
        raise ProtocolError(header["error"][:WORDS_CHARS_MAX])
    check_fields(header)
    return header
