"""Mirrors are brought up to date ahead of those who grade, in the roster's order."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from grader.classes.fetching.cache import cache_folder, locked, tidy_now_and_then
from grader.classes.fetching.mirror import FetchRequest, GivenUp, Patience, bring_up_to_date, place_name
from grader.classes.fetching.obtain import source_of
from grader.errors import GraderError
from grader.files import temporary_folder
from grader.intake.git import GitFailed
from grader.model.batch import Entry

STOP_S = 0.5


class Prefetch:
    """How far it came: `fetched` mirrors are up to date, `failed` are not (those who grade will say why)."""

    def __init__(self, entries: Iterable[Entry], since: float, patience: Patience) -> None:
        self.fetched = 0
        self.failed = 0
        self._entries = iter(entries)
        self._since = since
        self._patience = replace(patience, sleep=self._sleep)
        self._sleeping = patience.sleep
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self, threads: int, room: Path) -> None:
        for number in range(max(1, threads)):
            own = room / str(number)
            own.mkdir()
            # Whoever is interrupted does not wait for a server: git ends with the thread that started it.
            thread = threading.Thread(target=self._work, args=(own,), name="prefetch", daemon=True)
            thread.start()
            self._threads.append(thread)

    def wait(self, timeout_s: float | None = None) -> bool:
        """Return whether all entries were looked at within that time."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        for thread in self._threads:
            thread.join(None if deadline is None else max(0.0, deadline - time.monotonic()))
        return not any(thread.is_alive() for thread in self._threads)

    def stop(self) -> None:
        """Begin nothing more, and wait a moment for what has begun."""
        self._stopped.set()
        self.wait(STOP_S)

    def _sleep(self, seconds: float) -> None:
        self._sleeping(seconds)
        if self._stopped.is_set():
            raise InterruptedError

    def _work(self, room: Path) -> None:
        while not self._stopped.is_set():
            with self._lock:
                entry = next(self._entries, None)
            if entry is None:
                return
            good: bool | None = False
            with suppress(Exception):  # whatever it is, those who grade meet it again and say so
                good = self._fetch(entry, room)
            with self._lock:
                self.fetched += good is True
                self.failed += good is False

    def _fetch(self, entry: Entry, room: Path) -> bool | None:
        """Return whether the mirror is up to date; None where none is needed, or none can be kept."""
        source = source_of(entry)
        folder = cache_folder() if source.remote else None
        if folder is None:
            return None
        tidy_now_and_then(folder)
        request = FetchRequest(source=source, since=self._since, patience=self._patience)
        try:
            with locked(folder / place_name(source)) as place:
                bring_up_to_date(place, request, room)
        except (GraderError, GitFailed, GivenUp, OSError):
            return False
        return True


@contextmanager
def prefetch(
    entries: Iterable[Entry],
    *,
    threads: int = 8,
    fetched_since: float = 0.0,
    patience: Patience | None = None,
) -> Iterator[Prefetch]:
    """While the block runs, the mirrors of the remote repositories among `entries` are fetched, in their order.

    What was fetched after `fetched_since` (seconds since 1970; 0 is now) is not fetched again. It never raises for
    what it could not fetch, and nothing of it holds up the end of the block.
    """
    work = Prefetch(entries, fetched_since or time.time(), patience or Patience())
    with temporary_folder("source") as room:
        work.start(threads, room)
        try:
            yield work
        finally:
            work.stop()
