"""The port of the arena's own node: takes connections in, each for no longer than its header may take."""

import collections
import contextlib
import socket
import threading

from bounded import BoundedSocket, ProtocolError
from callers import SOMEBODY
from guard import shown
from tcpros import HEADER_BYTES_MAX, LENGTH, Closed, check_fields, read_header

HOST = "127.0.0.1"
HANDSHAKE_S = 2.0
WAITING_MAX = 128


class Door:
    """`join(sock, header, who)` keeps a connection of the process `who`, or raises ProtocolError or OSError.

    Of those that have not yet said what they want, the one that has waited for longest makes way.
    """

    def __init__(self, loop, join, guard, owners):
        self._join = join
        self._guard = guard
        self._owners = owners
        self._waiting = collections.OrderedDict()
        self._crowded = False
        self._lock = threading.Lock()
        self._server = socket.create_server((HOST, 0), backlog=4096)
        self.port = self._server.getsockname()[1]
        loop.add_reader(self._server, self._accept)

    def _accept(self):
        sock, address = self._server.accept()
        sock = BoundedSocket(fileno=sock.detach())
        sock.allow(HANDSHAKE_S, HEADER_BYTES_MAX + LENGTH.size)
        with self._lock:
            oldest = self._waiting.popitem(last=False)[0] if len(self._waiting) >= WAITING_MAX else None
            self._waiting[sock] = address
        if oldest is not None:
            with contextlib.suppress(OSError):  # closed meanwhile
                oldest.shutdown(socket.SHUT_RDWR)
        threading.Thread(target=self._handshake, args=(sock, address, oldest), daemon=True).start()

    def _handshake(self, sock, address, pushed_out):
        if pushed_out is not None:
            self._note_crowd()
        try:
            header = self._header(sock)
            self._join(sock, header, self._who(address))
        except (OSError, Closed):
            sock.close()
        except ProtocolError as error:
            detail = "sent the grader's node no header: {}".format(shown(error))
            self._guard.refused(self._who(address), detail)
            sock.close()

    def _header(self, sock):
        try:
            header = read_header(sock)
            check_fields(header)
            return header
        finally:
            with self._lock:
                self._waiting.pop(sock, None)

    def _who(self, address):
        return self._owners.caller(address, (HOST, self.port)) or SOMEBODY

    def _note_crowd(self):
        """Whose most of them are: asked once."""
        with self._lock:
            waiting, self._crowded = None if self._crowded else list(self._waiting.values()), True
        if waiting is not None:
            whose = self._owners.callers([(address, (HOST, self.port)) for address in waiting])
            most = collections.Counter(whose).most_common(1)[0][0]
            detail = "opened more than {} connections to the grader's node that said nothing".format(
                WAITING_MAX
            )
            self._guard.limit(most or SOMEBODY, detail)
