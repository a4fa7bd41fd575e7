"""How much memory the recordings of one submission may take: as they lie in the files, and decoded."""

from __future__ import annotations

HELD_BYTES_MAX = 192 << 20
"""More than the arena records of one submission (`arena/limits.py`)."""
FOREIGN_BYTES_MAX = 96 << 20
"""Of another tool's recordings, which have to be unpacked beside it."""
DECODED_BYTES_MAX = 160 << 20
RECORD_BYTES = 150
"""What a message takes beside its own bytes, about."""
LESS = "record the lab's topics only: `rosbag record /topic …`, or cut it with `rosbag filter`"
"""What to do about a recording that is too large."""


class NoRoom(ValueError):
    """There is more than may be held in memory."""


class Room:
    """Counts what is taken. One is shared by all recordings that are looked at together."""

    def __init__(self, *, decoded_bytes: int = DECODED_BYTES_MAX) -> None:
        self._decoded_bytes_max = decoded_bytes
        self._held_bytes = self._decoded_bytes = 0

    def hold(self, size_bytes: int, *, foreign: bool) -> None:
        """Take room for a record as it lies in the file. Raises NoRoom."""
        self._held_bytes += RECORD_BYTES + size_bytes
        most_bytes = FOREIGN_BYTES_MAX if foreign else HELD_BYTES_MAX
        if self._held_bytes > most_bytes:
            raise NoRoom(f"it holds more than {most_bytes >> 20} MiB of messages")

    def decode(self, size_bytes: int) -> None:
        """Take room for what a message may come to. Raises NoRoom."""
        self._decoded_bytes += size_bytes
        if self._decoded_bytes > self._decoded_bytes_max:
            raise NoRoom(f"its messages come to more than {self._decoded_bytes_max >> 20} MiB once decoded")
