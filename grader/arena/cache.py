"""What the grader keeps for later gradings, in a folder of its user's that nobody else can write.

No sandbox shows the folder. Whatever is wrong with it, or with a file in it, costs time and nothing else.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from pathlib import Path

from grader.errors import GraderError
from grader.files import atomic_write, open_untrusted

BYTES_MAX = 8 << 20
FILES_MAX = 8
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def read_kept(name: str) -> bytes | None:
    """What was kept under that name; None where there is none, it is damaged, or somebody else may have written it."""
    with suppress(OSError):
        if _is_private(_folder().lstat()):
            return _checked(_read(name))
    return None


def keep(name: str, data: bytes) -> None:
    """Keep it, if that can be done here. Of the files that are kept, the newest stay."""
    folder = _folder()
    with suppress(OSError, GraderError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.is_symlink() or folder.stat().st_uid != os.geteuid():
            return
        folder.chmod(0o700)
        target = folder / name
        if target.is_symlink():
            target.unlink()
        atomic_write(target, _sum(data) + data)
        files = [path for path in folder.iterdir() if stat.S_ISREG(path.lstat().st_mode)]
        files.sort(key=lambda path: path.lstat().st_mtime_ns, reverse=True)
        for old in files[FILES_MAX:]:
            old.unlink()


def _folder() -> Path:
    """As the XDG base directory specification says it: a relative path does not count."""
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (named if named.is_absolute() else Path(os.path.expanduser("~"), ".cache")) / "grader"  # noqa: PTH111 - never raises


def _is_private(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and stat.S_IMODE(status.st_mode) == stat.S_IRWXU


def _read(name: str) -> bytes:
    with open_untrusted(_folder(), name) as file:
        status = os.fstat(file.fileno())
        own = status.st_uid == os.geteuid() and not status.st_mode & _OTHERS_WRITE
        return file.read(BYTES_MAX) if own else b""


def _checked(data: bytes) -> bytes | None:
    content = data[hashlib.sha256().digest_size :]
    return content if data[: -len(content) or None] == _sum(content) else None


def _sum(data: bytes) -> bytes:
    return hashlib.sha256(data).digest()
