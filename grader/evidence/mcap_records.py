"""The records of an MCAP file in file order, within limits that a hostile file cannot pass.

mcap's own `StreamReader` limits the length of a whole record, but believes the lengths inside it: a metadata record of
20 bytes that claims a map of 4 GiB makes it read the rest of the file into memory. Here each record is cut out first.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import lru_cache
from io import BytesIO
from typing import BinaryIO, TypeAlias

import lz4.frame  # type: ignore[import-untyped] # it has no stubs
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, McapRecord, Metadata, Schema
from mcap.stream_reader import read_magic

from grader.evidence.run import Message

MAX_FILE_BYTES = 1 << 30
MAX_CHUNK_BYTES = 32 << 20
"""Of any record, too. The arena records no message that comes near it."""
MAX_UNPACKED_BYTES = 512 << 20
# A record may have no more than nine bytes, and each costs the same time.
MAX_RECORDS = 2_000_000

_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_WHOLE_HEAD = struct.Struct("<BQHIQ8x")
"""Both at once, without the time of publication, which is left out of a `Message`."""
MESSAGE_HEAD_BYTES = _MESSAGE_HEAD.size
BATCH = 1000
KEPT_BYTES = 32 << 10
_Read = Callable[[bytes], McapRecord]
Messages: TypeAlias = dict[int, list[Message]]
"""Messages by channel, in file order."""


class McapRecordError(ValueError):
    """The container breaks a limit or does not end where it says."""


def _plain(kind: type[Header | Schema | Channel | Attachment | Metadata]) -> _Read:
    return lambda body: kind.read(ReadDataStream(BytesIO(body)))


def _repeated(kind: type[Schema | Channel]) -> _Read:
    """A file has each of them twice, and many files have the same: those that are small are read once."""
    read = _plain(kind)
    known = lru_cache(maxsize=256)(read)
    return lambda body: known(body) if len(body) <= KEPT_BYTES else read(body)


_IN_CHUNK: dict[int, _Read] = {Opcode.SCHEMA: _repeated(Schema), Opcode.CHANNEL: _repeated(Channel)}
_OUTSIDE: dict[int, _Read] = {
    **_IN_CHUNK,
    Opcode.HEADER: _plain(Header),
    Opcode.ATTACHMENT: _plain(Attachment),
    Opcode.METADATA: _plain(Metadata),
}


def records(stream: BinaryIO) -> Iterator[McapRecord | Messages]:
    """Yield every record that carries content, those inside chunks included; indexes are passed over. Messages come
    many at a time, behind the schemas and channels that stand before them.

    All checksums are verified, and so is the end of the file. Raises McapRecordError, and whatever `mcap`,
    `zstandard` and `lz4` raise for a damaged file.
    """
    source, meter, known = _Source(stream), _Meter(), _OUTSIDE
    read_magic(source)
    while True:
        # Taken before the record is read: that of the data's end does not count itself.
        checksum = source.crc
        opcode, body = _next(source, meter)
        if isinstance(body, dict):
            yield body
        elif opcode == Opcode.CHUNK:
            yield from _inside(Chunk.read(ReadDataStream(BytesIO(body))), meter)
        elif opcode in known:
            yield known[opcode](body)
        elif opcode == Opcode.DATA_END:
            _verify(DataEnd.read(ReadDataStream(BytesIO(body))).data_section_crc, checksum, "the data")
            known = {}  # what comes behind it repeats records, for those who do not read the whole file
        elif opcode == Opcode.FOOTER:
            break
    read_magic(source)
    if stream.read(1):
        raise McapRecordError("bytes after its end")


class _Source(ReadDataStream):
    """A file from its beginning, and the checksum of what was read. Raises EndOfFile where it is shorter than it says.

    mcap's own does the same, and more work for each of the many small records of an index.
    """

    def __init__(self, stream: BinaryIO) -> None:
        super().__init__(stream)
        self._bytes = stream.read
        self.crc = 0

    def read(self, length: int) -> bytes:
        data = self._bytes(length)
        if len(data) < length:
            raise EndOfFile
        self.crc = zlib.crc32(data, self.crc)
        return data


class _Meter:
    """Counts over the whole file: many small records cost time, and unpacked ones need no space in it."""

    def __init__(self) -> None:
        self._records = self._unpacked_bytes = 0

    def record(self, size_bytes: int) -> None:
        self.records(1)
        if size_bytes > MAX_CHUNK_BYTES:
            raise McapRecordError(f"a record of more than {MAX_CHUNK_BYTES >> 20} MiB")

    def records(self, count: int) -> None:
        self._records += count
        if self._records > MAX_RECORDS:
            raise McapRecordError(f"more than {MAX_RECORDS} records")

    def unpacked(self, size_bytes: int) -> None:
        self._unpacked_bytes += size_bytes
        if self._unpacked_bytes > MAX_UNPACKED_BYTES:
            raise McapRecordError(f"more than {MAX_UNPACKED_BYTES >> 20} MiB unpacked")


def _next(source: _Source, meter: _Meter) -> tuple[int, bytes | Messages]:
    """Return the next record's kind and content. Nothing is read past its end, whatever lengths it holds.

    Messages, which may be many and large, are read at once.
    """
    opcode, length = _HEAD.unpack(source.read(_HEAD.size))
    meter.record(length)
    if opcode == Opcode.MESSAGE and length >= MESSAGE_HEAD_BYTES:
        channel_id, sequence, time_ns, _ = _MESSAGE_HEAD.unpack(source.read(MESSAGE_HEAD_BYTES))
        data = source.read(length - MESSAGE_HEAD_BYTES)
        return opcode, {channel_id: [Message(time_ns, sequence, data)]}
    return opcode, source.read(length)


def _inside(chunk: Chunk, meter: _Meter) -> Iterator[McapRecord | Messages]:
    """Most of a file's records are messages in chunks: they are taken from the unpacked bytes where they lie."""
    plain = _unpack(chunk)
    meter.unpacked(len(plain))
    _verify(chunk.uncompressed_crc, zlib.crc32(plain), "a chunk")
    size_bytes, at, count = len(plain), 0, 0
    padded = plain + bytes(_WHOLE_HEAD.size)  # so that the head of a message can be read of any record
    # Local names and `tuple.__new__`: this loop runs for each of up to two million records.
    read_head, new, message_op = _WHOLE_HEAD.unpack_from, tuple.__new__, int(Opcode.MESSAGE)
    head_bytes, whole_bytes = _HEAD.size, _WHOLE_HEAD.size
    messages: Messages = defaultdict(list)
    described = _IN_CHUNK.keys()
    while at < size_bytes:
        opcode, length, channel_id, sequence, time_ns = read_head(padded, at)
        begin = at
        at += head_bytes + length
        if at > size_bytes:
            # A length that no record has is told as that, and not as the end of the file.
            meter.record(length)
            raise EndOfFile
        count += 1
        if opcode == message_op and length >= MESSAGE_HEAD_BYTES:
            row = (time_ns, sequence, plain[begin + whole_bytes : at])
            messages[channel_id].append(new(Message, row))
        elif opcode in described:
            yield _IN_CHUNK[opcode](plain[begin + head_bytes : at])
        if count >= BATCH:
            meter.records(count)
            yield messages
            messages, count = defaultdict(list), 0
    meter.records(count)
    yield messages


