"""What publisher and subscriber ends of a TCPROS connection share (wiki.ros.org/ROS/TCPROS)."""

import io
import struct

from bounded import ProtocolError
from rosgraph.network import decode_ros_handshake_header, encode_ros_handshake_header

LENGTH = struct.Struct("<I")
HEADER_BYTES_MAX = 1 << 18
FIELD_CHARS_MAX = 256
DEFINITION_CHARS_MAX = 1 << 16


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
            raise ProtocolError("the header's field {} is no name".format(name))
    if len(header.get("message_definition", "")) > DEFINITION_CHARS_MAX:
        raise ProtocolError("a definition of more than {} characters".format(DEFINITION_CHARS_MAX))


def read_exactly(sock, count):
    buffer = io.BytesIO()
    while buffer.tell() < count:
        chunk = sock.recv(min(count - buffer.tell(), 1 << 16))
        if not chunk:
            raise Closed("connection closed in the header")
        buffer.write(chunk)
    return buffer.getvalue()


def write_header(sock, fields):
    sock.sendall(encode_ros_handshake_header(fields))
