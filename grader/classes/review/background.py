"""What follows a decision, done in the background: not at each of many that come close together, but soon after."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from grader.errors import Busy, GraderError


@dataclass(frozen=True, kw_only=True)
class Pace:
    """Seconds: how long nothing has to change before the work is done, how long it waits at most, how long until it
    is tried again where it failed, and how long it waits at the end for another program that works in the folder."""

    quiet_s: float = 2.0
    latest_s: float = 8.0
    again_s: float = 3.0
    closing_s: float = 60.0


class BackgroundWriter:
    """Calls `work` in a thread of its own after `changed` was called; `trouble` says why it could not be done."""

    def __init__(self, work: Callable[[], None], pace: Pace) -> None:
        self._work, self._pace = work, pace
        self._condition = threading.Condition()
        self._first: float | None = None
        self._last = 0.0
        self._closing, self._closed_at = False, 0.0
        self._working = False
        self.trouble = ""
        self._thread = threading.Thread(target=self._run, name="review-background", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def changed(self) -> None:
        """There is something to do."""
        with self._condition:
            self._last = time.monotonic()
            self._first = self._last if self._first is None else self._first
            self._condition.notify_all()

    def wait(self, timeout_s: float) -> bool:
        """Wait until all is done; whether it is."""
        with self._condition:
            return self._condition.wait_for(lambda: self._first is None and not self._working, timeout_s)

    def close(self) -> bool:
        """Do what is left at once and end; whether all is done. What is busy in the folder is waited for."""
        with self._condition:
            self._closing, self._closed_at = True, time.monotonic()
            self._condition.notify_all()
        self._thread.join()
        return self._first is None

    def _run(self) -> None:
        while self._wait_until_due():
            is_busy = False
            try:
                self._work()
                trouble = ""
            except GraderError as error:
                trouble, is_busy = error.message, isinstance(error, Busy)
            except Exception as error:  # noqa: BLE001 - the page shows it, and it is tried again
                trouble = f"internal error: {type(error).__name__}: {error}"
            with self._condition:
                self._working = False
                self.trouble = trouble
                if trouble and self._closing:
                    self._first = self._first or time.monotonic()
                    left = self._closed_at + self._pace.closing_s - time.monotonic()
                    if not is_busy or left <= 0:
                        return
                    self._condition.wait(min(left, self._pace.again_s))
                    continue
                if trouble:
                    self._first = self._last = time.monotonic() + self._pace.again_s
                self._condition.notify_all()

    def _wait_until_due(self) -> bool:
        """Wait until the work is due; False at the end, with nothing left to do."""
        with self._condition:
            while not self._closing:
                if self._first is None:
                    self._condition.wait()
                    continue
                due = min(self._last + self._pace.quiet_s, self._first + self._pace.latest_s)
                left = due - time.monotonic()
                if left <= 0:
                    break
                self._condition.wait(left)
            if self._first is None:
                return False
            self._first, self._working = None, True
            return True
