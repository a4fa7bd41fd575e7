"""Export evidence as a ROS 1 bag, for `rosbag` and `rqt_bag`."""

from __future__ import annotations

import hashlib
import heapq
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer

from grader.errors import EvidenceError, OutputError
from grader.evidence import decode
from grader.evidence.definitions import DefinitionError
from grader.evidence.events import FIELDS
from grader.evidence.message_values import md5_of
from grader.evidence.run import Channel, Message, Run, merge_channels

TEXT = "std_msgs/String"
GRADER = "/grader"
LATEST_NS = (1 << 32) * 1_000_000_000 - 1


class Row(NamedTuple):
    """A message's place in the bag; equal times keep the order of the channels."""

    time_ns: int
    channel: int
    number: int
    data: bytes


def export_bag(run: Run, path: Path, *, everything: bool = False) -> int:
    """Write a run's messages as the bag `path`, whole or not at all, and return how many there are.

    Publisher, latching, definition, MD5 sum and time stay what they were. With `everything`, the grader's own records
    come along as JSON in std_msgs/String on their topics. Raises EvidenceError where there is nothing to write or a
    message that no bag can hold, OutputError where the bag cannot be written.
    """
    found = [*run.channels, *(_records(run) if everything else ())]
    channels = merge_channels((c for c in found if c.messages), renumber=False)
    if not channels:
        raise EvidenceError(
            f"{run.evidence}: holds no messages to export", hint="--all exports its records too"
        )
    _check_times(run, channels)
    part = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.unlink(missing_ok=True)
        with Writer(part) as writer:
            count = _write(writer, channels)
        part.replace(path)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise OutputError(f"cannot write {path}: {reason}", hint="choose another place with --out") from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    return count


def _write(writer: Writer, channels: Sequence[Channel]) -> int:
    connections = [_connection(writer, channel) for channel in channels]
    count = 0
    for row in heapq.merge(*(_rows(number, channel.messages) for number, channel in enumerate(channels))):
        writer.write(connections[row.channel], row.time_ns, row.data)
        count += 1
    return count


def _rows(number: int, messages: Iterable[Message]) -> Iterator[Row]:
    return (Row(m.log_time_ns, number, i, m.data) for i, m in enumerate(messages))


def _connection(writer: Writer, channel: Channel) -> Connection:
    package, _, name = channel.type.partition("/")
    return writer.add_connection(
        channel.topic,
        f"{package}/msg/{name}",
        msgdef=channel.definition,
        md5sum=channel.md5sum or _md5sum(channel),
        callerid=channel.callerid or None,
        latching=int(channel.latching),
    )


def _md5sum(channel: Channel) -> str:
    """Return the MD5 sum of the definition, if the recording lacks it; of its text, if it cannot be parsed."""
    try:
        return md5_of(channel.type, channel.definition)
    except DefinitionError:
        return hashlib.md5(channel.definition.encode(), usedforsecurity=False).hexdigest()


def _check_times(run: Run, channels: Sequence[Channel]) -> None:
    """Raise EvidenceError for times that do not fit: a bag holds seconds in 32 bits."""
    times = [t for c in channels for t in (c.messages[0].log_time_ns, c.messages[-1].log_time_ns)]
    if min(times) < 0 or max(times) > LATEST_NS:
        raise EvidenceError(f"{run.evidence}: its times do not fit into a bag (1970 to 2106)")


def _records(run: Run) -> Iterator[Channel]:
    """Yield the grader's own records as channels of text, one for each kind."""
    for field, topic in FIELDS.items():
        texts = [(time_ns, event.model_dump_json()) for time_ns, event in getattr(run, field)]
        if texts:
            yield _text_channel(topic, texts)
    if run.package_json is not None:
        yield _text_channel("/grader/package", [(run.start_ns, run.package_json.decode(errors="replace"))])


def _text_channel(topic: str, texts: list[tuple[int, str]]) -> Channel:
    messages = tuple(
        Message(time_ns, number, decode.encode(TEXT, {"data": text}))
        for number, (time_ns, text) in enumerate(texts)
    )
    return Channel(
        topic=topic,
        callerid=GRADER,
        type=TEXT,
        md5sum=decode.md5sum(TEXT),
        definition=decode.definition(TEXT),
        latching=False,
        messages=messages,
    )
