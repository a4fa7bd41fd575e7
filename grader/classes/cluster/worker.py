"""What runs on a worker of the cluster: it says who it is, and grades one job at a time in each of its threads.

A thread hands its job to a process that stays for many jobs (`grader.workers`): whatever a grading does to its process,
the Dask worker lives on. The results go into the exchange as one file; a task returns only what became of the job.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import pickle
import platform
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pydantic

import grader
from grader.classes.batch.job import GradingJob, SubmissionOutcome, grade_job, outcome_of_ended
from grader.classes.cluster.exchange import Exchange, GradeRequest, Parcel, Report, is_machines, pack, unpack
from grader.errors import GraderError, HostError
from grader.files import temporary_folder
from grader.intake.names import safe_name
from grader.ros_env import find_ros
from grader.workers import Worker, WorkerEnded, WorkerLimits

WATCH_S = 1.0
LEAVE_S = 40.0
IDLE_S = 60.0
"""A process without a job for so long ends: its client may have been killed."""


def versions() -> dict[str, str]:
    """Return the versions that must be the same everywhere."""
    return {
        "grader": grader.__version__,
        "code": _digest_code(),
        "python": ".".join(platform.python_version_tuple()[:2]),
        "pydantic": pydantic.VERSION,
    }


async def describe(exchange: str, word: str) -> dict[str, str]:
    """Return who this worker is: its `versions`, `host`, `ros` (empty for none) and `kept_out`: what keeps it from the
    exchange (empty for nothing)."""
    return await asyncio.to_thread(_describe, exchange, word)  # Dask's own loop must not wait for a slow disk


def _describe(exchange: str, word: str) -> dict[str, str]:
    _Code.digest = _digest_code()
    ros = kept_out = ""
    with suppress(GraderError):
        found = find_ros()
        ros = found.label if found else ""
    try:
        if not Exchange(exchange).answers(word):
            kept_out = f"{exchange} is a different place there"
    except (GraderError, OSError) as error:
        kept_out = getattr(error, "message", "") or f"{exchange}: {error}"
    return {**versions(), "host": socket.gethostname(), "ros": ros, "kept_out": kept_out}


class _Code:
    """What a worker remembers of its own files."""

    digest = ""


def _digest_code() -> str:
    """Return a digest of the grader's own files: two of one version may differ. A worker's is of those it loaded."""
    if _Code.digest:
        return _Code.digest
    folder = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder)
        if "_data" not in name.parts:
            digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()[:12]


def perform(pickled: bytes) -> str:
    """Grade the `GradeRequest` in a thread of the worker, and return its `Report` as JSON. Raises HostError."""
    from distributed import get_worker  # noqa: PLC0415 - slow to load

    request: GradeRequest = pickle.loads(pickled)  # noqa: S301 - from the client, whose code this worker runs anyway
    worker = get_worker()
    key = worker.get_current_task()

    def is_wanted() -> bool:
        """A task that the client has cancelled, or whose client is gone, has a thread that runs on."""
        task = worker.state.tasks.get(key)
        return task is not None and task.state != "cancelled"

    return grade(request, is_wanted).model_dump_json()


def grade(request: GradeRequest, is_wanted: Callable[[], bool]) -> Report:
    """Grade the request's job and leave its results in the exchange. Raises HostError."""
    host, source = socket.gethostname(), request.job.entry.source
    if request.seen and not os.path.lexists(source):
        hint = "submissions that are folders or archives must lie on a path that all machines share"
        raise HostError(f"{source} cannot be seen on {host}", hint=hint)
    parcel = None
    try:
        with temporary_folder("run") as folder, _lab(request) as job:
            outcome = _grade_in(folder, request.model_copy(update={"job": job}), is_wanted)
            if is_machines(outcome):
                outcome = outcome.model_copy(update={"message": f"{outcome.message} (on {host})"})
            if not outcome.kept and outcome.kind != "interrupted" and is_wanted():
                parcel = _deliver(folder, request)
    except (GraderError, OSError) as error:
        message = getattr(error, "message", "") or str(error)
        raise HostError(f"{message} (on {host})", hint=getattr(error, "hint", "")) from error
    return Report(outcome=outcome, parcel=parcel)


@contextmanager
def _lab(request: GradeRequest) -> Iterator[GradingJob]:
    """Yield the job with its rubric where the files are that it brings along."""
    if request.lab is None:
        yield request.job
        return
    with temporary_folder("lab") as folder:
        with Exchange(request.exchange).open(request.lab) as stream:
            unpack(stream, request.lab, folder)
        rubric = request.job.rubric
        moved = rubric.model_copy(update={"path": folder / rubric.path.name})
        yield request.job.model_copy(update={"rubric": moved})


def _grade_in(folder: Path, request: GradeRequest, is_wanted: Callable[[], bool]) -> SubmissionOutcome:
    job = request.job.model_copy(update={"out": folder})
    with _processes.borrow(request.batch) as process, _interrupt_unwanted(process, is_wanted):
        try:
            return process.run(grade_job, job)
        except WorkerEnded as error:
            return outcome_of_ended(job, error)


def _deliver(folder: Path, request: GradeRequest) -> Parcel | None:
    """Put the results into the exchange; None if the job left none."""
    name = safe_name(request.job.entry.id)
    if not (folder / name).is_dir():
        return None
    packed = folder / f"{name}.packed"
    pack(folder / name, packed)
    return Exchange(request.exchange).put(packed, name)


@contextmanager
def _interrupt_unwanted(process: Worker, is_wanted: Callable[[], bool]) -> Iterator[None]:
    done = threading.Event()

    def watch() -> None:
        while not done.wait(WATCH_S):
            if not is_wanted():
                process.interrupt()
                return

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


async def dismiss(batch: str) -> None:
    """Interrupt what is graded for that batch, wait until it has cleaned up, and end the idle processes."""
    await asyncio.to_thread(_processes.dismiss, batch)


class _Processes:
    """The processes of this worker, and the batch that each of them works for."""

    def __init__(self) -> None:
        self._idle: list[Worker] = []
        self._busy: dict[Worker, str] = {}
        self._changed = threading.Condition()

    @contextmanager
    def borrow(self, batch: str) -> Iterator[Worker]:
        """A process for one job; one that was interrupted is not used again."""
        with self._changed:
            process = self._idle.pop() if self._idle else Worker(WorkerLimits(idle_s=IDLE_S))
            self._busy[process] = batch
        try:
            yield process
        finally:
            if process.stopped:
                process.close()
            with self._changed:
                del self._busy[process]
                self._idle += [] if process.stopped else [process]
                self._changed.notify_all()

    def dismiss(self, batch: str) -> None:
        with self._changed:
            for process, owner in self._busy.items():
                if owner == batch:
                    process.interrupt()
            self._changed.wait_for(lambda: batch not in self._busy.values(), LEAVE_S)
            idle, self._idle = self._idle, []
        for process in idle:
            process.close()


_processes = _Processes()
