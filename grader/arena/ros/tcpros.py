"""What publisher and subscriber ends of a TCPROS connection share (wiki.ros.org/ROS/TCPROS)."""

import io
import socket
import struct
import xmlrpc.client
from urllib.parse import urlparse

from rosgraph.network import decode_ros_handshake_header, encode_ros_handshake_header

LOOPBACK = "127.0.0.1"
LENGTH = struct.Struct("<I")
HEADER_BYTES_MAX = 1 << 18


class ProtocolError(Exception):
    """The other side does not keep to TCPROS or to the slave API."""


class _Transport(xmlrpc.client.Transport):
    def __init__(self, timeout_s):
        super().__init__()
        self._timeout_s = timeout_s

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = self._timeout_s
        return connection


def slave_api(uri, timeout_s):
    """A proxy of a node's slave API that never waits longer than `timeout_s` for one read.

    Nodes are on this machine, by whatever name they call it.
    """
    local = "http://{}:{}/".format(LOOPBACK, urlparse(uri).port)
    return xmlrpc.client.ServerProxy(local, transport=_Transport(timeout_s))


def call(method, *args):
    """Call a method of the slave API and return its value; raise ProtocolError for anything but success."""
    try:
        code, message, value = method(*args)
    except Exception as error:
        raise ProtocolError("{}: {}".format(type(error).__name__, error)) from error
    if code != 1:
        raise ProtocolError(str(message)[:200])
    return value


def read_header(sock):
    """Read one connection header from a blocking socket, and not a byte more: (fields, as str to str)."""
    (length,) = LENGTH.unpack(read_exactly(sock, LENGTH.size))
    if length > HEADER_BYTES_MAX:
        raise ProtocolError("connection header of {} bytes".format(length))
    body = read_exactly(sock, length)
    try:
        return decode_ros_handshake_header(LENGTH.pack(length) + body)
    except Exception as error:
        raise ProtocolError("no connection header: {}".format(error)) from error


def read_exactly(sock, count):
    buffer = io.BytesIO()
    while buffer.tell() < count:
        chunk = sock.recv(count - buffer.tell())
        if not chunk:
            raise ProtocolError("connection closed in the header")
        buffer.write(chunk)
    return buffer.getvalue()


def write_header(sock, fields):
    sock.sendall(encode_ros_handshake_header(fields))


def connect(port, timeout_s):
    sock = socket.create_connection((LOOPBACK, port), timeout_s)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock
