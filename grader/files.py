"""Files: written whole or not at all, read with care where someone else wrote them, locked, and temporary folders.

Each temporary folder holds a file that its grader keeps locked: if the lock is free, that grader was killed, and the
next one removes the folder. So it is with files that were to take another one's place.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Literal, get_args

from grader.errors import GraderError, HostError, OutputError, UsageError
from grader.portable import BINARY, CLOEXEC, DIRECTORY, NOFOLLOW, READ, user_id

if sys.platform != "win32":
    import fcntl

HAS_LOCKS = sys.platform != "win32"
FILE, FOLDER = 0o600, 0o700
"""Modes of what only its owner may read, as marks."""

READ_MAX = 8 << 20

FULL = {
    errno.ENOSPC: "the disk is full",
    getattr(errno, "EDQUOT", errno.ENOSPC): "the disk quota is used up",
    errno.EIO: "the disk failed",
    errno.EFBIG: "files may not be that large here (ulimit -f)",
}


def user_folder(kind: Literal["cache", "config"]) -> Path:
    """Return the grader's folder for what it keeps of a user's, as the XDG base directory specification places it: a
    relative path does not count. It may be relative where the user has no home."""
    named = Path(os.environ.get(f"XDG_{kind.upper()}_HOME", ""))
    base = named if named.is_absolute() else Path(os.path.expanduser("~"), f".{kind}")  # noqa: PTH111 - never raises
    return base / "grader"


def atomic_write(path: Path, data: bytes, *, public: bool = False) -> None:
    """Write `data` into a file as `whole_file` does. Raises OutputError, or HostError where the disk fails."""
    with whole_file(path, public=public) as beside:
        beside.write_bytes(data)


@contextmanager
def whole_file(target: Path, *, public: bool = False) -> Iterator[Path]:
    """Open a new file beside `target`; it takes the target's place in the end, flushed to the disk.

    It is for its owner alone, whatever the umask, and so are missing folders, which are made; a `public` one is as the
    umask says. A link stays a link, and what is not a file (`/dev/stdout`, a pipe) gets a copy. Raises OutputError, or
    HostError where the disk gives out; then `target` is as it was before, and nothing is left beside it.
    """
    target = target.resolve() if target.is_symlink() else target
    special = target.exists() and not target.is_file()
    folder = Path(tempfile.gettempdir()) if special else target.parent
    with writing(target):
        make_folder(folder, public=public)
        with _new_beside(target, folder, public=public) as (beside, file):
            yield beside
            if special:
                with beside.open("rb") as source, target.open("wb") as place:
                    shutil.copyfileobj(source, place)
                return
            with beside.open("r+b") as written:  # Windows flushes no file that is open to be read
                os.fsync(written.fileno())
            if not HAS_LOCKS:  # on Windows, what is open cannot be renamed
                file.close()
            beside.replace(target)


@contextmanager
def _new_beside(target: Path, folder: Path, *, public: bool = False) -> Iterator[tuple[Path, BinaryIO]]:
    """Make a file that is to take the target's place, and remove it in the end if it has not.

    It is locked while its writer lives. What writers that were killed left for this target is removed.
    """
    prefix = f".{target.name[:60]}."  # a name may have 255 bytes, of which a letter can take four
    _sweep_beside(folder, prefix)
    for _ in range(ATTEMPTS):
        beside = folder / f"{prefix}{secrets.token_hex(6)}"
        file = new_file(beside, public=public)
        # without the lock, or the file: another writer has swept it before it was locked
        if try_lock(file.fileno()) and beside.exists():
            break
        file.close()
    try:
        with file:
            yield beside, file
    finally:
        with suppress(OSError):
            beside.unlink()


def _sweep_beside(folder: Path, prefix: str) -> None:
    if not HAS_LOCKS:  # nothing tells which writers have ended
        return
    left = re.compile(rf"{re.escape(prefix)}[0-9a-f]{{12}}")
    with suppress(OSError):  # housekeeping
        for name in filter(left.fullmatch, os.listdir(folder)):  # noqa: PTH208 - it may hold thousands
            with suppress(OSError), open_untrusted(folder / name) as file:
                if os.fstat(file.fileno()).st_uid == user_id() and lock(file.fileno()):
                    (folder / name).unlink()


def new_file(path: Path, *, public: bool = False) -> BinaryIO:
    """Create a file and open it, private to its owner unless it is `public`. Raises OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | CLOEXEC | NOFOLLOW | BINARY
    return os.fdopen(os.open(path, flags, 0o666 if public else FILE), "wb")


