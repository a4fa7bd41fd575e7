"""Reads zip files as Windows, macOS, Linux, GitHub and Python write them."""

from __future__ import annotations

import io
import re
import stat
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import IO

from grader.errors import SubmissionError
from grader.intake.names import brief
from grader.intake.unpack import Unpacker

_UNIX = (3, 19)
_UTF8_NAME = 0x800
_ENCRYPTED = 0x41
_LOCAL_HEADER_BYTES = 30
# The list of contents is read as a whole: this is room for about 50 000 entries.
_LARGEST_READ_BYTES = 6 << 20
# Of bzip2 and LZMA, zipfile unpacks whatever it has read at once: a kilobyte can become a gigabyte of memory.
_PACKINGS = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "LZMA"}
_LINK_BYTES = 1 << 12
# `git archive`, and so GitHub and GitLab, puts the commit's hash here.
_GIT_COMMENT = re.compile(rb"[0-9a-f]{40}|[0-9a-f]{64}")
_KINDS = (0, stat.S_IFREG, stat.S_IFDIR, stat.S_IFLNK)


def unpack_zip(path: Path, unpacker: Unpacker) -> None:
    """Every entry of the zip file, handed to `unpacker`."""
    with _File(path) as file, zipfile.ZipFile(file) as archive:
        by_git = _GIT_COMMENT.fullmatch(archive.comment) is not None
        _refuse_overlaps(archive.infolist(), unpacker)
        for info in archive.infolist():
            _unpack_entry(archive, info, unpacker, by_git=by_git)


class _File(io.FileIO):
    """A file of which nobody reads very much at once."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > _LARGEST_READ_BYTES:
            raise SubmissionError(
                f"{brief(Path(str(self.name)).name)} holds more files than a lab's submission may",
                hint="Hand in the package alone, without build/ and devel/.",
            )
        return super().read(size if size is not None else -1) or b""


def _refuse_overlaps(infos: list[zipfile.ZipInfo], unpacker: Unpacker) -> None:
    """One packed content that many entries share would be unpacked over and over."""
    ordered = sorted(infos, key=lambda info: info.header_offset)
    for one, two in pairwise(ordered):
        if one.header_offset + _LOCAL_HEADER_BYTES + one.compress_size > two.header_offset:
            unpacker.refuse(f"the entry '{brief(two.filename)}' lies in another one")


def _unpack_entry(
    archive: zipfile.ZipFile, info: zipfile.ZipInfo, unpacker: Unpacker, *, by_git: bool
) -> None:
    name = _entry_name(info)
    path = unpacker.admit(name, info.file_size)
    if path is None:
        return
    mode = info.external_attr >> 16 if info.create_system in _UNIX else 0
    kind = stat.S_IFMT(mode)
    if kind not in _KINDS:
        unpacker.refuse(f"the entry '{brief(path)}' is a device or a pipe")
    if name.endswith("/") or kind == stat.S_IFDIR:
        unpacker.folder(path)
        return
    if info.flag_bits & _ENCRYPTED:
        unpacker.refuse("it is protected by a password")
    if info.compress_type in _PACKINGS:
        raise NotImplementedError(f"by {_PACKINGS[info.compress_type]}")
    with archive.open(info) as content:
        if kind == stat.S_IFLNK:
            unpacker.link(path, _target(content))
        else:
            # git archive gives a mode to executable files alone.
            known = bool(mode & stat.S_IXUSR) if mode or by_git else None
            unpacker.file(path, content, executable=known)


def _target(content: IO[bytes]) -> str:
    return content.read(_LINK_BYTES).decode("utf-8", "surrogateescape")


def _entry_name(info: zipfile.ZipInfo) -> str:
    """The entry's name with `/`: old tools of Windows write `\\`, and many write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & _UTF8_NAME:
        try:
            name = name.encode("cp437").decode("utf-8")
        except UnicodeError:
            name = info.filename
    return name if info.create_system in _UNIX else name.replace("\\", "/")
