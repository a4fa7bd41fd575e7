"""Work that waits, called from where an event loop runs."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

T = TypeVar("T")


def run_aside(work: Callable[[], T], stop: Callable[[], None]) -> T:
    """What `work` gives, done here; where an event loop runs in this thread, in a thread of its own, as the work begins
    a loop too. Ctrl-C asks `stop` to end it then, and is raised when it has ended.
    """
    if not _loop_runs_here():
        return work()
    with ThreadPoolExecutor(1, thread_name_prefix="grader") as aside:
        future = aside.submit(work)
        try:
            with _interruptible():
                return future.result()
        except KeyboardInterrupt:
            stop()
            raise


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C be heard at once: asyncio hears it when its loop goes on, which is when all is done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.default_int_handler)


def _loop_runs_here() -> bool:
    if "asyncio" not in sys.modules:  # slow to load, and whoever runs a loop has it
        return False
    import asyncio  # noqa: PLC0415

    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True
