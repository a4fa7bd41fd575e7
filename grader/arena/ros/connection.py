"""One publisher's TCPROS connection: cuts the stream into messages and passes on those for which there is room."""

from bounded_sockets import receive, receive_into
from wire import LENGTH

MESSAGE_BYTES_MAX = 16 << 20
READ_BYTES = 1 << 16
LARGE_BYTES, LARGE_READ_BYTES = 1 << 14, 1 << 19
"""Longer messages are read into their own place, in pieces of so much."""
# Of what is held until the channel opens: then the publisher waits.
HELD_BYTES_MAX = 16 << 20
# A little more than the recorder takes to ask (its `LATCHING_S`): after that the header's word counts.
LATCHING_S = 6.0
REST_S = 0.01
BUSY_NS, BUSY_MESSAGES, BUSY_LOOKS = 250000, 4, 16
BREATH_S = 0.001
"""Where so many looks in a row find messages at more than 4 kHz, the next ones come together."""
DROPPED_MAX = 2000
"""After so many that were dropped nothing is kept any more, only counted."""
# One for all connections, since only the loop reads.
_WASTE = memoryview(bytearray(1 << 20))


class Connection:
    """Its channel opens with the first message, when the publisher can say whether it latches; until then messages
    are held, with the times of their arrival.

    Each look takes one piece, so that others have their turn, and what is not recorded is never kept: it is skipped
    as it comes. Without an `account` nothing is recorded.
    """

    def __init__(self, recorder, sock, *, topic, caller_id, header, account):
        self.sock = sock
        self.topic = topic
        self.caller_id = caller_id
        self.port = sock.getpeername()[1]
        self._recorder = recorder
        self._header = header
        self._account = account
        self._rest = b""
        self._message = None
        self._filled = self._skip = 0
        self._messages = self._dropped = 0
        self._waste = None
        self._looked_ns = self._handed_on_ns = self._busy = 0
        self._closed = self._opened = self._broken = self._behind = False
        self._watched = self._paused = False
        self._held = []
        self._held_bytes = 0

    def watch(self):
        """Read on, unless the run has ended since."""
        if not self._watched and not self._closed and not self._paused:
            self._watched = True
            self._recorder.loop.add_reader(self.sock, self._look)

    def _rests(self):
        self._watched = False
        self._recorder.loop.remove_reader(self.sock)

    def _look(self):
        """A publisher that sends much waits while the grader is behind; all others are read in time."""
        if self._account is not None and self._account.heavy and self._recorder.wire.congested:
            self._falls_behind()
            self._rests()
            self._recorder.loop.call_later(REST_S, self.watch)
        elif self.readable() and self._busy > BUSY_LOOKS:
            self._rests()
            self._recorder.loop.call_later(BREATH_S, self.watch)

    def _falls_behind(self):
        """Note that its publisher may have to drop messages that are not taken: a judge of its rate should know."""
        if not self._behind:
            self._behind = True
            self._recorder.note("behind", self.topic, self.caller_id, messages=self._messages)

    def readable(self):
        """Take one piece of what the socket holds; False where there was none."""
        if self._closed:
            return False
        try:
            count = self._read()
        except BlockingIOError:
            return False
        except OSError:
            count = 0
        if not count or self._broken:
            self.close()
        return count > 0

    def _read(self):
        """Read once; return how many bytes that were. Raises what `recv` raises."""
        if self._waste is not None:
            return self._throw_away()
        # The rest of a large message for which there was no room.
        if self._skip:
            count = self.sock.recv_into(_WASTE[: self._skip])
            self._skip -= count
            return count
        if self._message is not None:
            return self._fill()
        chunk, time_ns = receive(self.sock, READ_BYTES)
        if chunk:
            self._cut(chunk, time_ns)
        return len(chunk)

    def _throw_away(self):
        # Looking at each length of a flood costs CPU. To estimate by bytes, at least one has to be known.
        self._waste.counts = self._recorder.counts or not self._waste.begun
        count = self.sock.recv_into(_WASTE[:READ_BYTES] if self._waste.counts else _WASTE)
        self._count(_WASTE[:count])
        return count

    def _count(self, data):
        found, too_long = self._waste.feed(data)
        self._recorder.count(found)
        if too_long:
            self._invalid(too_long)

    def _fill(self):
        """Read on in a large message, and hand it on when it is whole; return how many bytes were read."""
        end = min(len(self._message), self._filled + LARGE_READ_BYTES)
        with memoryview(self._message) as view:
            count, time_ns = receive_into(self.sock, view[self._filled : end])
        self._filled += count
        if self._filled == len(self._message):
            message, self._message = self._message, None
            self._recorder.release(len(message))
            self._hand_on([message], 1, time_ns)
        return count

    def _cut(self, chunk, time_ns):
        """Cut whole messages off the stream, those for which there is room."""
        data = self._rest + chunk if self._rest else chunk
        ends, too_long = message_ends(data)
        # The last end lies beyond the piece where its message has only begun.
        beyond = ends.pop() if ends and ends[-1] > len(data) else 0
        at = ends[-1] if ends else 0
        self._note_pace(len(ends), time_ns)
        self._rest = b""
        if ends:
            self._take(data, ends, time_ns)
        if too_long:
            self._invalid(too_long)
        elif self._dropped >= DROPPED_MAX:
            self._waste = Waste()
            self._count(data[at:])
        elif beyond - at > LARGE_BYTES:
            self._begin(data[at:], beyond - at)
        else:
            self._rest = data[at:]

    def _note_pace(self, messages, time_ns):
        quick = messages >= BUSY_MESSAGES or time_ns - self._looked_ns < BUSY_NS
        self._busy = self._busy + 1 if quick else 0
        self._looked_ns = time_ns

    def _take(self, data, ends, time_ns):
        """Pass on whole messages in one piece, or, where there is not room for all, one by one."""
        if self._has_room(ends[-1] - LENGTH.size * len(ends), len(ends)):
            self._hand_on([data[: ends[-1]]], len(ends), time_ns)
            return
        pieces, start = [], 0
        for end in ends:
            if self._has_room(end - start - LENGTH.size, 1):
                pieces.append(data[start:end])
            else:
                self._drop()
            start = end
        if pieces:
            self._hand_on(pieces, len(pieces), time_ns)

    def _begin(self, part, size):
        """A large message of which more is to come: room for all of it, or none is kept."""
        if self._account is not None and self._recorder.reserve(size):
            if self._has_room(size - LENGTH.size, 1):
                self._message = bytearray(size)
                self._message[: len(part)] = part
                self._filled = len(part)
                return
            self._recorder.release(size)
        self._drop()
        self._skip = size - len(part)

    def _has_room(self, size, messages):
        return self._account is not None and self._account.take(size, messages)

    def _drop(self):
        self._dropped += 1
        if self._dropped == 1:
            self._recorder.overflows(self, self._messages, self._looked_ns)

    def _invalid(self, length):
        self._recorder.note("invalid", self.topic, self.caller_id, detail="{} bytes".format(length))
        self._recorder.too_large(self, length)
        self._broken = True

    def _hand_on(self, pieces, messages, time_ns):
        """Pass messages on to the grader, or hold them until the channel is open. Their times never go back."""
        time_ns = self._handed_on_ns = max(self._handed_on_ns, time_ns)
        self._messages += messages
        self._recorder.pass_on(self.topic, pieces)
        if self._opened:
            self._recorder.wire.messages(self._account.channel, pieces, time_ns)
            return
        if not self._held:
            self._recorder.ask_latching(self)
            self._recorder.loop.call_later(LATCHING_S, lambda: self.open(latching=False))
        self._held.append((pieces, time_ns))
        self._held_bytes += sum(map(len, pieces))
        if self._held_bytes > HELD_BYTES_MAX and not self._paused:
            self._falls_behind()
            self._paused = True
            self._rests()

    def open(self, *, latching):
        """Pass on what was held; the channel is made where it is not there from an earlier connection."""
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
        for pieces, time_ns in self._held:
            self._recorder.wire.messages(self._account.channel, pieces, time_ns)
        self._held = []
        if self._paused:
            self._paused = False
            self.watch()

    def close(self):
        if self._closed:
            return
        self._closed = True
        if self._message is not None:
            self._recorder.release(len(self._message))
            self._message = None
        self.open(latching=False)
        self._recorder.closed(self)
        self.sock.close()
        self._tell_totals()

    def _tell_totals(self):
        dropped, exact = self._dropped, True
        if self._waste is not None:
            dropped, exact = dropped + self._waste.messages, self._waste.exact
        detail = "" if exact else "as many as its bytes say"
        self._recorder.note(
            "closed", self.topic, self.caller_id, messages=self._messages, dropped=dropped, detail=detail
        )


