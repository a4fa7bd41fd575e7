"""What a worker of the cluster is asked to do.

A worker's thread hands its job to a process of its own that stays for many jobs (`classes.batch.child`): the worker of
a nanny may have no children of `multiprocessing`, and whatever a grading does to its process, the worker lives on. The
scheduler imports this module too: it loads little.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import pickle
import platform
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from grader.classes.batch.job import Job, Outcome
    from grader.classes.cluster.errands import Errand, Report
    from grader.classes.cluster.exchange import Parcel
    from grader.workers import Child

WATCH_S = 1.0
LEAVE_S = 40.0
IDLE_S = 60.0
UPLOADS = 3
PAUSE_S = 2.0
INTERRUPTED = "interrupted"


async def answer(exchange: str, word: str) -> dict[str, str]:
    """Who this worker is: `host`, versions of `grader`, `python` and `pydantic`, `ros` (empty for none), and what keeps
    it from the exchange (empty for nothing)."""
    return await asyncio.to_thread(_answer, exchange, word)


def versions() -> dict[str, str]:
    """Those that must be the same everywhere."""
    import pydantic  # noqa: PLC0415 - loads little

    import grader  # noqa: PLC0415 - its version may be another one by now

    return {
        "grader": grader.__version__,
        "code": _code(),
        "python": ".".join(platform.python_version_tuple()[:2]),
        "pydantic": pydantic.VERSION,
    }


def perform(errand: bytes) -> None:
    """In a worker's thread: grade, and leave the results in the exchange.

    The client hears two events of the batch's topic: that the task was begun, and its `Report` as JSON. A task's own
    result would be lost with its worker, an event has reached the scheduler before the task is done.
    """
    from distributed import get_worker  # noqa: PLC0415 - the module loads little

    sent: Errand = pickle.loads(errand)  # noqa: S301 - from the client, whose code this worker runs anyway
    worker = get_worker()
    key = worker.get_current_task()
    worker.log_event(sent.batch, {"key": key})

    def wanted() -> bool:
        """A task whose client is gone, or wants it no more, is cancelled; its thread is left to itself."""
        task = worker.state.tasks.get(key)
        return task is not None and task.state != "cancelled"

    report = _report(sent, wanted)
    worker.log_event(sent.batch, {"key": key, "report": report.model_dump_json()})


async def dismiss(batch: str) -> None:
    """Interrupt what is done for that batch, and wait until it has cleaned up; end the processes that do nothing."""
    await asyncio.to_thread(_children.dismiss, batch)


def _code() -> str:
    """A digest of the grader's own files: two of one version may differ. In a worker, of those that it began with."""
    if _Code.digest:
        return _Code.digest
    folder = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder)
        if "_data" not in name.parts:
            digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()[:12]


class _Code:
    """What a worker remembers of it."""

    digest = ""


def _answer(exchange: str, word: str) -> dict[str, str]:
    from grader.arena.ros_env import find_ros  # noqa: PLC0415 - the module loads little
    from grader.classes.cluster.exchange import Exchange  # noqa: PLC0415 - the module loads little
    from grader.errors import GraderError  # noqa: PLC0415 - the module loads little

    _Code.digest = _code()
    ros = kept_out = ""
    with suppress(GraderError):
        found = find_ros()
        ros = found.label if found else ""
    try:
        if not Exchange(exchange).answers(word):
            kept_out = f"{exchange} is another place there"
    except (GraderError, OSError) as error:
        kept_out = getattr(error, "message", "") or f"{exchange}: {error}"
    return {**versions(), "host": socket.gethostname(), "ros": ros, "kept_out": kept_out}


