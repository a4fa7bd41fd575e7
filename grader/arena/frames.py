"""Takes the arena's frames apart (grader/arena/ros/wire.py says what they hold)."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from grader.errors import ArenaError

HEADER = struct.Struct("<BIQ")
CHANNEL_ID = struct.Struct("<I")
FRAME_BYTES_MAX = 24 << 20


class Frame(NamedTuple):
    """`kind` is one of C, M, E, S; `channel` and `data` belong to M, `fields` to the others."""

    kind: str
    time_ns: int
    channel: int
    data: bytes
    fields: dict[str, Any]


class FrameReader:
    """Bytes in, whole frames out. Raises ArenaError for what is none."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, chunk: bytes) -> Iterator[Frame]:
        self._buffer += chunk
        start = 0
        while len(self._buffer) - start >= HEADER.size:
            kind, length, time_ns = HEADER.unpack_from(self._buffer, start)
            if length > FRAME_BYTES_MAX:
                raise ArenaError("the arena sent bytes that are no frame")
            end = start + HEADER.size + length
            if end > len(self._buffer):
                break
            yield _frame(chr(kind), time_ns, bytes(self._buffer[start + HEADER.size : end]))
            start = end
        del self._buffer[:start]


def _frame(kind: str, time_ns: int, payload: bytes) -> Frame:
    try:
        if kind == "M":
            (channel,) = CHANNEL_ID.unpack_from(payload)
            return Frame(kind, time_ns, channel, payload[CHANNEL_ID.size :], {})
        return Frame(kind, time_ns, 0, b"", _fields(payload))
    except (struct.error, ValueError, TypeError, RecursionError) as error:
        raise ArenaError("the arena sent bytes that are no frame") from error


def _fields(payload: bytes) -> dict[str, Any]:
    """Halves of surrogate pairs, which no record can hold, become question marks."""
    fields = json.loads(payload)
    if b"\\ud" in payload or b"\xed" in payload:
        fields = json.loads(json.dumps(fields, ensure_ascii=False).encode(errors="replace"))
    return dict(fields)
