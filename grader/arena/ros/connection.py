"""One publisher's connection: cuts the stream into messages and hands them on, as far as there is room for them."""

from tcpros import LENGTH
from wire import now_ns

READ_BYTES = 1 << 16
FEW_BYTES, MANY_FRAMES = 1 << 13, 500
"""Small messages take more time than their bytes: after a piece with so many, the next one is shorter."""
MESSAGE_BYTES_MAX = 16 << 20
HELD_BYTES_MAX = 4 << 20
LATCHING_S = 1.5
REST_S = 0.01
DROPPED_MAX = 2000
"""After so many that were dropped, what comes is thrown away unread: its bytes say about how many they were."""
_WASTE = bytearray(1 << 20)


class Connection:
    """Its channel opens with the first message, when the publisher can say whether it latches; until then messages
    are held, with the times of their arrival.

    Each look takes no more than `READ_BYTES`, so that others have their turn, and what is not recorded is never kept:
    it is skipped as it comes. Without an `account` nothing is recorded.
    """

    def __init__(self, recorder, sock, *, topic, caller_id, header, account):
        self.sock = sock
        self.topic = topic
        self.caller_id = caller_id
        self.port = sock.getpeername()[1]
        self._recorder = recorder
        self._header = header
        self._account = account
        self._buffer = bytearray()
        self._reserved = 0
        self._accepted = False
        self._skip = 0
        self._messages = self._dropped = self._wasted_bytes = 0
        self._length = 0
        self._piece_bytes = FEW_BYTES
        self._closed = self._opened = self._broken = False
        self._watched = self._paused = False
        self._held = []
        self._held_bytes = 0

    def watch(self):
        """Read on, as far as the run has not ended meanwhile."""
        if not self._watched and not self._closed and not self._paused:
            self._watched = True
            self._recorder.loop.add_reader(self.sock, self._look)

    def _rest(self):
        self._watched = False
        self._recorder.loop.remove_reader(self.sock)

    def _look(self):
        """Who sends much waits while the grader is behind; all others are read in time."""
        if self._account is not None and self._account.heavy and self._recorder.wire.congested:
            self._rest()
            self._recorder.loop.call_later(REST_S, self.watch)
        else:
            self.readable()

    def readable(self):
        """Take one piece of what the socket holds; False where there was none."""
        if self._closed:
            return False
        if self._dropped >= DROPPED_MAX:
            return self._throw_away()
        try:
            chunk = self.sock.recv(self._piece_bytes)
        except BlockingIOError:
            return False
        except OSError:
            chunk = b""
        if not chunk:
            self.close()
            return False
        frames = self._frames(chunk)
        self._piece_bytes = FEW_BYTES if len(frames) > MANY_FRAMES else READ_BYTES
        if frames:
            self._messages += len(frames)
            self._hand_on(frames, now_ns())
        if self._broken:
            self.close()
        return True

    def _throw_away(self):
        try:
            count = self.sock.recv_into(_WASTE)
        except BlockingIOError:
            return False
        except OSError:
            count = 0
        self._wasted_bytes += count
        if not count:
            self.close()
        return count > 0

    def _frames(self, chunk):
        """Cut whole messages off the stream, those for which there is room."""
        frames = []
        skipped = min(self._skip, len(chunk))
        self._skip -= skipped
        buffer = self._buffer
        buffer += chunk[skipped:]
        start, size = 0, len(buffer)
        while size - start >= LENGTH.size:
            (length,) = LENGTH.unpack_from(buffer, start)
            if length > MESSAGE_BYTES_MAX:
                self._invalid(length)
                break
            end = start + LENGTH.size + length
            self._length = length
            if not self._accepted and not self._has_room(length, end > size):
                self._skip = max(0, end - size)
                start = min(end, size)
                continue
            self._accepted = end > size
            if self._accepted:
                break
            frames.append(bytes(buffer[start + LENGTH.size : end]))
            self._release()
            start = end
        del buffer[:start]
        return frames

    def _has_room(self, length, waits):
        """Whether a message is recorded; one that is not yet here as a whole (`waits`) needs room in memory, too."""
        reserved = length if waits else 0
        if self._account is not None and (not reserved or self._recorder.reserve(reserved)):
            self._reserved = reserved
            if self._account.take(length):
                return True
            self._release()
        self._dropped += 1
        if self._dropped == 1:
            self._recorder.overflows(self, self._messages)
        return False

    def _release(self):
        if self._reserved:
            self._recorder.release(self._reserved)
            self._reserved = 0

    def _invalid(self, length):
        self._recorder.note("invalid", self.topic, self.caller_id, detail="{} bytes".format(length))
        self._recorder.too_large(self, length)
        self._broken = True

    def _hand_on(self, frames, time_ns):
        if self._opened:
            self._recorder.wire.messages(self._account.channel, frames, time_ns)
            return
        if not self._held:
            self._recorder.ask_latching(self)
            self._recorder.loop.call_later(LATCHING_S, lambda: self.open(latching=False))
        self._held.append((frames, time_ns))
        self._held_bytes += sum(map(len, frames))
        if self._held_bytes > HELD_BYTES_MAX and not self._paused:
            self._paused = True
            self._rest()

    def open(self, *, latching):
        """Hand on what was held; the channel is made where it is not there from an earlier connection."""
        if self._opened or self._account is None:
            return
        self._opened = True
        if self._account.channel is None:
            self._account.channel = self._recorder.wire.channel(
                topic=self.topic,
                callerid=self.caller_id,
                type=self._header["type"],
                md5sum=self._header["md5sum"],
                definition=self._header.get("message_definition", ""),
                latching=latching or self._header.get("latching") == "1",
            )
        for frames, time_ns in self._held:
            self._recorder.wire.messages(self._account.channel, frames, time_ns)
        self._held = []
        if self._paused:
            self._paused = False
            self.watch()

    def close(self):
        if self._closed:
            return
        self._closed = True
        self._release()
        self.open(latching=False)
        self._recorder.closed(self)
        self.sock.close()
        dropped = self._dropped + self._wasted_bytes // (LENGTH.size + self._length)
        self._recorder.note("closed", self.topic, self.caller_id, messages=self._messages, dropped=dropped)