def make_folder(folder: Path, *, public: bool = False) -> bool:
    """Make a folder and its missing parents, private to their owner unless `public`, and return whether it is new.

    A folder that was there keeps its mode, which someone has chosen. Raises OSError."""
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
    """Make a file or folder private to its owner, where the file system has modes; a link stays as it is."""
    with suppress(OSError):
        if not path.is_symlink():
            path.chmod(FOLDER if path.is_dir() else FILE)


def read_untrusted(path: Path, limit_bytes: int = READ_MAX) -> bytes | None:
    """Return what a regular file that student code may have written begins with; None where there is none.

    It is cut at the limit: for one byte more, callers see that a file is over theirs, and say so.
    """
    try:
        with open_untrusted(path) as file:
            return file.read(limit_bytes)
    except OSError:
        return None


def open_untrusted(path: Path, *below: str) -> BinaryIO:
    """Open a regular file that others may have written, named by its folder and the names `below` it.

    No link is followed from `path` on, and no pipe waited for. Raises OSError, also for what is not a regular file.
    """
    descriptor = os.open(path, READ | NOFOLLOW | (DIRECTORY if below else 0))
    try:
        # `left` counts up to 0, at the last name: the only one that is no folder
        for left, name in enumerate(below, 1 - len(below)):
            inner = os.open(name, READ | NOFOLLOW | (DIRECTORY if left else 0), dir_fd=descriptor)
            os.close(descriptor)
            descriptor = inner
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))  # noqa: TRY301 - closed as any other
    except OSError:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def read_given(path: Path, bytes_max: int = sys.maxsize, *, hint: str = "") -> bytes | None:
    """Read a file that the user named; None where it is larger than that. Raises UsageError."""
    try:
        return path.read_bytes() if path.stat().st_size <= bytes_max else None
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}", hint=hint) from error


def check_writable(folder: Path) -> None:
    """Raise OutputError if `folder` (which need not exist yet) cannot be written. Leaves nothing behind."""
    with writing(folder):
        place = next(p for p in (folder, *folder.absolute().parents) if os.path.lexists(p))
        with tempfile.TemporaryFile(dir=place):  # without a name: a grader that is killed here leaves nothing
            pass


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raise OutputError, or HostError, where the block cannot write `path`."""
    try:
        yield
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, error: OSError) -> GraderError:
    """Return the error for what cannot be written: HostError if the disk fails, else OutputError."""
    if error.errno in FULL:
        return HostError(
            f"cannot write {path}: {FULL[error.errno]}",
            hint="make room there, or choose another folder with --out; then grade again",
        )
    reason = error.strerror or type(error).__name__
    return OutputError(f"cannot write {path}: {reason}", hint="choose another folder with --out")


def sync_tree(folder: Path) -> None:
    """Make everything in `folder` private to its owner, and flush it and the folder to the disk. Raises OSError."""
    # from below, so that a folder is flushed after all that is in it
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


def open_lock(path: Path, *, public: bool = False) -> int:
    """Return a descriptor of a file that programs lock to keep each other out, made where it is missing. Raises
    OSError."""
    flags = os.O_RDWR | os.O_CREAT | CLOEXEC | NOFOLLOW
    return os.open(path, flags, 0o666 if public else FILE)


def lock(descriptor: int, *, shared: bool = False) -> bool:
    """Lock an open file or folder until it is closed or this process ends. Return False if another process holds it.

    `shared` locks do not exclude each other. On a system without locks, nothing is excluded.

    Raises OSError if the file system has no locks.
    """
    if sys.platform != "win32":
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


def wait_for_lock(descriptor: int) -> None:
    """Wait until it can be locked, and lock it. Raises OSError if the file system has no locks."""
    if sys.platform != "win32":
        fcntl.flock(descriptor, fcntl.LOCK_EX)


MARK = ".grader"
Kind = Literal[
    "check", "download", "fetch", "gradebook", "lab", "mutants", "new", "repaired", "run", "source", "tests"
]
# mkdtemp adds eight of these characters
NAME = re.compile(rf"grader-({'|'.join(get_args(Kind))})-[a-z0-9_]{{8}}")
ATTEMPTS = 10


@contextmanager
def temporary_folder(kind: Kind, base: Path | None = None) -> Iterator[Path]:
    """Make a private folder `grader-<kind>-…` in `base` (by default where temporary files go), for the block.

    Raises HostError if it cannot be made.
    """
    place = base or Path(tempfile.gettempdir())
    sweep(place)
    folder, descriptor = _new(f"grader-{kind}-", place)
    try:
        yield folder
    finally:
        if not HAS_LOCKS:  # on Windows, what is open cannot be removed
            os.close(descriptor)
        _remove(folder)
        if HAS_LOCKS:
            os.close(descriptor)


def sweep(place: Path) -> None:
    """Remove the user's temporary folders in `place` whose graders have ended."""
    if not HAS_LOCKS:  # nothing tells which have
        return
    with suppress(OSError):  # housekeeping: what cannot be looked at is not ours
        for entry in os.scandir(place):
            if NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                _sweep(Path(entry.path))


