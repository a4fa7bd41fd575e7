"""Who may start now, and who may run alone."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import TypeVar

from grader.admission import lateness
from grader.admission.locks import FileLock
from grader.admission.memory import available_bytes

T = TypeVar("T")

LOOK_S = 0.02
LATE_MS = 10.0
"""For each such step that the machine is late, one start fewer at a time; one is always let in."""
RUN_BYTES = 400 << 20
"""A run is let in while so much memory is available, or when there is no other."""
START_PATIENCE_S, ALONE_PATIENCE_S, ROOM_PATIENCE_S = 300.0, 900.0, 120.0
"""After so long one goes on in any case: whoever holds what is waited for is not at work any more."""


class Leave:
    """Leave to start processes, given back by `release`, or with the block that asked for it."""

    def __init__(self, lock: FileLock | bool) -> None:
        self._lock = lock

    def release(self) -> None:
        """They have started: somebody else may. A second time without effect."""
        if isinstance(self._lock, FileLock):
            self._lock.close()


class Admission:
    """For one event loop. Starts of this object are let in in the order in which they ask.

    `folder` holds the locks (`shared_folder()`); without one nobody waits for anybody.
    """

    def __init__(self, folder: Path | None, *, starts: int | None = None) -> None:
        self._folder = folder
        self._starts = starts or len(os.sched_getaffinity(0))
        self._next = asyncio.Lock()

    @asynccontextmanager
    async def run(self, *, alone: bool = False) -> AsyncIterator[None]:
        """Wait until this run may begin: side by side with others while there is memory, or `alone`.

        Whoever waits to be alone is waited for by all that come later.
        """
        if self._folder is None:
            yield
            return
        with FileLock(self._folder / "runs") as runs:
            with FileLock(self._folder / "turn") as turn:
                await _until(lambda: turn.take(shared=not alone), ALONE_PATIENCE_S)
                await _until(lambda: runs.take(shared=not alone), ALONE_PATIENCE_S)
            if not alone:
                await _until(lambda: _has_room(runs), ROOM_PATIENCE_S)
            yield

    @asynccontextmanager
    async def start(self) -> AsyncIterator[Leave]:
        """Wait until processes may be started: one start a core at a time, fewer while the machine is late."""
        async with self._next:
            lock = await _until(self._free, START_PATIENCE_S)
        leave = Leave(lock)
        try:
            yield leave
        finally:
            leave.release()

    def note_lateness(self, late_ms: float) -> None:
        """What an arena has just measured on this machine."""
        if self._folder is not None:
            with suppress(OSError):  # a full disk: then admission knows less
                lateness.note(self._folder / "lateness", late_ms)

    def _free(self) -> FileLock | bool:
        """A place to start, locked; False where all that are allowed now are taken."""
        if self._folder is None:
            return True
        for number in range(self._allowed(self._folder)):
            lock = FileLock(self._folder / f"start-{number}")
            if lock.take():
                return lock
            lock.close()
        return False

    def _allowed(self, folder: Path) -> int:
        late_ms = lateness.latest_ms(folder / "lateness")
        return max(1, self._starts - int(min(late_ms, LATE_MS * self._starts) / LATE_MS))


def _has_room(runs: FileLock) -> bool:
    """Whether a run that shares this lock finds memory, or nobody else shares it. It is held if so."""
    if not runs.take(shared=True):
        return False
    return available_bytes() > RUN_BYTES or (runs.take() and runs.take(shared=True))


async def _until(look: Callable[[], T], patience_s: float) -> T:
    """What `look` finds, as soon as it finds something, or after so long."""
    until_s = time.monotonic() + patience_s
    while not (found := look()) and time.monotonic() < until_s:  # noqa: ASYNC110 - others' locks tell no event loop
        await asyncio.sleep(LOOK_S)
    return found
