"""Files that appear whole or not at all, and folders that are known to be writable before anything is run."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from grader.errors import GraderError, HostError, OutputError
from grader.portable import BINARY, CLOEXEC, NOFOLLOW

if sys.platform != "win32":
    import fcntl

HAS_LOCKS = sys.platform != "win32"
FILE, FOLDER = 0o600, 0o700
"""Modes of what is for its owner alone: marks are."""

FULL = {
    errno.ENOSPC: "the disk is full",
    getattr(errno, "EDQUOT", errno.ENOSPC): "the disk quota is used up",
    errno.EIO: "the disk failed",
    errno.EFBIG: "files may not be that large here (ulimit -f)",
}


def atomic_write(path: Path, data: bytes, *, public: bool = False) -> None:
    """Write `data` beside `path`, flush it to the disk, and rename it into place.

    The file is for its owner alone, whatever the umask, with folders that are missing; a `public` one is as the umask
    says. A link stays a link, and what is no file (`/dev/null`, a pipe) is written to and stays what it is.
    Raises OutputError, or HostError where the disk gives out; then `path` is as it was before, and nothing is
    left beside it.
    """
    path = path.resolve() if path.is_symlink() else path
    if path.exists() and not path.is_file():
        _write_into(path, data)
        return
    beside = path.with_name(f".{path.name[:80]}.{secrets.token_hex(6)}")
    try:
        make_folder(path.parent, public=public)
        with new_file(beside, public=public) as file:
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


@contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """A new file to write to, beside `target`; it takes its place in the end, flushed to the disk.

    It is for its owner alone, whatever the umask. A link stays a link, and what is no file (`/dev/stdout`, a pipe) gets
    a copy. Raises OutputError, or HostError where the disk gives out; then `target` is as it was before, and nothing is
    left beside it.
    """
    target = target.resolve() if target.is_symlink() else target
    special = target.exists() and not target.is_file()
    folder = Path(tempfile.gettempdir()) if special else target.parent
    beside = folder / f".{target.name[:80]}.{secrets.token_hex(6)}"
    try:
        make_folder(folder)
        new_file(beside).close()
        yield beside
        _place(beside, target, special=special)
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        with suppress(OSError):
            beside.unlink()


def _place(beside: Path, target: Path, *, special: bool) -> None:
    if special:
        with beside.open("rb") as source, target.open("wb") as place:
            shutil.copyfileobj(source, place)
        return
    with beside.open("rb") as written:
        os.fsync(written.fileno())
    beside.replace(target)


def new_file(path: Path, *, public: bool = False) -> BinaryIO:
    """Open a file that is not there yet, for its owner alone unless it is `public`. Raises OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | CLOEXEC | NOFOLLOW | BINARY
    return os.fdopen(os.open(path, flags, 0o666 if public else FILE), "wb")


def make_folder(folder: Path, *, public: bool = False) -> bool:
    """Make a folder, and those above it that are missing, for their owner alone unless they are `public`; whether it is
    new. One that was there keeps its mode: who made it has decided. Raises OSError."""
    try:
        folder.mkdir(0o777 if public else FOLDER)
    except FileNotFoundError:
        make_folder(folder.parent, public=public)
        return make_folder(folder, public=public)
    except OSError:
        if not folder.is_dir():
            raise
        return False
    return True


def keep_private(path: Path) -> None:
    """Leave a file or a folder to its owner alone, where the file system knows modes; a link stays as it is."""
    with suppress(OSError):
        if not path.is_symlink():
            path.chmod(FOLDER if path.is_dir() else FILE)


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
    """Flush everything in `folder`, and the folder itself, to the disk, for its owner alone. Raises OSError."""
    for place, _, files in os.walk(folder, topdown=False):
        for path in (*(Path(place) / name for name in files), Path(place)):
            keep_private(path)
            sync(path)


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
