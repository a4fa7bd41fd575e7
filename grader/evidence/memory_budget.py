"""A limit on the memory that the recordings of one submission take: as they lie in the files, and decoded."""

from __future__ import annotations

HELD_BYTES_MAX = 192 << 20
"""More than the arena records of one submission (`arena/limits.py`)."""
FOREIGN_BYTES_MAX = 96 << 20
"""Of other tools' recordings, which are held unpacked beside it."""
DECODED_BYTES_MAX = 160 << 20
RECORD_BYTES = 150
"""What a message takes beside its own bytes, roughly."""
LESS = "record the lab's topics only: `rosbag record /topic …`, or cut it with `rosbag filter`"
"""What to do about a recording that is too large."""


class BudgetExceeded(ValueError):
    """The recordings need more memory than they may take."""


class MemoryBudget:
    """Counts the memory taken. One budget is shared by all recordings that are read together."""

    def __init__(self, *, decoded_bytes: int = DECODED_BYTES_MAX) -> None:
        self._decoded_bytes_max = decoded_bytes
        self._held_bytes = self._decoded_bytes = 0

    def hold(self, size_bytes: int, *, foreign: bool) -> None:
        """Count a record as it lies in the file. Raises BudgetExceeded."""
        self._held_bytes += RECORD_BYTES + size_bytes
        most_bytes = FOREIGN_BYTES_MAX if foreign else HELD_BYTES_MAX
        if self._held_bytes > most_bytes:
            raise BudgetExceeded(f"it holds more than {most_bytes >> 20} MiB of messages")

    def decode(self, size_bytes: int) -> None:
        """Count what a message takes once decoded, at most. Raises BudgetExceeded."""
        self._decoded_bytes += size_bytes
        if self._decoded_bytes > self._decoded_bytes_max:
            raise BudgetExceeded(
                f"its messages come to more than {self._decoded_bytes_max >> 20} MiB once decoded"
            )
