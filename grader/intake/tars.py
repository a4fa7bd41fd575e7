"""Reads tar files, packed or not."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast

from grader.errors import SubmissionError
from grader.intake.limits import Limits, too_much
from grader.intake.names import brief
from grader.intake.unpack import Unpacker

_BLOCK = tarfile.BLOCKSIZE
_CHUNK_BYTES = 1 << 20
_OPENERS: dict[bytes, Callable[[Any], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}
_PAX = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.SOLARIS_XHDTYPE)
_LONG = (tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
# A long name takes 4 KB, a file's extended attributes seldom more.
_HEADER_BYTES = 64 << 10
_RECORD = re.compile(rb"([1-9][0-9]{0,5}) ([^=\n]+)=")
_DIGITS = re.compile(rb"[0-9]{100}")


def is_packed(head: bytes) -> bool:
    """Whether a file that begins with `head` is packed by gzip, bzip2 or xz."""
    return any(head.startswith(magic) for magic in _OPENERS)


def unpack_tar(path: Path, unpacker: Unpacker, *, name: str, limits: Limits) -> None:
    """Every entry of the tar file, handed to `unpacker`. Raises tarfile.TarError for one that is cut off."""
    with (
        _plain(path, name, limits) as plain,
        tarfile.open(
            fileobj=cast("IO[bytes]", plain),
            mode="r:",
            encoding="utf-8",
            errors="surrogateescape",
            tarinfo=_Member,
        ) as archive,
    ):
        while (member := _next(archive)) is not None:
            archive.members = []  # type: ignore[attr-defined] # nobody looks back, and there may be many
            _unpack_member(archive, member, unpacker)
        plain.seek(archive.offset)
        if plain.read(_BLOCK) != bytes(_BLOCK):
            raise tarfile.ReadError("the end is missing")
        while plain.read(_CHUNK_BYTES):  # a packed one has its checksum at the end
            pass


def _next(archive: tarfile.TarFile) -> tarfile.TarInfo | None:
    """As `archive.next()`, which in Python 3.10 seeks before the beginning of a tar that holds nothing."""
    empty = archive.offset == 0 and archive.firstmember is None  # type: ignore[attr-defined]
    return None if empty else archive.next()


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
        unpacker.refuse(f"the entry '{brief(path)}' is a device or a pipe")


class _Member(tarfile.TarInfo):
    """A header, looked at before `tarfile` believes it: some are read into memory as a whole, whatever their size."""

    def _proc_member(self, archive: tarfile.TarFile) -> tarfile.TarInfo:
        if self.size < 0:
            raise tarfile.ReadError("a file of less than no bytes")
        if self.type == tarfile.GNUTYPE_SPARSE:
            raise _sparse()
        if self.type in (*_PAX, *_LONG):
            if self.size > _HEADER_BYTES:
                raise tarfile.ReadError(f"a header of {self.size} bytes")
            if self.type in _PAX:
                stream = archive.fileobj
                assert stream is not None  # noqa: S101 - it was opened with one
                data = stream.read(self.size)
                stream.seek(stream.tell() - len(data))
                _check_records(data)
        return super()._proc_member(archive)  # type: ignore[misc,no-any-return] # a hook that tarfile's source names


def _check_records(data: bytes) -> None:
    """Records as POSIX has them, `length key=value`: what is none can keep tarfile's own reading busy for hours."""
    place = 0
    while place < len(data):
        found = _RECORD.match(data, place, place + _BLOCK)
        end = place + int(found[1]) if found else 0
        if found is None or found.end() >= end or data[end - 1 : end] != b"\n":
            raise tarfile.ReadError("a header that is none")
        if found[2].startswith(b"GNU.sparse"):
            raise _sparse()
        place = end
    if _DIGITS.search(data):
        raise tarfile.ReadError("a header that is none")


def _sparse() -> SubmissionError:
    return SubmissionError(
        "the archive holds a sparse file, which is not read here", hint="Pack it anew without `--sparse`."
    )


@contextmanager
def _plain(path: Path, name: str, limits: Limits) -> Iterator[_Forward | IO[bytes]]:
    """The tar itself, unpacked as it is read where it is packed."""
    with path.open("rb") as packed:
        head = packed.read(8)
        packed.seek(0)
        opener = next((opener for magic, opener in _OPENERS.items() if head.startswith(magic)), None)
        if opener is None:
            yield packed
            return
        with opener(packed) as stream:
            yield _Forward(stream, name=name, limit_bytes=limits.stream_bytes)


class _Forward:
    """A packed stream as a file that is read once, from its front; only what a header takes can be read again."""

    def __init__(self, stream: IO[bytes], *, name: str, limit_bytes: int) -> None:
        self._stream = stream
        self._name = name
        self._limit_bytes = limit_bytes
        self._taken = 0
        self._back = 0
        self._behind = b""

    def tell(self) -> int:
        """Bytes from the front."""
        return self._taken - self._back

    def seek(self, place: int) -> None:
        """Forward by reading, back by no more than a header."""
        if place < self.tell():
            self._back = self._taken - place
            if self._back > len(self._behind):
                raise tarfile.StreamError("seeking backwards")
        while self.tell() < place and self.read(min(_CHUNK_BYTES, place - self.tell())):
            pass

    def read(self, size: int) -> bytes:
        """Up to `size` bytes. Raises SubmissionError beyond the limit."""
        again = self._behind[len(self._behind) - self._back :][:size] if self._back else b""
        self._back -= len(again)
        new = self._stream.read(size - len(again)) if len(again) < size else b""
        if new:
            self._taken += len(new)
            if self._taken > self._limit_bytes:
                raise too_much(self._name, f"is larger than {self._limit_bytes >> 20} MiB when unpacked")
            self._behind = (self._behind + new)[-2 * _HEADER_BYTES :]
        return again + new
