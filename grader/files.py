"""Files that appear whole or not at all, and folders that are known to be writable before anything is run."""

from __future__ import annotations

import errno
import os
import secrets
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from grader.errors import GraderError, HostError, OutputError
from grader.portable import CLOEXEC, NOFOLLOW

if sys.platform != "win32":
    import fcntl

HAS_LOCKS = sys.platform != "win32"

FULL = {
    errno.ENOSPC: "the disk is full",
    getattr(errno, "EDQUOT", errno.ENOSPC): "the disk quota is used up",
    errno.EIO: "the disk failed",
    errno.EFBIG: "files may not be that large here (ulimit -f)",
}


def atomic_write(path: Path, data: bytes) -> None:
    """Write `data` beside `path`, flush it to the disk, and rename it into place.

    A link stays a link, and what is no file (`/dev/null`, a pipe) is written to and stays what it is.
    Raises OutputError, or HostError where the disk gives out; then `path` is as it was before, and nothing is
    left beside it.
    """
    path = path.resolve() if path.is_symlink() else path
    if path.exists() and not path.is_file():
        _write_into(path, data)
        return
    beside = path.with_name(f".{path.name[:80]}.{secrets.token_hex(6)}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with beside.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise unwritable(path, error) from error
        raise


def _write_into(path: Path, data: bytes) -> None:
    try:
        with path.open("wb") as file:
            file.write(data)
    except OSError as error:
        raise unwritable(path, error) from error


def check_writable(folder: Path) -> None:
    """Raise OutputError where `folder` (which need not exist yet) cannot be written. Leaves nothing."""
    try:
        place = next(p for p in (folder, *folder.absolute().parents) if os.path.lexists(p))
        with tempfile.TemporaryFile(dir=place):  # without a name: a grader that is killed here leaves nothing
            pass
    except OSError as error:
        raise unwritable(folder, error) from error


def unwritable(path: Path, error: OSError) -> GraderError:
    """The error for what cannot be written: HostError where the disk gives out, else OutputError."""
    if error.errno in FULL:
        return HostError(
            f"cannot write {path}: {FULL[error.errno]}",
            hint="make room there, or choose another folder with --out; then grade again",
        )
    reason = error.strerror or type(error).__name__
    return OutputError(f"cannot write {path}: {reason}", hint="choose another folder with --out")


def sync_tree(folder: Path) -> None:
    """Flush everything in `folder`, and the folder itself, to the disk. Raises OSError."""
    for place, _, files in os.walk(folder, topdown=False):
        for name in files:
            sync(Path(place) / name)
        sync(Path(place))


def sync(path: Path) -> None:
    """Flush one file, or one folder's list of names, to the disk. Raises OSError."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows: what is closed is as safe there as it gets
        return
    descriptor = os.open(path, os.O_RDONLY | NOFOLLOW | CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def lock(descriptor: int, *, shared: bool = False) -> bool:
    """Lock an open file or folder until it is closed or this process ends; False where another process has it.

    Those that lock it `shared` do not keep each other out. Where the system has no such locks, nobody is kept out.

    Raises OSError where the file system knows no locks.
    """
    if sys.platform != "win32":
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def wait_for_lock(descriptor: int) -> None:
    """As `lock`, when those that hold it let it go. Raises OSError where the file system knows no locks."""
    if sys.platform != "win32":
        fcntl.flock(descriptor, fcntl.LOCK_EX)
