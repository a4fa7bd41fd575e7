"""Gradings side by side, each in a process: they wait most of the time."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection
from pathlib import Path
from types import FrameType
from typing import Literal

from grader.errors import GraderError
from grader.model.progress import Silence
from grader.model.result import GradingResult
from grader.pipeline import GradeOptions, grade
from grader.rubric.load import load_rubric

Sandbox = Literal["auto", "require", "none"]
LEAVE_S = 30.0  # to end its grading, once the process that started it is gone


@dataclass(frozen=True, kw_only=True)
class Job:
    """One grading: the submission in `source`, as `name`, into `out/name/`. `rubric` is its file."""

    name: str
    source: Path
    rubric: Path
    out: Path
    sandbox: Sandbox = "auto"


@dataclass(frozen=True, kw_only=True)
class Graded:
    """A grading's result, or in one line why there is none."""

    name: str
    result: GradingResult | None
    error: str = ""


class _Worker:
    """What a worker process knows: whether it grades, and whether it shall stop."""

    busy = False
    stopped = False


def grade_all(jobs: Sequence[Job], side_by_side: int, begun: Callable[[str], None]) -> Iterator[Graded]:
    """Each job's result as it comes. `begun` is told each job's name when it starts."""
    waiting = list(jobs)
    with _pool(min(side_by_side, len(jobs))) as pool:
        running: set[Future[Graded]] = set()
        while waiting or running:
            while waiting and len(running) < side_by_side:
                job = waiting.pop(0)
                begun(job.name)
                running.add(pool.submit(_graded, job))
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()


@contextmanager
def _pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes. When the block is left early, what runs is interrupted and cleans up first."""
    pool = ProcessPoolExecutor(
        max(count, 1), mp_context=multiprocessing.get_context("spawn"), initializer=_prepare
    )
    try:
        yield pool
    except BaseException:
        for child in multiprocessing.active_children():
            if child.pid is not None:
                os.kill(child.pid, signal.SIGINT)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _prepare() -> None:
    """Let Ctrl-C stop a grading in order, and an idle worker without a word."""
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


def _graded(job: Job) -> Graded:
    if _Worker.stopped:
        raise KeyboardInterrupt
    options = GradeOptions(sandbox=job.sandbox, submission_id=job.name)
    _Worker.busy = True
    try:
        result = grade(str(job.source), load_rubric(str(job.rubric)), job.out, options, Silence())
    except GraderError as error:
        return Graded(name=job.name, result=None, error=error.message)
    finally:
        _Worker.busy = False
    return Graded(name=job.name, result=result)
