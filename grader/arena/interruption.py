"""Runs the arena's work so that Ctrl-C ends it in order: sessions close, processes end, then KeyboardInterrupt."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(KeyboardInterrupt):
    """The work was asked to end, by the grader itself and not by a person."""


class Stop:
    """Asks work to end in order, from any thread. What begins after that ends at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tell: Callable[[], None] | None = None
        self.asked = False

    def ask(self) -> None:
        """Return at once; the work raises Stopped when it has ended."""
        with self._lock:
            self.asked = True
            if self._tell is not None:
                self._tell()

    @contextmanager
    def heard(self, tell: Callable[[], None]) -> Iterator[None]:
        """Inside, `tell` is called when the end is asked for, and at once where it was before."""
        with self._lock:
            self._tell = tell
            if self.asked:
                tell()
        try:
            yield
        finally:
            with self._lock:
                self._tell = None


def run_until_signal(work: Coroutine[Any, Any, None], stop: Stop | None = None) -> None:
    """Run to the end, or until SIGINT, SIGTERM or `stop` cancels it; then raise KeyboardInterrupt, or Stopped."""
    stop, signals = stop or Stop(), list[int]()

    async def main() -> None:
        task, loop = asyncio.current_task(), asyncio.get_running_loop()
        assert task is not None  # noqa: S101 - this is one
        with _cancelling(loop, task, signals), stop.heard(lambda: _cancel(loop, task)):
            await work

    try:
        asyncio.run(main())
    except asyncio.CancelledError:
        raise (Stopped if stop.asked and not signals else KeyboardInterrupt) from None


async def run_together(*works: Coroutine[Any, Any, None]) -> None:
    """Run them together; when one fails or all are cancelled, return only when every one has ended in order."""
    tasks = [asyncio.ensure_future(work) for work in works]
    try:
        await asyncio.gather(*tasks)
    except asyncio.CancelledError:
        await asyncio.wait(tasks)
        raise
    except BaseException:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
        raise


def _cancel(loop: asyncio.AbstractEventLoop, task: asyncio.Task[Any]) -> None:
    loop.call_soon_threadsafe(task.cancel)


@contextmanager
def _cancelling(
    loop: asyncio.AbstractEventLoop, task: asyncio.Task[Any], signals: list[int]
) -> Iterator[None]:
    """Let SIGINT and SIGTERM cancel the task while the block runs, and note them in `signals`. They reach the main
    thread alone; in another one, its own handlers stay."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def take(number: int, _frame: object) -> None:
        signals.append(number)
        _cancel(loop, task)

    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number in SIGNALS:
            signal.signal(number, take)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
