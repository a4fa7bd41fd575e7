"""One publisher's connection: cuts the stream into messages and hands them on, up to the limits."""

import threading

from tcpros import LENGTH
from wire import now_ns

READ_BYTES = 1 << 18
MESSAGE_BYTES_MAX = 64 << 20


class Connection:
    """Its channel opens with the first message, when the publisher can say whether it latches; until then messages
    are held, with the times of their arrival."""

    def __init__(self, recorder, sock, topic, caller_id, header):
        self.sock = sock
        self._recorder = recorder
        self._topic = topic
        self._caller_id = caller_id
        self._buffer = bytearray()
        self._messages = 0
        self._bytes = 0
        self._dropped = 0
        self._closed = False
        self._header = header
        self._port = sock.getpeername()[1]
        self._channel = None
        self._held = []

    def readable(self):
        """Take all that the socket holds now."""
        while not self._closed:
            try:
                chunk = self.sock.recv(READ_BYTES)
            except BlockingIOError:
                return
            except OSError:
                chunk = b""
            if not chunk:
                self.close()
                return
            self._buffer += chunk
            self._record(self._frames())
            if len(chunk) < READ_BYTES:
                return

    def _frames(self):
        """Cut whole messages off the buffer."""
        frames = []
        start = 0
        buffer = self._buffer
        while len(buffer) - start >= LENGTH.size:
            (length,) = LENGTH.unpack_from(buffer, start)
            if length > MESSAGE_BYTES_MAX:
                self._recorder.note("invalid", self._topic, self._caller_id, detail="{} bytes".format(length))
                self.close()
                break
            end = start + LENGTH.size + length
            if end > len(buffer):
                break
            frames.append(bytes(buffer[start + LENGTH.size : end]))
            start = end
        del buffer[:start]
        return frames

    def _record(self, frames):
        if not frames:
            return
        recorder = self._recorder
        time_ns = now_ns()
        room = recorder.messages_max - self._messages
        kept = frames if len(frames) <= room else frames[: max(0, room)]
        size = sum(map(len, kept))
        if self._bytes + size > recorder.bytes_max:
            kept, size = [], 0
        if kept:
            self._hand_on(kept, time_ns)
        self._messages += len(kept)
        self._bytes += size
        if len(kept) < len(frames):
            if not self._dropped:
                recorder.note("limit", self._topic, self._caller_id, messages=self._messages)
            self._dropped += len(frames) - len(kept)

    def _hand_on(self, frames, time_ns):
        if self._channel is not None:
            self._recorder.wire.messages(self._channel, frames, time_ns)
            return
        self._held.append((frames, time_ns))
        if len(self._held) == 1:
            threading.Thread(target=self._ask, daemon=True).start()

    def _ask(self):
        latching = False
        try:
            latching = self._recorder.ask_latching(self._topic, self._port)
        finally:
            self._recorder.loop.call_soon(lambda: self._open(latching))

    def _open(self, latching):
        if self._channel is not None:
            return
        header = self._header
        self._channel = self._recorder.wire.channel(
            topic=self._topic,
            callerid=self._caller_id,
            type=header["type"],
            md5sum=header["md5sum"],
            definition=header.get("message_definition", ""),
            latching=latching or header.get("latching") == "1",
        )
        for frames, time_ns in self._held:
            self._recorder.wire.messages(self._channel, frames, time_ns)
        self._held = []

    def close(self):
        if self._closed:
            return
        self._closed = True
        self._open(False)
        self._recorder.closed(self)
        self.sock.close()
        self._recorder.note(
            "closed", self._topic, self._caller_id, messages=self._messages, dropped=self._dropped
        )
