"""What a build made, read from what it left. Student code may have written it: nothing is unpacked or followed here."""

from __future__ import annotations

import os
import re
import stat
import tarfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

from grader.files import open_untrusted
from grader.model.record import Record

ELF = b"\x7fELF"
MEMBERS_MAX = 50_000
_TOO_MANY = f"what the build left is more than {MEMBERS_MAX} files"
HEADER_BYTES_MAX, HEADERS_BYTES_MAX = 64 << 10, 4 << 20
"""Of one header that goes before a file's own (a long name, say), and of all of them together."""
HEADERS_IN_A_ROW_MAX = 4
_DAMAGED = (OSError, tarfile.TarError, ValueError, OverflowError)
_PAX = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.SOLARIS_XHDTYPE)
_BEFORE_A_FILE = (*_PAX, tarfile.GNUTYPE_LONGNAME, tarfile.GNUTYPE_LONGLINK)
_ODD = re.compile(rb"[0-9]{21}|GNU\.sparse")
"""Digits that would keep tarfile's own patterns busy, and files that are made larger than they are."""


class Built(Record):
    """Names of what `rosrun` finds among what was built: all that is executable, and what a compiler made.

    `too_much`: what it had too much of, in words, so that not all of it was looked at; else "".
    """

    programs: frozenset[str] = frozenset()
    compiled: frozenset[str] = frozenset()
    too_much: str = ""


def read_archive(archive: Path, package: str) -> Built:
    """From the archive that a build in a sandbox handed over; what cannot be read holds nothing."""
    folder = f"devel/lib/{package}/"
    programs, compiled = set(), set()
    said: list[str] = []
    for tar, member in _members(archive, said.append):
        name = member.name.removeprefix(folder)
        if name == member.name or "/" in name or not member.isreg() or not member.mode & stat.S_IXUSR:
            continue
        programs.add(name)
        if _content(tar, member, len(ELF)) == ELF:
            compiled.add(name)
    return Built(programs=frozenset(programs), compiled=frozenset(compiled), too_much="".join(said))


def read_folder(devel: Path, package: str) -> Built:
    """From the folder `devel` itself, where there was no sandbox."""
    folder = devel / "lib" / package
    if any(path.is_symlink() for path in (devel, folder.parent, folder)) or not folder.is_dir():
        return Built()
    paths = list(islice(folder.iterdir(), MEMBERS_MAX + 1))
    heads = {path.name: _head(path) for path in paths[:MEMBERS_MAX]}
    return Built(
        programs=frozenset(name for name, head in heads.items() if head is not None),
        compiled=frozenset(name for name, head in heads.items() if head == ELF),
        too_much=_TOO_MANY if len(paths) > MEMBERS_MAX else "",
    )


def read_member(archive: Path, name: str, limit_bytes: int) -> bytes | None:
    """The content of one regular file of the archive, cut at the limit, or None."""
    for tar, member in _members(archive):
        if member.name == name and member.isreg():
            return _content(tar, member, limit_bytes)
    return None


def _content(tar: tarfile.TarFile, member: tarfile.TarInfo, limit_bytes: int) -> bytes | None:
    """A member's bytes, cut at the limit; None where the archive ends before they do."""
    try:
        content = tar.extractfile(member)
        return None if content is None else content.read(limit_bytes)
    except _DAMAGED:
        return None


def _members(
    archive: Path, tell: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[tarfile.TarFile, tarfile.TarInfo]]:
    """Its entries, as far as it is whole and of reasonable length; `tell` is told what is not of reasonable length."""
    try:
        with tarfile.open(archive, "r:", tarinfo=_Member) as tar:
            for number, member in enumerate(tar):
                if number >= MEMBERS_MAX:
                    tell(_TOO_MANY)
                    return
                yield tar, member
                tar.members = []  # type: ignore[attr-defined] # nobody looks back
    except _TooMuchError as error:
        tell(str(error))
    except _DAMAGED:
        return


class _TooMuchError(Exception):
    """What of an archive is too much, in words. No TarError: those, tarfile takes for the archive's end."""


class _Member(tarfile.TarInfo):
    """A header, looked at before `tarfile` believes it: it reads some into memory as a whole, one inside the other."""

    def _proc_member(self, archive: tarfile.TarFile) -> tarfile.TarInfo:
        before = self.type in _BEFORE_A_FILE
        bytes_before, in_a_row = getattr(archive, "headers", (0, 0))
        bytes_before, in_a_row = (bytes_before + self.size, in_a_row + 1) if before else (bytes_before, 0)
        archive.headers = bytes_before, in_a_row  # type: ignore[attr-defined] # counted where it is read
        if self.size < 0 or self.type == tarfile.GNUTYPE_SPARSE:
            raise _TooMuchError("what the build left holds files of a size that they do not have")
        if before and (
            self.size > HEADER_BYTES_MAX
            or bytes_before > HEADERS_BYTES_MAX
            or in_a_row > HEADERS_IN_A_ROW_MAX
        ):
            raise _TooMuchError("what the build left holds names that are far too long, or too many of them")
        if self.type in _PAX and _ODD.search(_ahead(archive, self.size)):
            raise _TooMuchError("what the build left holds headers that no tar writes")
        return super()._proc_member(archive)  # type: ignore[misc,no-any-return] # a hook that tarfile's source names


def _ahead(archive: tarfile.TarFile, size: int) -> bytes:
    """The bytes that come next, which are read again."""
    stream = archive.fileobj
    assert stream is not None  # noqa: S101 - it was opened with one
    data = stream.read(size)
    stream.seek(stream.tell() - len(data))
    return data


def _head(path: Path) -> bytes | None:
    """Return the first bytes of an executable file, None for anything else."""
    with suppress(OSError), open_untrusted(path) as file:
        return file.read(len(ELF)) if os.fstat(file.fileno()).st_mode & stat.S_IXUSR else None
    return None