def _sweep(folder: Path) -> None:
    with suppress(OSError):  # another grader sweeps here too, or it is someone else's
        if folder.lstat().st_uid != user_id():
            return
        # its grader was killed before it could make the mark
        if not any(folder.iterdir()):
            folder.rmdir()
            return
        descriptor = os.open(folder / MARK, READ | NOFOLLOW)
        try:
            if lock(descriptor):
                _remove(folder)
        finally:
            os.close(descriptor)


def _new(prefix: str, place: Path) -> tuple[Path, int]:
    """Return a new folder and the descriptor that locks it. One that is swept away while still empty is made again."""
    try:
        for _ in range(ATTEMPTS):
            folder = Path(tempfile.mkdtemp(prefix=prefix, dir=place))
            with suppress(FileNotFoundError):
                descriptor = os.open(folder / MARK, os.O_RDWR | os.O_CREAT | os.O_EXCL | CLOEXEC, 0o600)
                # another grader may have swept the folder between the two calls
                if try_lock(descriptor) and (folder / MARK).exists():
                    return folder, descriptor
                os.close(descriptor)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise HostError(
            f"no temporary folder can be made in {place}: {reason}",
            hint="make room there, or set TMPDIR to another folder",
        ) from error
    raise HostError(f"temporary folders in {place} do not stay", hint="set TMPDIR to another folder")


def try_lock(descriptor: int) -> bool:
    """Lock a descriptor as `lock` does; True on a file system without locks: there nothing is swept, and its users must
    not grade the same submission at once."""
    try:
        return lock(descriptor)
    except OSError:
        return True


def _remove(folder: Path) -> None:
    """Remove the folder, its mark last: so the rest of a removal that was killed is still recognised."""
    with suppress(OSError):
        for entry in list(os.scandir(folder)):
            if entry.name != MARK:
                _remove_tree(Path(entry.path))
        (folder / MARK).unlink()
        folder.rmdir()


def _remove_tree(path: Path) -> None:
    if path.is_symlink() or not path.is_dir():
        path.unlink()
        return
    shutil.rmtree(path, ignore_errors=True)
    if path.exists():
        _open_up(path)
        shutil.rmtree(path, ignore_errors=True)


def _open_up(folder: Path) -> None:
    """Make folders accessible again: a build may have removed all permissions."""
    with suppress(OSError):
        folder.chmod(0o700)
        for entry in list(os.scandir(folder)):
            if entry.is_dir(follow_symlinks=False):
                _open_up(Path(entry.path))
