"""Worker processes that end in order: by Ctrl-C, and when the process that started them is gone."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from multiprocessing import connection
from types import FrameType
from typing import TypeVar

SAFE_PATH = "PYTHONSAFEPATH"
LEAVE_S = 30.0  # to end its work, once the process that started it is gone
Job = TypeVar("Job")
Result = TypeVar("Result")


class _Worker:
    """What a worker process knows: whether it works, and whether it shall stop."""

    busy = False
    stopped = False


@contextmanager
def workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes. When the block is left early, what runs is interrupted and cleans up first."""
    with _safe_path():
        pool = ProcessPoolExecutor(
            max(count, 1), mp_context=multiprocessing.get_context("spawn"), initializer=_prepare
        )
        try:
            yield pool
        except BaseException:
            for child in multiprocessing.active_children():
                if child.pid is not None:
                    with suppress(ProcessLookupError):  # it has ended by itself
                        os.kill(child.pid, signal.SIGINT)
            raise
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _safe_path() -> Iterator[None]:
    """What `multiprocessing` starts looks for Python's own modules in the current folder first, which may be a
    student's; not with this variable, which Python knows since 3.11."""
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before


def side_by_side(
    pool: ProcessPoolExecutor,
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    *,
    most: int,
    begun: Callable[[Job], None] = lambda _: None,
) -> Iterator[Result]:
    """Each job's result as it comes, `most` at a time. `begun` is told of each job when it is handed over."""
    waiting = list(reversed(jobs))
    running: set[Future[Result]] = set()
    while waiting or running:
        while waiting and len(running) < most:
            job = waiting.pop()
            begun(job)
            running.add(pool.submit(work, job))
        done, running = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()


@contextmanager
def working() -> Iterator[None]:
    """In a worker: a signal in here interrupts. Raises KeyboardInterrupt where it shall stop already."""
    if _Worker.stopped:
        raise KeyboardInterrupt
    _Worker.busy = True
    try:
        yield
    finally:
        _Worker.busy = False


def _prepare() -> None:
    """Let Ctrl-C stop a worker's work in order, and an idle worker without a word."""
    signal.signal(signal.SIGINT, _stop)
    signal.signal(signal.SIGTERM, _stop)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _stop(_number: int, _frame: FrameType | None) -> None:
    _Worker.stopped = True
    if _Worker.busy:
        raise KeyboardInterrupt


def _leave_with_parent() -> None:
    """A worker whose parent was killed would wait for its next job for ever."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    connection.wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGINT)
    threading.Event().wait(LEAVE_S if _Worker.busy else 0)
    os._exit(1)