def message_ends(data, at=0):
    """Return where the messages end that begin in `data` from `at` on, and the length of one that is longer than any
    may be, or 0. The last end lies beyond the data if that message is not there as a whole."""
    # The innermost loop of the recorder: a local name saves a look-up for each message.
    ends, last, unpack_from = [], len(data) - LENGTH.size, LENGTH.unpack_from
    while at <= last:
        (length,) = unpack_from(data, at)
        if length > MESSAGE_BYTES_MAX:
            return ends, length
        at += LENGTH.size + length
        ends.append(at)
    return ends, 0


class Waste:
    """Counts messages that are thrown away: by their lengths as long as it `counts`, then by their bytes."""

    def __init__(self):
        self.counts = True
        self._messages = self._counted_bytes = self._other_bytes = 0
        self._skip = 0
        self._rest = b""

    @property
    def begun(self):
        """Whether it has seen the length of one at least."""
        return self._messages > 0

    @property
    def messages(self):
        return self._messages + self._other_bytes * self._messages // max(1, self._counted_bytes)

    @property
    def exact(self):
        return not self._other_bytes

    def feed(self, data):
        """Count those that begin in one more piece: (how many, a length that no message has or 0)."""
        if not self.counts:
            self._other_bytes += len(data)
            return 0, 0
        self._counted_bytes += len(data)
        if self._skip >= len(data):
            self._skip -= len(data)
            return 0, 0
        if self._rest:
            data = self._rest + bytes(data)
        ends, too_long = message_ends(data, self._skip)
        at = ends[-1] if ends else self._skip
        self._skip = max(0, at - len(data))
        self._rest = bytes(data[at:])
        self._messages += len(ends)
        return len(ends), too_long
