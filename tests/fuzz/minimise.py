"""Makes a finding small: pieces are left out as long as it stays the same finding."""

from __future__ import annotations

import time
from collections.abc import Callable

TRIES = 300
PATIENCE_S = 60.0


def minimised(data: bytes, still: Callable[[bytes], bool]) -> bytes:
    """The shortest that was met within a number of tries, and within a minute."""
    tries, piece, until_s = 0, max(1, len(data) // 2), time.monotonic() + PATIENCE_S
    while piece and tries < TRIES:
        place = 0
        while place < len(data) and tries < TRIES:
            if time.monotonic() > until_s:
                return data
            shorter = data[:place] + data[place + piece :]
            tries += 1
            if still(shorter):
                data = shorter
            else:
                place += piece
        piece //= 2
    return data
