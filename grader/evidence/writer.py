"""Write evidence files. The same calls in the same order give the same bytes."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from io import BufferedIOBase
from pathlib import Path
from types import TracebackType
from typing import IO, Any, BinaryIO, TypeAlias, cast

from mcap.writer import CompressionType, Writer
from pydantic import ValidationError
from pydantic_core import PydanticSerializationError
from typing_extensions import Self

from grader import __version__
from grader.evidence.events import EVIDENCE_VERSION, METADATA_NAME, PACKAGE_TOPIC, TOPICS
from grader.files import unwritable, writing
from grader.model.package import PackageFacts
from grader.model.record import Record

ReadableBuffer: TypeAlias = Any

JSON_SCHEMAS = "json_schemas.json"
CHUNK_BYTES = 256 * 1024
MAX_DEPTH = 32


class EvidenceChannel:
    """One publisher's messages on one topic, numbered from 0."""

    def __init__(self, mcap: Writer, number: int) -> None:
        self._mcap = mcap
        self._number = number
        self._sequence = 0

    def message(self, log_time_ns: int, data: bytes) -> None:
        """Write one message as sent, with its arrival (ns)."""
        # Twice the same time: a message of ROS 1 does not say when it was published.
        self._mcap.add_message(self._number, log_time_ns, data, log_time_ns, self._sequence)
        self._sequence += 1


class EvidenceStream:
    """Writes evidence into a binary stream, from one thread at a time. Call `finish` last."""

    def __init__(
        self, stream: IO[bytes], *, scenario: str, clock: str, warp: float, metadata: Mapping[str, str]
    ) -> None:
        self._mcap = Writer(
            stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._mcap.start(profile="ros1", library=f"ros-lab-grader {__version__}")
        own = {"format": EVIDENCE_VERSION, "scenario": scenario, "clock": clock, "warp": f"{warp:g}"}
        entries = {**metadata, **own}
        self._mcap.add_metadata(METADATA_NAME, {_text(k): _text(v) for k, v in entries.items()})
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, str, str], EvidenceChannel] = {}
        self._events: dict[str, EvidenceChannel] = {}

    def register_channel(
        self,
        *,
        topic: str,
        callerid: str,
        type: str,  # noqa: A002 - ROS's own word
        md5sum: str,
        definition: str,
        latching: bool,
    ) -> EvidenceChannel:
        """Return a publisher's channel, made on first use: it is in the file even if no message comes."""
        key = (topic, callerid, type, md5sum)
        if key in self._channels:
            return self._channels[key]
        schema = self._schema(_text(type), "ros1msg", definition.encode(errors="replace"))
        about = {"callerid": callerid, "md5sum": md5sum, "latching": "1" if latching else "0", "topic": topic}
        number = self._mcap.register_channel(
            _text(topic), "ros1", schema, {name: _text(value) for name, value in about.items()}
        )
        self._channels[key] = EvidenceChannel(self._mcap, number)
        return self._channels[key]

    def event(self, topic: str, log_time_ns: int, record: Record) -> None:
        """Write one event on the JSON channel `topic` (one of `events.TOPICS`), whose record it must be."""
        if type(record) is not TOPICS.get(topic):
            raise TypeError(f"{type(record).__name__} does not belong on {topic}")
        self._json(topic, log_time_ns, record)

    def package(self, facts: PackageFacts, log_time_ns: int) -> None:
        """Write the package facts, on `/grader/package`."""
        self._json(PACKAGE_TOPIC, log_time_ns, facts)

    def attach(self, name: str, data: bytes, log_time_ns: int, media_type: str) -> None:
        """Attach a file of the package as it was judged."""
        self._mcap.add_attachment(log_time_ns, log_time_ns, _text(name), _text(media_type), data)

    def finish(self) -> None:
        """Write what is left and the index. The stream stays open."""
        self._mcap.finish()  # type: ignore[no-untyped-call] # mcap leaves this one out

    def _json(self, topic: str, log_time_ns: int, record: Record) -> None:
        data = _encode(record)
        channel = self._events.get(topic)
        if channel is None:
            schema = self._schema(f"grader.{type(record).__name__}", "jsonschema", _json_schema(type(record)))
            number = self._mcap.register_channel(topic, "json", schema)
            channel = self._events[topic] = EvidenceChannel(self._mcap, number)
        channel.message(log_time_ns, data)

    def _schema(self, name: str, encoding: str, data: bytes) -> int:
        key = (name, encoding, data)  # a student's node may send a text of ours as its definition
        if key not in self._schemas:
            self._schemas[key] = self._mcap.register_schema(name, encoding, data)
        return self._schemas[key]


