"""Where mirrors are kept: in a folder of the grader's user that no one else can enter, each used by one at a time.

`<cache>/grader/repositories/<sum of the address>/` holds `lock`, `mirror.git` and `state.json`. The state is written
when the mirror is complete, and its time of change says when the mirror was used last. `failure.json` is there where
the network has failed since.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from grader.files import lock, open_lock, user_folder, wait_for_lock
from grader.portable import CLOEXEC, DIRECTORY, NOFOLLOW, user_id

BYTES_MAX = 4 << 30
TIDY_EVERY_S = 30.0
UNFINISHED_S = 3600.0
_FOLDER = os.O_RDONLY | DIRECTORY | NOFOLLOW | CLOEXEC


@dataclass(frozen=True, kw_only=True)
class MirrorState:
    """`fetched_at` in seconds since 1970, before the server was asked; `listing` is what it said that it has."""

    fetched_at: float
    listing: str


@dataclass(frozen=True, kw_only=True)
class NetworkFailure:
    """That the network failed: what git said (without the address), how often it was tried, and until when."""

    at: float
    said: str
    tries: int
    timeout: bool


@dataclass(frozen=True)
class MirrorFolder:
    """The folder of one mirror."""

    folder: Path

    @property
    def mirror(self) -> Path:
        return self.folder / "mirror.git"

    # Read and written by hand: names of refs may hold bytes that are no UTF-8, which pydantic refuses.

    def state(self) -> MirrorState | None:
        """None where the mirror is not complete."""
        try:
            data = json.loads((self.folder / "state.json").read_bytes())
            found = MirrorState(fetched_at=float(data["fetched_at"]), listing=str(data["listing"]))
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return None
        return found if self.mirror.is_dir() else None

    def complete(self, state: MirrorState) -> None:
        """Say that the mirror is what the server said."""
        data = {"fetched_at": state.fetched_at, "listing": state.listing, "bytes": _size(self.mirror)}
        beside = self.folder / "state.json.new"
        beside.write_text(json.dumps(data), encoding="utf-8")
        beside.replace(self.folder / "state.json")
        (self.folder / "failure.json").unlink(missing_ok=True)

    def failure(self) -> NetworkFailure | None:
        """Return the last failure, if nothing went well since."""
        try:
            data = json.loads((self.folder / "failure.json").read_bytes())
            return NetworkFailure(
                at=float(data["at"]),
                said=str(data["said"]),
                tries=int(data["tries"]),
                timeout=bool(data["timeout"]),
            )
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return None

    def failed(self, failure: NetworkFailure) -> None:
        """Tell the next process, so that not all of them wait for a server that does not answer."""
        with suppress(OSError):
            (self.folder / "failure.json").write_text(json.dumps(asdict(failure)), encoding="utf-8")

    def used(self) -> None:
        with suppress(OSError):
            os.utime(self.folder / "state.json")

    def incomplete(self) -> None:
        (self.folder / "state.json").unlink(missing_ok=True)

    def clear(self) -> None:
        self.incomplete()
        shutil.rmtree(self.mirror, ignore_errors=True)


def cache_folder() -> Path | None:
    """Return the folder for all mirrors; None where it cannot be had for this user alone."""
    own = user_folder("cache")
    if not own.is_absolute():
        return None
    with suppress(OSError):
        own.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_own(own) and _is_own(own / "repositories"):
            return own / "repositories"
    return None


def name_of(address: str) -> str:
    """The name of the mirror of an address in which there is no password."""
    return hashlib.sha256(os.fsencode(address)).hexdigest()


@contextmanager
def locked(folder: Path) -> Iterator[MirrorFolder]:
    """The place of a mirror, when no one else uses it. Raises OSError where it cannot be had or locked."""
    descriptor = _take_lock(folder, wait=True)
    assert descriptor is not None  # noqa: S101 - waited for
    try:
        yield MirrorFolder(folder)
    finally:
        os.close(descriptor)


def tidy(folder: Path, bytes_max: int = BYTES_MAX) -> None:
    """Remove those that were used least recently, until all together are at most `bytes_max`; none that is in use."""
    known = []
    for entry in os.scandir(folder):
        with suppress(OSError, ValueError, TypeError, KeyError):
            known.append((*_used_and_size(Path(entry.path)), Path(entry.path)))
    left = sum(size for _, size, _ in known)
    for used_at, size, path in sorted(known):
        unfinished = size == 0 and used_at < time.time() - UNFINISHED_S
        if (left > bytes_max or unfinished) and _remove_unused(path):
            left -= size


class _Tidied:
    at = -TIDY_EVERY_S


def tidy_now_and_then(folder: Path) -> None:
    """Looking at all of them takes time, so not after each."""
    if time.monotonic() - _Tidied.at >= TIDY_EVERY_S:
        _Tidied.at = time.monotonic()
        with suppress(OSError):
            tidy(folder)


def _used_and_size(folder: Path) -> tuple[float, int]:
    """Of one that is not complete, the size is 0."""
    state = folder / "state.json"
    try:
        return state.stat().st_mtime, max(1, int(json.loads(state.read_bytes())["bytes"]))
    except (FileNotFoundError, ValueError):
        return folder.stat().st_mtime, 0


def _remove_unused(folder: Path) -> bool:
    """Return whether it is gone. What is in use stays."""
    with suppress(OSError):
        descriptor = _take_lock(folder, wait=False)
        if descriptor is None:
            return False
        try:
            MirrorFolder(folder).clear()
            shutil.rmtree(folder)
        finally:
            os.close(descriptor)
        return True
    return False


def _take_lock(folder: Path, *, wait: bool) -> int | None:
    """The descriptor of the lock, which may be taken away together with its folder before it is locked."""
    while True:
        with suppress(FileNotFoundError):
            folder.mkdir(mode=0o700, exist_ok=True)
            if not _is_own(folder):
                raise PermissionError(f"{folder} belongs to another user")
            descriptor = open_lock(folder / "lock")
            try:
                if wait:
                    wait_for_lock(descriptor)
                elif not lock(descriptor):
                    os.close(descriptor)
                    return None
                if os.path.samestat(os.fstat(descriptor), (folder / "lock").stat()):
                    return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)


def _is_own(folder: Path) -> bool:
    """Return whether that folder, made where it is missing, belongs to this user and is closed to everybody else."""
    folder.mkdir(mode=0o700, exist_ok=True)
    descriptor = os.open(folder, _FOLDER)
    try:
        status = os.fstat(descriptor)
        if status.st_uid != user_id():
            return False
        if stat.S_IMODE(status.st_mode) != stat.S_IRWXU:
            os.fchmod(descriptor, stat.S_IRWXU)
        return True
    finally:
        os.close(descriptor)


def _size(folder: Path) -> int:
    """The room that it takes on the disk, in bytes."""
    places = (Path(place) / name for place, _, names in os.walk(folder) for name in names)
    return sum(place.lstat().st_blocks * 512 for place in places)
