"""Temporary folders that are gone when their grader is: the next grader sweeps up after one that was killed.

Each holds a file that its grader keeps locked: where nobody holds the lock, nobody needs the folder.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from grader.errors import HostError
from grader.files import HAS_LOCKS, lock
from grader.portable import CLOEXEC, NOFOLLOW, READ, user_id

MARK = ".grader"
NAME = re.compile(r"grader-(source|fetch|run|check|new|mutants|tests)-[a-z0-9_]{8}")
ATTEMPTS = 10


@contextmanager
def temporary_folder(kind: str, base: Path | None = None) -> Iterator[Path]:
    """A folder `grader-<kind>-…` in `base` (by default where temporary files go), for its owner alone.

    Raises HostError where there is no room for one.
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
    """Remove those of our user's temporary folders in `place` whose graders have ended."""
    if not HAS_LOCKS:  # nothing tells which have
        return
    with suppress(OSError):  # housekeeping: what cannot be looked at is not ours
        for entry in os.scandir(place):
            if NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                _sweep(Path(entry.path))


def _sweep(folder: Path) -> None:
    with suppress(OSError):  # another grader sweeps here too, or it is somebody else's
        if folder.lstat().st_uid != user_id():
            return
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
    """A new folder and the descriptor that locks it. One that is still empty may be swept away: then another."""
    try:
        for _ in range(ATTEMPTS):
            folder = Path(tempfile.mkdtemp(prefix=prefix, dir=place))
            with suppress(FileNotFoundError):
                descriptor = os.open(folder / MARK, os.O_RDWR | os.O_CREAT | os.O_EXCL | CLOEXEC, 0o600)
                if _held(descriptor) and (folder / MARK).exists():
                    return folder, descriptor
                os.close(descriptor)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise HostError(
            f"no temporary folder can be made in {place}: {reason}",
            hint="make room there, or set TMPDIR to another folder",
        ) from error
    raise HostError(f"temporary folders in {place} do not stay", hint="set TMPDIR to another folder")


def _held(descriptor: int) -> bool:
    try:
        return lock(descriptor)
    except OSError:  # a file system without locks: there nothing is swept either
        return True


def _remove(folder: Path) -> None:
    """The mark goes last, so that what is left of a removal that was killed can be told."""
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
    """A build may close folders to everybody: what is left of them belongs to our user."""
    with suppress(OSError):
        folder.chmod(0o700)
        for entry in list(os.scandir(folder)):
            if entry.is_dir(follow_symlinks=False):
                _open_up(Path(entry.path))
