"""TCPROS (wiki.ros.org/ROS/TCPROS): connection headers, which both ends send, and calls of services.

A service is called as `rosservice` does it, with bytes that the grader has serialised."""

import io
import socket
import time

from bounded_sockets import ProtocolError, connect, port_of
from rosgraph.network import decode_ros_handshake_header, encode_ros_handshake_header
from wire import LENGTH

HEADER_BYTES_MAX = 1 << 18
FIELD_CHARS_MAX = 256
DEFINITION_CHARS_MAX = 1 << 16
ANSWER_BYTES_MAX = 4 << 20
WORDS_CHARS_MAX = 500
ANY = "*"


class Closed(ProtocolError):
    """The other side has gone."""


def read_header(sock):
    """Read one connection header from a blocking socket, and not a byte more: (fields, as str to str)."""
    (length,) = LENGTH.unpack(read_exactly(sock, LENGTH.size))
    if length > HEADER_BYTES_MAX:
        raise ProtocolError("connection header of {} bytes".format(length))
    body = read_exactly(sock, length)
    try:
        return decode_ros_handshake_header(LENGTH.pack(length) + body)
    except Exception as error:
        raise ProtocolError("no connection header: {}".format(str(error)[:200])) from error


def check_fields(header):
    """Raise ProtocolError for fields that no message has: control characters, or far too long."""
    for name in ("type", "md5sum", "callerid", "topic", "latching"):
        value = header.get(name, "")
        if len(value) > FIELD_CHARS_MAX or not value.isprintable():
            raise ProtocolError("the header's field {} is not a name".format(name))
    if len(header.get("message_definition", "")) > DEFINITION_CHARS_MAX:
        raise ProtocolError("a definition of more than {} characters".format(DEFINITION_CHARS_MAX))


def read_exactly(sock, count):
    buffer = io.BytesIO()
    while buffer.tell() < count:
        # Not the whole at once: a length that is only claimed must not take its memory.
        chunk = sock.recv(min(count - buffer.tell(), 1 << 16))
        if not chunk:
            raise Closed("connection closed in the header")
        buffer.write(chunk)
    return buffer.getvalue()


def write_header(sock, fields):
    sock.sendall(encode_ros_handshake_header(fields))


def probe_service(service, uri, caller_id, timeout_s):
    """Return the type that the service says it has; raise ProtocolError where it says none."""
    with _connect(service, uri, caller_id, timeout_s, probe="1") as sock:
        header = _header(sock)
    if "type" not in header:
        raise ProtocolError("header without type")
    return header["type"]


def call_service(service, uri, caller_id, *, type_, request, timeout_s):
    """Return the bytes of the response; raise ProtocolError, with the service's own words, for anything else.

    A service of another type would wait for bytes that never come, so it is asked first.
    """
    until_s = time.monotonic() + timeout_s
    found = probe_service(service, uri, caller_id, timeout_s)
    if found != type_:
        raise ProtocolError("the service is of type {}".format(found))
    with _connect(service, uri, caller_id, until_s - time.monotonic()) as sock:
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


def _connect(service, uri, caller_id, timeout_s, **more):
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
