"""Bags and MCAP files as other tools write them."""

from __future__ import annotations

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer

from grader.evidence import decode
from tests.evidence.samples import T0

BZ2, LZ4 = Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4


class Topic(NamedTuple):
    """What one publisher sent: `data` of each message, or all of its fields, at a steady rate."""

    topic: str
    type: str
    values: Iterable[Any]
    callerid: str | None = "/talker"
    rate_hz: float = 10.0
    latching: bool = False
    start_s: float = 0.0


COUNT = Topic("/numeric_chatter", "std_msgs/Int8", [n % 128 for n in range(300)])
CHATTER = Topic("/chatter", "std_msgs/String", [f"hello {n}" for n in range(300)])


def rows(topics: Iterable[Topic]) -> list[tuple[int, int, bytes]]:
    """Time (ns), number of the topic, bytes."""
    found = []
    for number, topic in enumerate(topics):
        for i, value in enumerate(topic.values):
            fields = value if isinstance(value, dict) else {"data": value}
            at_ns = T0 + round((topic.start_s + i / topic.rate_hz) * 1e9)
            found.append((at_ns, number, decode.encode(topic.type, fields)))
    return sorted(found)


def write_bag(path: Path, *topics: Topic, compression: Writer.CompressionFormat | None = None) -> Path:
    """As `rosbag record` does it; without a callerid, as `rosbag.Bag.write` does."""
    writer = Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        connections = [
            writer.add_connection(
                topic.topic,
                topic.type.replace("/", "/msg/"),
                msgdef=decode.definition(topic.type),
                md5sum=decode.md5sum(topic.type),
                callerid=topic.callerid,
                latching=None if topic.callerid is None else int(topic.latching),
            )
            for topic in topics
        ]
        for at_ns, number, data in rows(topics):
            writer.write(connections[number], at_ns, data)
    return path


def mcap_bytes(
    *topics: Topic,
    profile: str = "ros1",
    encoding: str = "ros1",
    schema: str = "ros1msg",
    metadata: bool = True,
) -> bytes:
    """As `mcap convert` makes it of a bag: messages are numbered across channels."""
    stream = BytesIO()
    writer = McapWriter(stream)
    writer.start(profile=profile)
    channels = []
    for topic in topics:
        number = writer.register_schema(topic.type, schema, decode.definition(topic.type).encode())
        about = {"callerid": topic.callerid or "", "md5sum": decode.md5sum(topic.type)} if metadata else {}
        channels.append(writer.register_channel(topic.topic, encoding, number, about))
    for sequence, (at_ns, number, data) in enumerate(rows(topics)):
        writer.add_message(channels[number], at_ns, data, at_ns, sequence)
    writer.finish()
    return stream.getvalue()
