"""Takes the arena's frames apart (grader/arena/ros/wire.py says what they hold)."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from grader.errors import ArenaError

HEADER = struct.Struct("<BIQ")
CHANNEL_ID = LENGTH = struct.Struct("<I")
FRAME_BYTES_MAX = 24 << 20


class Frame(NamedTuple):
    """`kind` is one of C, M, E, S; `channel` and `datas` (messages) belong to M, `fields` to the others."""

    kind: str
    time_ns: int
    channel: int
    datas: list[bytes]
    fields: dict[str, Any]


class FrameReader:
    """Bytes in, whole frames out. Raises ArenaError for what is none."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0
        self._needed = HEADER.size

    def feed(self, chunk: bytes) -> Iterator[Frame]:
        self._pieces.append(chunk)
        self._size += len(chunk)
        if self._size < self._needed:
            return
        data, start = b"".join(self._pieces), 0
        self._needed = HEADER.size
        while len(data) - start >= HEADER.size:
            kind, length, time_ns = HEADER.unpack_from(data, start)
            if length > FRAME_BYTES_MAX:
                raise ArenaError("the arena sent bytes that are no frame")
            end = start + HEADER.size + length
            if end > len(data):
                self._needed = end - start
                break
            yield _frame(chr(kind), time_ns, data, start + HEADER.size, end)
            start = end
        self._pieces = [data[start:]]
        self._size = len(data) - start


def _frame(kind: str, time_ns: int, data: bytes, start: int, end: int) -> Frame:
    try:
        if kind == "M":
            (channel,) = CHANNEL_ID.unpack_from(data[start : min(end, start + CHANNEL_ID.size)])
            return Frame(kind, time_ns, channel, _messages(data, start + CHANNEL_ID.size, end), {})
        return Frame(kind, time_ns, 0, [], _fields(data[start:end]))
    except (struct.error, ValueError, TypeError, RecursionError) as error:
        raise ArenaError("the arena sent bytes that are no frame") from error


def _messages(data: bytes, start: int, end: int) -> list[bytes]:
    found, unpack_from = [], LENGTH.unpack_from
    while start < end:
        (length,) = unpack_from(data, start)
        start += LENGTH.size
        found.append(data[start : start + length])
        start += length
    if start != end:
        raise ValueError("a message that is not whole")
    return found


def _fields(payload: bytes) -> dict[str, Any]:
    """Halves of surrogate pairs, which no record can hold, become question marks."""
    fields = json.loads(payload)
    if b"\\ud" in payload or b"\xed" in payload:
        fields = json.loads(json.dumps(fields, ensure_ascii=False).encode(errors="replace"))
    return dict(fields)
