"""Runs the arena's work so that Ctrl-C ends it in order: sessions close, processes end, then KeyboardInterrupt."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


def run_until_signal(work: Coroutine[Any, Any, None]) -> None:
    """Run to the end, or until SIGINT or SIGTERM cancels it; then raise KeyboardInterrupt."""

    async def main() -> None:
        task = asyncio.current_task()
        with _cancelling(asyncio.get_running_loop(), task):
            await work

    try:
        asyncio.run(main())
    except asyncio.CancelledError:
        raise KeyboardInterrupt from None


async def side_by_side(*works: Coroutine[Any, Any, None]) -> None:
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


@contextmanager
def _cancelling(loop: asyncio.AbstractEventLoop, task: asyncio.Task[Any] | None) -> Iterator[None]:
    """Signals reach only the main thread; elsewhere its own handlers stay."""
    if task is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number in SIGNALS:
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(task.cancel))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
