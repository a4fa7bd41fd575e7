"""ROS 1 bags (`rosbag record`) as runs, by rosbags."""

from __future__ import annotations

import bz2
import struct
from collections import defaultdict
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped] # it has no stubs
from rosbags.interfaces import Connection, ConnectionExtRosbag1
from rosbags.rosbag1 import Reader, ReaderError

from grader.errors import EvidenceError
from grader.evidence.channels import merged
from grader.evidence.container import MAX_CHUNK_BYTES, MAX_UNPACKED_BYTES
from grader.evidence.run import Channel, Message, Run

MAGIC = b"#ROSBAG V"
BZ2 = b"BZh"
LZ4 = b"\x04\x22\x4d\x18"
MAX_MESSAGES = 2_000_000
MAX_CONNECTIONS = 4_096
_DAMAGE = (
    AssertionError,
    EOFError,
    IndexError,
    KeyError,
    MemoryError,
    OverflowError,
    RuntimeError,
    ValueError,
)
_AGAIN = "record it again, or copy it again"
_REINDEX = "`rosbag reindex FILE` mends a bag whose recording was not ended with Ctrl-C"


class BagLimitError(ValueError):
    """The bag breaks a limit."""


def load_bag(path: Path) -> Run:
    """A bag as a real-time run named after the file; it says nothing of processes. Raises EvidenceError."""
    try:
        with Reader(path) as reader:
            channels = _channels(reader)
    except ReaderError as error:
        raise _refusal(path, str(error)) from error
    except BagLimitError as error:
        raise EvidenceError(f"{path}: {error}") from error
    except (*_DAMAGE, struct.error, OSError) as error:
        raise EvidenceError(f"{path}: damaged", hint=_AGAIN) from error
    times = [t for channel in channels for t in channel.times_ns]
    return Run(
        evidence=path.name,
        scenario=path.stem,
        clock="real",
        warp=1.0,
        metadata={},
        start_ns=min(times, default=0),
        end_ns=max(times, default=0),
        channels=channels,
    )


def _refusal(path: Path, reason: str) -> EvidenceError:
    """What rosbags cannot read, in an owner's words."""
    if "not indexed" in reason:
        return EvidenceError(f"{path}: cut short: it has no index", hint=_REINDEX)
    if "version" in reason and "Bag" in reason:
        return EvidenceError(
            f"{path}: a bag of another format than 2.0", hint="`rosbag fix` converts old bags"
        )
    if "encryption" in reason:
        return EvidenceError(f"{path}: an encrypted bag", hint="hand it in without encryption")
    if "Compression" in reason:
        return EvidenceError(f"{path}: compressed in an unknown way", hint="`rosbag decompress` unpacks it")
    return EvidenceError(f"{path}: damaged or cut short", hint=_REINDEX)


def _channels(reader: Reader) -> tuple[Channel, ...]:
    if len(reader.connections) > MAX_CONNECTIONS:
        raise BagLimitError(f"more than {MAX_CONNECTIONS} connections")
    if reader.message_count > MAX_MESSAGES:
        raise BagLimitError(f"more than {MAX_MESSAGES} messages")
    unpacker = _Unpacker()
    for place, chunk in reader.chunks.items():
        reader.chunks[place] = chunk._replace(decompressor=unpacker)
    messages: dict[int, list[Message]] = defaultdict(list)
    for count, (connection, time_ns, data) in enumerate(reader.messages()):
        if count >= MAX_MESSAGES:
            raise BagLimitError(f"more than {MAX_MESSAGES} messages")
        messages[connection.id].append(Message(time_ns, count, bytes(data)))
    found = (_channel(connection, messages[connection.id]) for connection in reader.connections)
    return merged(found, renumber=True)


class _Unpacker:
    """Unpacks chunks to no more than the limits, whatever they hold and however often they are asked for."""

    def __init__(self) -> None:
        self._unpacked_bytes = 0

    def __call__(self, data: bytes) -> bytes:
        if data.startswith(BZ2):
            plain = bz2.BZ2Decompressor().decompress(data, MAX_CHUNK_BYTES + 1)
        elif data.startswith(LZ4):
            plain = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=MAX_CHUNK_BYTES + 1)
        else:
            return data
        self._unpacked_bytes += len(plain)
        if len(plain) > MAX_CHUNK_BYTES:
            raise BagLimitError(f"a chunk of more than {MAX_CHUNK_BYTES >> 20} MiB")
        if self._unpacked_bytes > MAX_UNPACKED_BYTES:
            raise BagLimitError(f"more than {MAX_UNPACKED_BYTES >> 20} MiB unpacked")
        return plain


def _channel(connection: Connection, messages: list[Message]) -> Channel:
    ext = connection.ext
    recorded = ext if isinstance(ext, ConnectionExtRosbag1) else ConnectionExtRosbag1(None, None)
    package, _, name = connection.msgtype.partition("/msg/")
    return Channel(
        topic=connection.topic,
        callerid=recorded.callerid or "",
        type=f"{package}/{name}",
        md5sum=connection.digest,
        definition=connection.msgdef.data,
        latching=bool(recorded.latching),
        messages=tuple(messages),
    )
