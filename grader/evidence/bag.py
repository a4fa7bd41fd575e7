"""ROS 1 bags, with rosbags: what `rosbag record` wrote is read as a run, and a run is exported as a bag."""

from __future__ import annotations

import bz2
import hashlib
import heapq
import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Literal, NamedTuple

import lz4.frame  # type: ignore[import-untyped] # it has no stubs
from rosbags.interfaces import Connection, ConnectionExtRosbag1
from rosbags.rosbag1 import Reader, ReaderError, Writer
from rosbags.rosbag1.reader import ChunkInfo, Header, RecordType, read_bytes, read_uint32

from grader.errors import EvidenceError, OutputError
from grader.evidence import decode
from grader.evidence.definitions import DefinitionError
from grader.evidence.events import FIELDS
from grader.evidence.mcap_records import MAX_CHUNK_BYTES, MAX_UNPACKED_BYTES
from grader.evidence.message_values import md5_of
from grader.evidence.run import (
    LESS,
    BudgetExceeded,
    Channel,
    MemoryBudget,
    Message,
    Run,
    merge_channels,
    recorded_elsewhere,
)

# By their first bytes: what a chunk's header says of its compression need not be believed.
BZ2 = b"BZh"
LZ4 = b"\x04\x22\x4d\x18"
MAX_CONNECTIONS = 4_096
MAX_CHUNKS = 100_000
MAX_RECORDS = 2_000_000
MAX_HEADER_BYTES = 1 << 20
MAX_LINE_BYTES = 64
READ_TIMES = 4
"""Reading a sound bag takes fewer bytes than its size times this."""
_LENGTH = struct.Struct("<I")
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
_REINDEX = "`rosbag reindex FILE` fixes a bag whose recording was not ended with Ctrl-C"


class BagLimitError(ValueError):
    """The bag exceeds a limit."""


def load_bag(path: Path, budget: MemoryBudget | None = None, data: bytes | None = None) -> Run:
    """Read a bag as a real-time run named after the file, without processes. `data` takes the place of what is in the
    file. Raises EvidenceError."""
    budget = budget or MemoryBudget()
    try:
        with _Reader(path, data) as reader:
            channels = _channels(reader, budget)
    except ReaderError as error:
        raise _explain(path, str(error)) from error
    except BagLimitError as error:
        raise EvidenceError(f"{path}: {error}") from error
    except BudgetExceeded as error:
        raise EvidenceError(f"{path}: {error}", hint=LESS) from error
    except (*_DAMAGE, struct.error, OSError) as error:
        raise EvidenceError(f"{path}: damaged", hint=_AGAIN) from error
    return recorded_elsewhere(path, channels)


def _explain(path: Path, reason: str) -> EvidenceError:
    """Return the error for what rosbags cannot read, in words for the owner of the bag."""
    if "not indexed" in reason:
        return EvidenceError(f"{path}: cut short: it has no index", hint=_REINDEX)
    if "version" in reason and "Bag" in reason:
        return EvidenceError(f"{path}: a bag of another format than 2.0", hint="`rosbag fix` converts it")
    if "encryption" in reason:
        return EvidenceError(f"{path}: an encrypted bag", hint="hand it in without encryption")
    if "Compression" in reason:
        return EvidenceError(f"{path}: compressed in an unknown way", hint="`rosbag decompress` unpacks it")
    return EvidenceError(f"{path}: damaged or cut short", hint=_REINDEX)


class _Reader(Reader):
    """rosbags' reader of the index, within limits: a few bytes of it can ask for any amount of work.

    Where messages lie it need not know: chunks are read from front to back, each once.
    """

    def __init__(self, path: Path, data: bytes | None) -> None:
        self.file = _File(path, data)
        super().__init__(self.file)  # type: ignore[arg-type] # as far as it is used as a path
        self._seen: set[int] = set()
        self._count = 0

    def read_connection(self) -> Connection:
        connection = super().read_connection()
        if connection.id in self._seen:
            raise ReaderError("a connection is listed twice")
        self._seen.add(connection.id)
        if len(self._seen) > MAX_CONNECTIONS:
            raise BagLimitError(f"more than {MAX_CONNECTIONS} connections")
        return connection

    def read_chunk_info(self) -> ChunkInfo:
        self._count += 1
        if self._count > MAX_CHUNKS:
            raise BagLimitError(f"more than {MAX_CHUNKS} chunks")
        assert self.bio is not None  # noqa: S101 - it is open
        place = self.bio.tell()
        if Header.read(self.bio, RecordType.CHUNK_INFO).get_uint32("count") > MAX_CONNECTIONS:
            raise BagLimitError(f"more than {MAX_CONNECTIONS} connections")
        self.bio.seek(place)
        return super().read_chunk_info()

    def read_index_data(self, pos: int, indexes: dict[int, list[object]]) -> None:  # type: ignore[override]
        """Skip it."""

    def read_chunks(self) -> Iterator[bytes]:
        """Yield the unpacked bytes of the chunks, in the order of the file."""
        unpacker = _Unpacker()
        for _, chunk in sorted(self.chunks.items()):
            yield unpacker(self.file.chunk(chunk.datapos, chunk.datasize))