def _report(sent: Errand, wanted: Callable[[], bool]) -> Report:
    from grader.classes.cluster.errands import Report, failed, is_machines  # noqa: PLC0415 - the module loads little
    from grader.errors import GraderError  # noqa: PLC0415 - the module loads little
    from grader.temporary import temporary_folder  # noqa: PLC0415 - the module loads little

    host, parcel = socket.gethostname(), None
    source = sent.job.entry.source
    if sent.seen and not os.path.lexists(source):
        message = f"{source} cannot be seen on {host}"
        hint = "submissions that are folders or archives must lie on a path that all machines share"
        return Report(outcome=failed(sent.job, kind="host", message=message, hint=hint), machine=host)
    try:
        with temporary_folder("run") as folder:
            outcome = _done(sent, folder, wanted)
            if is_machines(outcome):
                outcome = outcome.model_copy(update={"message": f"{outcome.message} (on {host})"})
            if not outcome.kept and outcome.kind != INTERRUPTED and wanted():
                parcel = _left(sent, folder)
    except (GraderError, OSError) as error:
        message = getattr(error, "message", "") or str(error)
        hint = getattr(error, "hint", "")
        outcome = failed(sent.job, kind="host", message=f"{message} (on {host})", hint=hint)
    return Report(outcome=outcome, machine=host, parcel=parcel)


def _done(sent: Errand, folder: Path, wanted: Callable[[], bool]) -> Outcome:
    job: Job = sent.job.model_copy(update={"out": folder})
    child = _children.take(sent.batch)
    try:
        with _watched(child, wanted):
            outcome = child.do(job)
    except BaseException:
        _children.give(child, usable=False)
        raise
    _children.give(child, usable=outcome.kind != INTERRUPTED)
    return outcome


def _left(sent: Errand, folder: Path) -> Parcel | None:
    """The results in the exchange, after some attempts; None where the job left none."""
    from grader.classes.cluster.exchange import (
        Exchange,
        pack,
    )
    from grader.errors import HostError  # noqa: PLC0415 - the module loads little
    from grader.intake import safe_name  # noqa: PLC0415 - the module loads little

    name = safe_name(sent.job.entry.id)
    if not (folder / name).is_dir():
        return None
    packed = folder / f"{name}.packed"
    pack(folder / name, packed)
    for _ in range(UPLOADS - 1):
        with suppress(HostError, OSError):
            return Exchange(sent.exchange).put(packed, name)
        time.sleep(PAUSE_S)
    return Exchange(sent.exchange).put(packed, name)


@contextmanager
def _watched(child: Child, wanted: Callable[[], bool]) -> Iterator[None]:
    """Interrupt the child when nobody wants its work any more."""
    done = threading.Event()

    def watch() -> None:
        while not done.wait(WATCH_S):
            if not wanted():
                child.interrupt()
                return

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


class _Children:
    """The processes of this worker, and for which batch each of them works. One that has nothing to do for a while is
    ended: its client may have been killed."""

    def __init__(self) -> None:
        self._idle: dict[Child, threading.Timer] = {}
        self._busy: dict[Child, str] = {}
        self._changed = threading.Condition()

    def take(self, batch: str) -> Child:
        from grader.workers import Child  # noqa: PLC0415 - the module loads little

        with self._changed:
            child = Child()
            if self._idle:
                child, timer = self._idle.popitem()
                timer.cancel()
            self._busy[child] = batch
            return child

    def give(self, child: Child, *, usable: bool) -> None:
        if not usable:
            child.close()
        with self._changed:
            del self._busy[child]
            if usable:
                timer = threading.Timer(IDLE_S, self._retire, (child,))
                timer.daemon = True
                self._idle[child] = timer
                timer.start()
            self._changed.notify_all()

    def dismiss(self, batch: str) -> None:
        with self._changed:
            for child in self._of(batch):
                child.interrupt()
            self._changed.wait_for(lambda: not self._of(batch), LEAVE_S)
            idle = list(self._idle)
        for child in idle:
            self._retire(child)

    def _retire(self, child: Child) -> None:
        with self._changed:
            timer = self._idle.pop(child, None)
        if timer is not None:
            timer.cancel()
            child.close()

    def _of(self, batch: str) -> list[Child]:
        return [child for child, whose in self._busy.items() if whose == batch]


_children = _Children()
