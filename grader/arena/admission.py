"""Who may start processes now, agreed by all graders of one user through locked files in a folder of theirs."""

from __future__ import annotations

import asyncio
import math
import os
import stat
import struct
import tempfile
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import TypeVar

from typing_extensions import Self

from grader.files import lock, open_lock

NAME = "ros-lab-grader"
MEMINFO = Path("/proc/meminfo")
CGROUP = Path("/sys/fs/cgroup")
CONTAINER = (
    (CGROUP, "memory.max", "memory.current", "inactive_file"),
    (CGROUP / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)
"""Where a container's limit stands, in control groups of version 2 and of version 1."""
UNLIMITED_BYTES = 1 << 62


def shared_folder() -> Path | None:
    """Return the user's own folder for locks, made where it is missing; None where there is none that only this user
    can write."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    places = [Path(runtime) / NAME] if runtime.startswith("/") else []
    places.append(Path(tempfile.gettempdir()) / f"{NAME}-{os.geteuid()}")
    return next((place for place in places if _is_ours(place)), None)


def _is_ours(folder: Path) -> bool:
    with suppress(OSError):  # then the next place, or none
        folder.mkdir(mode=0o700, exist_ok=True)
        about = folder.lstat()
        closed = not about.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
        return stat.S_ISDIR(about.st_mode) and about.st_uid == os.geteuid() and closed
    return False


# Locked files: shared by many or held by one, and free again when their holder ends (flock(2)).


class FileLock:
    """An open file that can be locked. Each object is a holder of its own, within one process too.

    Raises OSError where the file cannot be opened or its file system knows no locks.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = open_lock(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def take(self, *, shared: bool = False) -> bool:
        """Lock it, or change how it is locked; False, and not locked, where another lock is in the way."""
        return lock(self._descriptor, shared=shared)

    def close(self) -> None:
        """Give it free; a second time without effect."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


# How late this machine was a moment ago, as the arenas of all graders measure it: a small file that they share.

ENTRY = struct.Struct("<qd")
ENTRIES = 64
FRESH_S = 1.0


def note(path: Path, late_ms: float) -> None:
    """Write down what was just measured. Raises OSError."""
    descriptor = open_lock(path)
    try:
        # Each grader has a place of its own, as far as there are enough: nobody waits for a lock to write one number.
        place = os.getpid() % ENTRIES * ENTRY.size
        os.pwrite(descriptor, ENTRY.pack(time.monotonic_ns(), late_ms), place)
    finally:
        os.close(descriptor)


def latest_ms(path: Path) -> float:
    """Return the worst that any grader measured within the last second; 0 where none did."""
    try:
        data = path.read_bytes()[: ENTRY.size * ENTRIES]
    except FileNotFoundError:
        return 0.0
    now_ns = time.monotonic_ns()
    whole = len(data) - len(data) % ENTRY.size
    found = [late for at, late in ENTRY.iter_unpack(data[:whole]) if 0 <= now_ns - at < FRESH_S * 1e9]
    return max((late for late in found if not math.isnan(late) and late >= 0), default=0.0)


# Who may start now, and who may run alone.

T = TypeVar("T")

LOOK_S, LOOK_MOST_S = 0.02, 0.1
"""The first looks follow each other quickly. Who waits long looks less often: in a class, there are always others."""
LATE_MS = 10.0
"""For each such step that the machine is late, one start fewer at a time; one is always let in."""
RUN_BYTES = 400 << 20
"""A run is let in while so much memory is available, or when there is no other."""
START_PATIENCE_S, ALONE_PATIENCE_S, ROOM_PATIENCE_S = 300.0, 900.0, 120.0
"""After so long one goes on in any case: the holder of what is waited for has hung."""


class StartPermit:
    """Permission to start processes, given back by `release`, or with the block that asked for it."""

    def __init__(self, held: FileLock | bool) -> None:
        self._held = held

    def release(self) -> None:
        """Give it back: they have started, and others may. A second time without effect."""
        if isinstance(self._held, FileLock):
            self._held.close()


class Admission:
    """For one event loop. Starts of this object are let in in the order in which they ask.

    `folder` holds the locks (`shared_folder()`); without one, nothing is waited for.
    """

    def __init__(self, folder: Path | None, *, starts: int | None = None) -> None:
        self._folder = folder
        self._starts = starts or len(os.sched_getaffinity(0))
        # Locks of files know no order: without this one, a later start could go before an earlier one.
        self._next = asyncio.Lock()

    @asynccontextmanager
    async def run(self, *, alone: bool = False) -> AsyncIterator[None]:
        """Wait until this run may begin: side by side with others while there is memory, or `alone`.

        A run that waits to be alone goes before all that come later.
        """
        if self._folder is None:
            yield
            return
        with FileLock(self._folder / "runs") as runs:
            # The run that holds the turn alone keeps all later ones out until those that have begun are over.
            with FileLock(self._folder / "turn") as turn:
                await _until(lambda: turn.take(shared=not alone), ALONE_PATIENCE_S)
                await _until(lambda: runs.take(shared=not alone), ALONE_PATIENCE_S)
            if not alone:
                await _until(lambda: _has_room(runs), ROOM_PATIENCE_S)
            yield

    @asynccontextmanager
    async def start(self) -> AsyncIterator[StartPermit]:
        """Wait until processes may be started: one start a core at a time, fewer while the machine is late."""
        async with self._next:
            held = await _until(self._free, START_PATIENCE_S)
        permit = StartPermit(held)
        try:
            yield permit
        finally:
            permit.release()

    def note_lateness(self, late_ms: float) -> None:
        """Take note of how late an arena has just found this machine to be."""
        if self._folder is not None:
            with suppress(OSError):  # a full disk: then admission knows less
                note(self._folder / "lateness", late_ms)

    def _free(self) -> FileLock | bool:
        """Return a place to start, locked; False where all that are allowed now are taken."""
        if self._folder is None:
            return True
        for number in range(self._starts):
            place = FileLock(self._folder / f"start-{number}")
            # Who waits looks often, and mostly finds all places taken: then it need not know how late the machine is.
            if place.take() and (number == 0 or number < self._starts_allowed(self._folder)):
                return place
            place.close()
        return False

    def _starts_allowed(self, folder: Path) -> int:
        late_ms = latest_ms(folder / "lateness")
        return max(1, self._starts - int(min(late_ms, LATE_MS * self._starts) / LATE_MS))


def _has_room(runs: FileLock) -> bool:
    """Return whether a run that shares this lock finds memory, or no other run shares it. It is held if so."""
    if not runs.take(shared=True):
        return False
    if available_bytes() > RUN_BYTES:
        return True
    is_alone = runs.take()  # this lock alone is granted only where no other run shares it
    return is_alone and runs.take(shared=True)


async def _until(look: Callable[[], T], patience_s: float) -> T:
    """Return what `look` finds, as soon as it finds something; its last answer once the time is up."""
    until_s, pause_s = time.monotonic() + patience_s, LOOK_S
    while not (found := look()) and time.monotonic() < until_s:  # others' locks tell no event loop
        await asyncio.sleep(pause_s)
        pause_s = min(1.2 * pause_s, LOOK_MOST_S)
    return found


def available_bytes() -> int:
    """Return how many bytes new processes can have before the machine, or its container, begins to swap."""
    machine = read_numbers(MEMINFO).get("MemAvailable", UNLIMITED_BYTES >> 10) * 1024
    return min([machine, *(_left_bytes(*place) for place in CONTAINER)])


def _left_bytes(folder: Path, limit: str, used: str, cache: str) -> int:
    """Return how many bytes a control group can still give; its page cache counts, since the kernel frees that
    first."""
    with suppress(OSError, ValueError):  # no such group, or no limit: it says "max"
        reclaimable = read_numbers(folder / "memory.stat").get(cache, 0)
        return int((folder / limit).read_text()) - int((folder / used).read_text()) + reclaimable
    return UNLIMITED_BYTES


def read_numbers(path: Path) -> dict[str, int]:
    """Return the numbers of a kernel's file, of which each line is `name number` or `name: number`."""
    words = []
    with suppress(OSError):
        words = [line.replace(":", " ").split() for line in path.read_text().splitlines()]
    return {word[0]: int(word[1]) for word in words if len(word) > 1 and word[1].isdigit()}
