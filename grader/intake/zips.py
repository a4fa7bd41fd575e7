"""Reads zip files as Windows, macOS, Linux, GitHub and Python write them."""

from __future__ import annotations

import re
import stat
import zipfile
from pathlib import Path

from grader.intake.names import printable
from grader.intake.unpack import Unpacker

_UNIX = (3, 19)
_UTF8_NAME = 0x800
_ENCRYPTED = 0x1
# `git archive`, and so GitHub and GitLab, puts the commit's hash here.
_GIT_COMMENT = re.compile(rb"[0-9a-f]{40}|[0-9a-f]{64}")
_KINDS = (0, stat.S_IFREG, stat.S_IFDIR, stat.S_IFLNK)


def unpack_zip(path: Path, unpacker: Unpacker) -> None:
    """Every entry of the zip file, handed to `unpacker`."""
    with zipfile.ZipFile(path) as archive:
        by_git = _GIT_COMMENT.fullmatch(archive.comment) is not None
        for info in archive.infolist():
            _unpack_entry(archive, info, unpacker, by_git=by_git)


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
        unpacker.refuse(f"the entry {printable(path)!r} is a device or a pipe")
    if name.endswith("/") or kind == stat.S_IFDIR:
        unpacker.folder(path)
        return
    if info.flag_bits & _ENCRYPTED:
        unpacker.refuse("it is protected by a password")
    with archive.open(info) as content:
        if kind == stat.S_IFLNK:
            unpacker.link(path, content.read(1 << 16).decode("utf-8", "surrogateescape"))
        else:
            # git archive gives a mode to executable files alone.
            known = bool(mode & stat.S_IXUSR) if mode or by_git else None
            unpacker.file(path, content, executable=known)


def _entry_name(info: zipfile.ZipInfo) -> str:
    """The entry's name with `/`: old tools of Windows write `\\`, and many write UTF-8 without saying so."""
    name = info.filename
    if not info.flag_bits & _UTF8_NAME:
        try:
            name = name.encode("cp437").decode("utf-8")
        except UnicodeError:
            name = info.filename
    return name if info.create_system in _UNIX else name.replace("\\", "/")
