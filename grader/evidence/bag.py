"""ROS 1 bags (`rosbag record`) as runs, by rosbags."""

from __future__ import annotations

import struct
from collections import defaultdict
from pathlib import Path

from rosbags.interfaces import Connection, ConnectionExtRosbag1
from rosbags.rosbag1 import Reader, ReaderError

from grader.errors import EvidenceError
from grader.evidence.run import Channel, Message, Run

MAGIC = b"#ROSBAG V2.0\n"
MAX_MESSAGES = 2_000_000
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


def load_bag(path: Path) -> Run:
    """A bag as a real-time run named after the file; it says nothing of processes. Raises EvidenceError."""
    try:
        with Reader(path) as reader:
            channels = _channels(reader)
    except ReaderError as error:
        raise EvidenceError(
            f"{path}: {error}", hint="`rosbag reindex` mends a bag that was cut short"
        ) from error
    except (*_DAMAGE, struct.error, OSError) as error:
        raise EvidenceError(f"{path}: damaged", hint="record it again, or copy it again") from error
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


def _channels(reader: Reader) -> tuple[Channel, ...]:
    messages: dict[int, list[Message]] = defaultdict(list)
    for count, (connection, time_ns, data) in enumerate(reader.messages()):
        if count >= MAX_MESSAGES:
            raise ReaderError(f"more than {MAX_MESSAGES} messages")
        own = messages[connection.id]
        own.append(Message(time_ns, len(own), bytes(data)))
    return tuple(_channel(connection, messages[connection.id]) for connection in reader.connections)


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