def _verify(said: int, found: int, what: str) -> None:
    """Check the bytes against a checksum; 0 stands for none."""
    if said not in {0, found}:
        raise McapRecordError(f"the checksum of {what} is wrong")


def _unpack(chunk: Chunk) -> bytes:
    """Return a chunk's unpacked bytes, never more than the limit, whatever the chunk and the compressed data claim."""
    if chunk.uncompressed_size > MAX_CHUNK_BYTES:
        raise McapRecordError(f"a chunk of more than {MAX_CHUNK_BYTES >> 20} MiB")
    if chunk.compression == "zstd":
        # A frame may ask for a window of any size, which would be memory before a byte is unpacked.
        unpacker = zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES)
        with unpacker.stream_reader(chunk.data, read_across_frames=True) as reader:
            # One byte more shows that the chunk holds more than it says.
            plain = reader.read(chunk.uncompressed_size + 1)
    elif chunk.compression == "lz4":
        plain = lz4.frame.LZ4FrameDecompressor().decompress(
            chunk.data, max_length=chunk.uncompressed_size + 1
        )
    elif chunk.compression == "":
        plain = chunk.data
    else:
        raise McapRecordError(f"compressed by {chunk.compression[:20]!r}, which is not known")
    if len(plain) != chunk.uncompressed_size:
        raise McapRecordError("a chunk of another size than it says")
    return plain