@cache
def _json_schema(record: type[Record]) -> bytes:
    """Return its JSON schema, as `make reference` has kept it: pydantic makes it slowly."""
    schemas = json.loads(Path(__file__).with_name(JSON_SCHEMAS).read_bytes())
    return json.dumps(schemas.get(record.__name__) or record.model_json_schema(), sort_keys=True).encode()


def make_json_schemas() -> str:
    """Return the file of all JSON schemas that evidence holds, by the names of their records."""
    records: tuple[type[Record], ...] = (*TOPICS.values(), PackageFacts)
    schemas = {record.__name__: record.model_json_schema() for record in records}
    return json.dumps(schemas, sort_keys=True, ensure_ascii=False) + "\n"


class EvidenceWriter(EvidenceStream):
    """An evidence file that appears whole or not at all: `with EvidenceWriter(path, …) as evidence: …`.

    It is written beside `path` as `<name>.part` and takes its name when the block ends well. Every method
    raises OutputError if the folder cannot be written, HostError if the disk fails.
    """

    def __init__(
        self, path: Path, *, scenario: str, clock: str, warp: float, metadata: Mapping[str, str]
    ) -> None:
        self._path = path
        self._part = path.with_name(path.name + ".part")
        self._file = _open(self._part)
        stream = cast("IO[bytes]", _Guarded(self._file, path))
        try:
            super().__init__(stream, scenario=scenario, clock=clock, warp=warp, metadata=metadata)
        except BaseException:
            self.abort()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()

    def close(self) -> None:
        """Finish the file and give it its name."""
        try:
            with writing(self._path):
                self.finish()
                self._file.flush()
                # On the disk before it has its name: a power cut leaves no half file under it.
                os.fsync(self._file.fileno())
                self._file.close()
                self._part.replace(self._path)
        except BaseException:
            self.abort()
            raise

    def abort(self) -> None:
        """Remove the file."""
        with suppress(OSError):  # what could not be flushed is thrown away anyway
            self._file.close()
        with suppress(OSError):
            self._part.unlink()


class _Guarded(BufferedIOBase):
    """The part of a stream that the MCAP writer uses, with errors of the machine as the grader's."""

    def __init__(self, file: BinaryIO, path: Path) -> None:
        self._file = file
        self._path = path

    def write(self, data: ReadableBuffer) -> int:
        try:
            return self._file.write(data)
        except OSError as error:
            raise unwritable(self._path, error) from error

    def tell(self) -> int:
        return self._file.tell()


def _open(part: Path) -> BinaryIO:
    with writing(part):
        part.parent.mkdir(parents=True, exist_ok=True)
        return part.open("wb")


def _text(text: str) -> str:
    """Return text that can be encoded: names from students' programs may hold anything."""
    return text.encode(errors="replace").decode()


def _encode(record: Record) -> bytes:
    """Return the record as JSON that reads back; a value that would not is converted into one that does."""
    try:
        data = record.model_dump_json().encode()
        # The only field in which students' programs may have put anything.
        if "value" in type(record).model_fields:
            type(record).model_validate_json(data)
    except (PydanticSerializationError, ValidationError, UnicodeEncodeError):
        return type(record).model_validate(_plain(record)).model_dump_json().encode()
    return data


def _plain(value: object, depth: int = 0) -> Any:  # noqa: ANN401 - JSON
    if depth > MAX_DEPTH:
        return "(nested too deeply)"
    if isinstance(value, Record):
        value = dict(value)
    if isinstance(value, dict):
        return {_text(str(key)): _plain(item, depth + 1) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, depth + 1) for item in value]
    if value is None or isinstance(value, (bool, int, float)):
        return value
    return _text(str(value))