class _File:
    """A file of which no more is read at once than a header may have, and no more in all than a sound bag needs."""

    def __init__(self, path: Path, data: bytes | None) -> None:
        self._path, self._data = path, data
        size_bytes = path.stat().st_size if data is None else len(data)
        # An index may lead to the same place any number of times.
        self._left_bytes = READ_TIMES * size_bytes + MAX_HEADER_BYTES

    def __str__(self) -> str:
        return str(self._path)

    def exists(self) -> bool:
        return True  # its size is known

    def open(self, mode: Literal["rb"]) -> _File:
        self._file = self._path.open(mode) if self._data is None else BytesIO(self._data)
        return self

    def close(self) -> None:
        self._file.close()

    def tell(self) -> int:
        return self._file.tell()

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(place, whence)

    def readline(self) -> bytes:
        return self._file.readline(MAX_LINE_BYTES)

    def read(self, size: int) -> bytes:
        if size > MAX_HEADER_BYTES:
            raise ReaderError("a header is too long")
        return self._read(size)

    def chunk(self, place: int, size: int) -> bytes:
        """Return the bytes of a chunk. Raises ReaderError if the file ends before."""
        if size > MAX_CHUNK_BYTES:
            raise BagLimitError(f"a chunk of more than {MAX_CHUNK_BYTES >> 20} MiB")
        self._file.seek(place)
        data = self._read(size)
        if len(data) < size:
            raise ReaderError("a chunk is cut short")
        return data

    def _read(self, size: int) -> bytes:
        data = self._file.read(size)
        self._left_bytes -= len(data)
        if self._left_bytes < 0:
            raise BagLimitError("its index leads to the same bytes again and again")
        return data


def _channels(reader: _Reader, budget: MemoryBudget) -> tuple[Channel, ...]:
    messages: dict[int, list[Message]] = {connection.id: [] for connection in reader.connections}
    count = 0
    for chunk in reader.read_chunks():
        for header, data in _records(chunk):
            count += 1
            if count > MAX_RECORDS:
                raise BagLimitError(f"more than {MAX_RECORDS} records")
            if header.get_uint8("op") == RecordType.MSGDATA:
                budget.hold(len(data), foreign=True)
                kept = messages[header.get_uint32("conn")]
                kept.append(Message(header.get_time("time"), len(kept), data))
    found = (_channel(connection, messages.pop(connection.id), budget) for connection in reader.connections)
    return merge_channels(found, renumber=True)


def _records(chunk: bytes) -> Iterator[tuple[Header, bytes]]:
    """Yield header and content of each record; only messages have content."""
    stream, size = BytesIO(chunk), len(chunk)
    while (place := stream.tell()) < size:
        if _LENGTH.unpack_from(chunk, place)[0] > MAX_HEADER_BYTES:
            raise ReaderError("a header is too long")
        header = Header.read(stream)
        length = read_uint32(stream)
        if header.get_uint8("op") == RecordType.MSGDATA:
            yield header, read_bytes(stream, length)
        else:
            stream.seek(length, os.SEEK_CUR)
            yield header, b""


class _Unpacker:
    """Unpacks chunks, to no more than the limits."""

    def __init__(self) -> None:
        self._unpacked_bytes = 0

    def __call__(self, data: bytes) -> bytes:
        if data.startswith(BZ2):
            # At most one byte more than allowed: a few bytes can unpack to gigabytes.
            plain = bz2.BZ2Decompressor().decompress(data, MAX_CHUNK_BYTES + 1)
        elif data.startswith(LZ4):
            plain = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=MAX_CHUNK_BYTES + 1)
        else:
            plain = data
        self._unpacked_bytes += len(plain)
        if len(plain) > MAX_CHUNK_BYTES:
            raise BagLimitError(f"a chunk of more than {MAX_CHUNK_BYTES >> 20} MiB")
        if self._unpacked_bytes > MAX_UNPACKED_BYTES:
            raise BagLimitError(f"more than {MAX_UNPACKED_BYTES >> 20} MiB unpacked")
        return plain


def _channel(connection: Connection, messages: list[Message], budget: MemoryBudget) -> Channel:
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
        budget=budget,
    )


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
    found = [*run.channels, *(_grader_channels(run) if everything else ())]
    channels = merge_channels((c for c in found if c.messages), renumber=False)
    if not channels:
        raise EvidenceError(f"{run.evidence}: holds no messages to export", hint="--all exports its records")
    _check_times(run, channels)
    part = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Left by an export that was killed: rosbags writes over no file.
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
    # Merged and not sorted: the messages would be in memory once more.
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


def _grader_channels(run: Run) -> Iterator[Channel]:
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
