"""Reads tar files, packed or not."""

from __future__ import annotations

import bz2
import gzip
import lzma
import tarfile
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from grader.intake.limits import Limits, Meter
from grader.intake.names import printable
from grader.intake.unpack import Unpacker

_BLOCK = tarfile.BLOCKSIZE
_OPENERS: dict[bytes, Callable[[Any], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}


def is_packed(head: bytes) -> bool:
    """Whether a file that begins with `head` is packed by gzip, bzip2 or xz."""
    return any(head.startswith(magic) for magic in _OPENERS)


def unpack_tar(path: Path, unpacker: Unpacker, *, name: str, limits: Limits) -> None:
    """Every entry of the tar file, handed to `unpacker`. Raises tarfile.TarError for one that is cut off."""
    with (
        _plain(path, name, limits) as plain,
        tarfile.open(fileobj=plain, mode="r:", encoding="utf-8", errors="surrogateescape") as archive,
    ):
        for member in archive:
            _unpack_member(archive, member, unpacker)
        plain.seek(archive.offset)
        if plain.read(_BLOCK) != bytes(_BLOCK):
            raise tarfile.ReadError("the end is missing")


def _unpack_member(archive: tarfile.TarFile, member: tarfile.TarInfo, unpacker: Unpacker) -> None:
    path = unpacker.admit(member.name, member.size if member.isreg() else 0)
    if path is None:
        return
    if member.isdir():
        unpacker.folder(path)
    elif member.issym():
        unpacker.link(path, member.linkname)
    elif member.islnk():
        unpacker.hard_link(path, member.linkname)
    elif member.isreg() and (content := archive.extractfile(member)) is not None:
        unpacker.file(path, content, executable=bool(member.mode & 0o100))
    else:
        unpacker.refuse(f"the entry {printable(path)!r} is a device or a pipe")


@contextmanager
def _plain(path: Path, name: str, limits: Limits) -> Iterator[IO[bytes]]:
    """The tar itself. A packed one is unpacked as a whole first: its checksum comes at the end."""
    with path.open("rb") as packed:
        head = packed.read(8)
        packed.seek(0)
        opener = next((opener for magic, opener in _OPENERS.items() if head.startswith(magic)), None)
        if opener is None:
            yield packed
            return
        # Headers and padding come on top of the files; as much again is far beyond what those need.
        packed_bytes = path.stat().st_size
        meter = Meter(limits, name=name, packed_bytes=packed_bytes, allowance_bytes=limits.total_bytes)
        with tempfile.TemporaryFile() as plain, opener(packed) as stream:
            while block := stream.read(1 << 20):
                meter.data(len(block))
                plain.write(block)
            plain.seek(0)
            yield plain
