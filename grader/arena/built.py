"""What a build made, read from what it left. Student code may have written it: nothing is unpacked or followed here."""

from __future__ import annotations

import os
import stat
import tarfile
from collections.abc import Iterator
from pathlib import Path

from grader.model.record import Record

ELF = b"\x7fELF"
MEMBERS_MAX = 50_000
_DAMAGED = (OSError, tarfile.TarError, ValueError, OverflowError)


class Built(Record):
    """Names of what `rosrun` finds among what was built: all that is executable, and what a compiler made."""

    programs: frozenset[str] = frozenset()
    compiled: frozenset[str] = frozenset()


def read_archive(archive: Path, package: str) -> Built:
    """From the archive that a build in a sandbox handed over; what cannot be read holds nothing."""
    folder = f"devel/lib/{package}/"
    programs, compiled = set(), set()
    for tar, member in _members(archive):
        name = member.name.removeprefix(folder)
        if name == member.name or "/" in name or not member.isreg() or not member.mode & stat.S_IXUSR:
            continue
        programs.add(name)
        if _content(tar, member, len(ELF)) == ELF:
            compiled.add(name)
    return Built(programs=frozenset(programs), compiled=frozenset(compiled))


def read_folder(devel: Path, package: str) -> Built:
    """From the folder `devel` itself, where there was no sandbox."""
    folder = devel / "lib" / package
    if any(path.is_symlink() for path in (devel, folder.parent, folder)) or not folder.is_dir():
        return Built()
    heads = {path.name: _head(path) for path in folder.iterdir()}
    return Built(
        programs=frozenset(name for name, head in heads.items() if head is not None),
        compiled=frozenset(name for name, head in heads.items() if head == ELF),
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


def _members(archive: Path) -> Iterator[tuple[tarfile.TarFile, tarfile.TarInfo]]:
    """Its entries, as far as it is whole and of reasonable length."""
    try:
        with tarfile.open(archive, "r:") as tar:
            for number, member in enumerate(tar):
                if number >= MEMBERS_MAX:
                    return
                yield tar, member
    except _DAMAGED:
        return


def _head(path: Path) -> bytes | None:
    """The first bytes of an executable file, None for anything else: no link is followed, no pipe waited for."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return None
    with os.fdopen(descriptor, "rb") as file:
        mode = os.fstat(descriptor).st_mode
        return file.read(len(ELF)) if stat.S_ISREG(mode) and mode & stat.S_IXUSR else None
