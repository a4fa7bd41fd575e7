"""Cuts what comes over a TCPROS connection into messages, each behind its length."""

from tcpros import LENGTH

MESSAGE_BYTES_MAX = 16 << 20


def message_ends(data, at=0):
    """Where the messages end that begin in `data` from `at` on, the last one's end maybe beyond it; and the length of
    one that is longer than any may be, or 0."""
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
