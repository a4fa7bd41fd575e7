"""The records of an MCAP file in file order, within limits that a hostile file cannot pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO

import lz4.frame  # type: ignore[import-untyped] # it has no stubs
import zstandard
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk

MAX_FILE_BYTES = 1 << 30
MAX_CHUNK_BYTES = 64 << 20
MAX_UNPACKED_BYTES = 2 << 30


class ContainerError(ValueError):
    """The container breaks a limit or does not end where it says."""


def records(data: bytes) -> Iterator[McapRecord]:
    """Every record, those inside chunks included. All checksums are verified, and so is the end of the file.

    Raises ContainerError, and whatever `mcap`, `zstandard` and `lz4` raise for a damaged file.
    """
    stream = BytesIO(data)
    unpacked = 0
    for record in StreamReader(
        stream, emit_chunks=True, validate_crcs=True, record_size_limit=len(data)
    ).records:
        if not isinstance(record, Chunk):
            yield record
            continue
        plain = _unpacked(record)
        unpacked += len(plain)
        if unpacked > MAX_UNPACKED_BYTES:
            raise ContainerError(f"more than {MAX_UNPACKED_BYTES >> 20} MiB unpacked")
        yield from breakup_chunk(replace(record, compression="", data=plain), validate_crc=True)
    if stream.read(1):
        raise ContainerError("bytes after its end")


def _unpacked(chunk: Chunk) -> bytes:
    """Never more than the limit, whatever the chunk and the compressed data claim."""
    if chunk.uncompressed_size > MAX_CHUNK_BYTES:
        raise ContainerError(f"a chunk of more than {MAX_CHUNK_BYTES >> 20} MiB")
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data, read_across_frames=True) as reader:
            plain = reader.read(chunk.uncompressed_size + 1)
    elif chunk.compression == "lz4":
        plain = lz4.frame.LZ4FrameDecompressor().decompress(
            chunk.data, max_length=chunk.uncompressed_size + 1
        )
    elif chunk.compression == "":
        plain = chunk.data
    else:
        raise ContainerError(f"compressed by {chunk.compression!r}, which is not known")
    if len(plain) != chunk.uncompressed_size:
        raise ContainerError("a chunk of another size than it says")
    return plain
