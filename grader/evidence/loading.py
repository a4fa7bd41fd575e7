"""One pass over a container's records that gives a `Run`."""

from __future__ import annotations

from collections import defaultdict
from pathlib import PurePath
from typing import Any, BinaryIO

from mcap import records as mcap

from grader.errors import EvidenceError
from grader.evidence.channels import merged
from grader.evidence.container import ContainerError, records
from grader.evidence.events import METADATA_NAME, PACKAGE_TOPIC, TOPICS
from grader.evidence.memory_budget import Room
from grader.evidence.run import Channel, Message, Run
from grader.model.version import EVIDENCE, UPDATE

MAX_CHANNELS = 4_096
NAMES_SHOWN = 5
NAME_CHARS_SHOWN = 80
READ = {str(number) for number in range(1, EVIDENCE.version + 1)}

FIELDS = {
    "processes": "/grader/process",
    "console": "/grader/console",
    "graph": "/grader/graph",
    "params": "/grader/param",
    "host": "/grader/host",
    "actors": "/grader/actor",
    "recorder": "/grader/recorder",
    "course": "/grader/scenario",
}


class Loading:
    """Collects by channel and decodes nothing; only the grader's own JSON channels are read into records.

    `room` is what all that is loaded together may take, `shown` what messages call the file.
    """

    def __init__(self, name: str, room: Room, shown: str) -> None:
        self._name, self._shown = name, shown
        self._room = room
        self._schemas: dict[int, mcap.Schema] = {}
        self._channels: dict[int, mcap.Channel] = {}
        self._messages: dict[int, list[Message]] = defaultdict(list)
        self._attachments: dict[str, bytes] = {}
        self._metadata: dict[str, str] | None = None
        self._profile = ""

    def read(self, stream: BinaryIO) -> Run:
        """Raises EvidenceError for another format, NoRoom, and what `container.records` and pydantic raise."""
        for record in records(stream):
            if isinstance(record, mcap.Message):
                self._hold_message(record)
                self._messages[record.channel_id].append(
                    Message(record.log_time, record.sequence, record.data)
                )
            else:
                self._describe(record)
        if unknown := self._messages.keys() - self._channels.keys():
            raise ContainerError(f"messages on {len(unknown)} channels that are not there")
        for messages in self._messages.values():
            messages.sort(key=lambda message: message.log_time_ns)
        return self._run()

    def _describe(self, record: mcap.McapRecord) -> None:
        if isinstance(record, mcap.Schema):
            if record.id not in self._schemas:
                self._room.hold(len(record.data), foreign=self._metadata is None)
                self._schemas[record.id] = record
        elif isinstance(record, mcap.Channel):
            self._channels.setdefault(record.id, record)
            if len(self._channels) > MAX_CHANNELS:
                raise ContainerError(f"more than {MAX_CHANNELS} channels")
        elif isinstance(record, mcap.Attachment):
            self._attach(record)
        elif isinstance(record, mcap.Header):
            self._profile = record.profile
        elif isinstance(record, mcap.Metadata) and record.name == METADATA_NAME and self._metadata is None:
            self._metadata = record.metadata

    def _hold_message(self, message: mcap.Message) -> None:
        """The arena has limits of its own for its events."""
        channel, foreign = self._channels.get(message.channel_id), self._metadata is None
        if foreign or channel is None or channel.message_encoding != "json":
            self._room.hold(len(message.data), foreign=foreign)

    def _attach(self, record: mcap.Attachment) -> None:
        """Another tool's attachments are of no use; the grader's own come behind its metadata."""
        if self._metadata is not None:
            self._room.hold(len(record.data), foreign=False)
            self._attachments[record.name] = record.data

    def _run(self) -> Run:
        about = self._about()
        times = [t for m in self._messages.values() for t in (m[0].log_time_ns, m[-1].log_time_ns)]
        own: dict[str, Any] = {}
        if self._metadata is None:
            self._refuse_what_is_not_ros1()
        else:
            own = {name: self._events(topic) for name, topic in FIELDS.items()}
            own["package_json"] = self._package()
        return Run(
            evidence=self._name,
            metadata=self._metadata or {},
            start_ns=min(times, default=0),
            end_ns=max(times, default=0),
            channels=self._ros_channels(),
            attachments=self._attachments,
            **about,
            **own,
        )

    def _about(self) -> dict[str, Any]:
        if self._metadata is None:
            return {"scenario": PurePath(self._name).stem, "clock": "real", "warp": 1.0}
        version = self._metadata.get("format", "")[:NAME_CHARS_SHOWN]
        if newer := EVIDENCE.newer(f"{EVIDENCE.name}/{version}"):
            raise EvidenceError(f"{self._shown}: {newer}", hint=UPDATE)
        if version not in READ:
            raise EvidenceError(
                f"{self._shown}: evidence of format {version!r}, which no grader wrote",
                hint="record it again, or copy it again",
            )
        try:
            scenario, clock = self._metadata["scenario"], self._metadata["clock"]
            return {"scenario": scenario, "clock": clock, "warp": float(self._metadata["warp"])}
        except (KeyError, ValueError) as error:
            raise ContainerError("its metadata does not say scenario, clock and warp") from error

    def _refuse_what_is_not_ros1(self) -> None:
        """Of another tool's recording; channels of other encodings beside ROS 1's are left alone."""
        encodings = {channel.message_encoding for channel in self._channels.values()}
        if self._profile == "ros2" or "cdr" in encodings:
            raise EvidenceError(
                f"{self._shown}: a recording of ROS 2, and this grader reads those of ROS 1",
                hint="record again with ROS 1: `rosbag record`",
            )
        if encodings and "ros1" not in encodings:
            names = ", ".join(map(_shown, sorted(encodings)[:NAMES_SHOWN]))
            raise EvidenceError(f"{self._shown}: no message of ROS 1 in it, only {names}")
        for channel in self._channels.values():
            schema = self._schemas.get(channel.schema_id)
            if channel.message_encoding == "ros1" and (schema is None or schema.encoding != "ros1msg"):
                raise EvidenceError(
                    f"{self._shown}: {_shown(channel.topic)} has no message definition (ros1msg)"
                )

    def _ros_channels(self) -> tuple[Channel, ...]:
        found = (
            self._ros_channel(number, channel)
            for number, channel in self._channels.items()
            if channel.message_encoding == "ros1"
        )
        return merged(found, renumber=self._metadata is None)

    def _ros_channel(self, number: int, channel: mcap.Channel) -> Channel:
        schema, about = self._schemas.get(channel.schema_id), channel.metadata
        return Channel(
            topic=channel.topic,
            callerid=about.get("callerid", ""),
            type=schema.name.replace("/msg/", "/") if schema else "",
            md5sum=about.get("md5sum", ""),
            definition=schema.data.decode(errors="replace") if schema else "",
            latching=about.get("latching") in {"1", "true", "True"},
            messages=tuple(self._messages.pop(number, ())),
            room=self._room,
        )

    def _json(self, topic: str) -> list[Message]:
        """Messages on the grader's own channel; one of that name that a node published is no JSON channel."""
        found = [
            message
            for number, channel in self._channels.items()
            if channel.topic == topic and channel.message_encoding == "json" and self._described(channel)
            for message in self._messages.get(number, ())
        ]
        return sorted(found, key=lambda message: message.log_time_ns)

    def _described(self, channel: mcap.Channel) -> bool:
        schema = self._schemas.get(channel.schema_id)
        return schema is not None and schema.encoding == "jsonschema"

    def _events(self, topic: str) -> tuple[tuple[int, Any], ...]:
        read = TOPICS[topic].read_json
        return tuple((message.log_time_ns, read(message.data)) for message in self._json(topic))

    def _package(self) -> bytes | None:
        messages = self._json(PACKAGE_TOPIC)
        return messages[-1].data if messages else None


def _shown(name: str) -> str:
    """A name out of a foreign file, on one line."""
    text = name[:NAME_CHARS_SHOWN] + ("…" if len(name) > NAME_CHARS_SHOWN else "")
    return text if text.isprintable() else repr(text)
