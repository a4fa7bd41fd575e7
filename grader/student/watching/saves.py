"""Tells of saved files. The system says which; where it cannot, the folders are looked at again and again.

WATCHFILES_FORCE_POLLING=1 is for network folders: of what another machine saves there, the system knows nothing.
"""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Protocol

from typing_extensions import Self
from watchfiles import Change, watch

from grader.arena.asynchronous import Stop
from grader.student.watching.ignored import ignored

STEP_MS = 150
DEBOUNCE_MS = 1200
"""Saves that come within a step of each other are one, so long at most."""
TICK_MS = 2000
"""So often somebody looks, even where nothing was told: not everything is."""
POLL_MS = 400


class Saves(Protocol):
    """What a loop needs to know of saved files."""

    def follow(self, places: Sequence[Path], without: Path | None) -> None:
        """From now on, tell of what is saved in these folders, not of what is below them or in `without`."""

    def wait(self, timeout_s: float | None = None) -> frozenset[str]:
        """The paths of what was saved since it was last asked, as soon as there is any; nothing, after a while."""

    def stopping(self, stop: Stop) -> AbstractContextManager[None]:
        """A context in which whatever is saved asks `stop`."""


class WatchedFolders:
    """Use as a context: a thread looks until it is left."""

    def __init__(self) -> None:
        self._queue: queue.Queue[frozenset[str]] = queue.Queue()
        self._lock = threading.Lock()
        self._stop: Stop | None = None
        self._places: tuple[tuple[Path, int], ...] = ()
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._leave()

    def follow(self, places: Sequence[Path], without: Path | None) -> None:
        """See `Saves`. Folders that are gone again are left out."""
        there = tuple(_there(places))
        if there == self._places and self._thread is not None and self._thread.is_alive():
            return
        self._leave()
        self._places, self._end = there, threading.Event()
        self._thread = threading.Thread(
            target=self._look, args=([p for p, _ in there], without, self._end), daemon=True
        )
        self._thread.start()

    def wait(self, timeout_s: float | None = None) -> frozenset[str]:
        """See `Saves`. With `timeout_s` 0, what is known already."""
        found: set[str] = set()
        with suppress(queue.Empty):
            found |= self._queue.get(timeout=timeout_s) if timeout_s != 0 else self._queue.get_nowait()
            while True:
                found |= self._queue.get_nowait()
        return frozenset(found)

    @contextmanager
    def stopping(self, stop: Stop) -> Iterator[None]:
        """See `Saves`."""
        with self._lock:
            self._stop = stop
            if any(self._queue.queue):
                stop.ask()
        try:
            yield
        finally:
            with self._lock:
                self._stop = None

    def _look(self, places: list[Path], without: Path | None, end: threading.Event) -> None:
        """In the thread. A system that can follow no more folders has them looked at again and again."""
        for polling in (None, True):
            with suppress(OSError, RuntimeError):
                for changes in watch(
                    *places,
                    watch_filter=None,
                    step=STEP_MS,
                    debounce=DEBOUNCE_MS,
                    rust_timeout=TICK_MS,
                    yield_on_timeout=True,
                    stop_event=end,
                    raise_interrupt=False,
                    recursive=False,
                    force_polling=polling,
                    poll_delay_ms=POLL_MS,
                    ignore_permission_denied=True,
                ):
                    self._told(frozenset(_of_interest(changes, places, without)))
                return
        self._told(frozenset())

    def _told(self, paths: frozenset[str]) -> None:
        with self._lock:
            self._queue.put(paths)
            if paths and self._stop is not None:
                self._stop.ask()

    def _leave(self) -> None:
        self._end.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


def _there(places: Iterable[Path]) -> Iterator[tuple[Path, int]]:
    """A folder that was replaced by another one of its name is another one."""
    for place in places:
        with suppress(OSError):
            yield place, place.stat().st_ino


def _of_interest(changes: set[tuple[Change, str]], places: list[Path], without: Path | None) -> Iterator[str]:
    """A folder is told of when it comes or goes; what is in it is told of by itself."""
    root = Path(os.path.commonpath(places))
    for change, name in changes:
        path = Path(name)
        if without is not None and path.is_relative_to(without):
            continue
        if change is Change.modified and path.is_dir():
            continue
        if path.is_relative_to(root) and ignored(path.relative_to(root).as_posix()):
            continue
        yield name
