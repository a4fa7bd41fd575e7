"""What runs on a worker of the cluster: it says who it is, and grades one job at a time in each of its threads.

A thread hands its job to a process that stays for many jobs (`grader.workers`): whatever a grading does to its process,
the Dask worker lives on. The results go into the exchange as one file; a task returns only what became of the job.

The exchange is a folder that worker and client reach: a path or any fsspec URL. Nothing in a packed file is trusted.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import pickle
import platform
import secrets
import socket
import tarfile
import threading
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, cast
from urllib.parse import urlsplit

import pydantic

import grader
from grader.classes.batch.job import GradingJob, SubmissionOutcome, grade_job, outcome_of_ended
from grader.errors import GraderError, HostError, UsageError, blame
from grader.files import make_folder, temporary_folder
from grader.intake.names import safe_name
from grader.intake.tree import file_digest
from grader.model.record import Record
from grader.ros_env import find_ros
from grader.workers import Worker, WorkerEnded, WorkerLimits

TOKEN_BYTES = 8
CHUNK_BYTES = 1 << 20
PACKED_BYTES = 1 << 30
UNPACKED_BYTES = 2 << 30
ENTRIES = 10_000
LEVEL = 1  # evidence is compressed already
OWN_MEMORY = ("memory", "local+memory")
HELLO = "hello"


class PackedFolder(Record):
    """A packed folder in the exchange, under `name`: its size in bytes and the sha256 of its bytes."""

    name: str
    size: int
    sha256: str


class GradeRequest(Record):
    """A job on its way to a worker. `exchange` is the URL for its results, `batch` names the client's batch.

    `seen`: the job's source is a path that the client sees. `lab`: the rubric with the files that it brings along, if
    any, in the exchange too.
    """

    job: GradingJob
    exchange: str
    batch: str
    seen: bool
    lab: PackedFolder | None = None


class Report(Record):
    """What became of a request. Without a `packed` there are no results to put into place."""

    outcome: SubmissionOutcome
    packed: PackedFolder | None = None


def is_machines(outcome: SubmissionOutcome) -> bool:
    """Return whether it is an error that is not the submission's."""
    return outcome.status == "error" and blame(outcome.kind) != "submission"


class Exchange:
    """The folder at `url`. Each machine reaches it with credentials of its own.

    What cannot be read or written raises HostError, or FileNotFoundError for a packed folder that is not there.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")

    def make(self) -> None:
        """Make the folder, without what an earlier batch left there."""
        self.remove()
        with self._open("written") as (files, root):
            if "://" in self.url:
                files.makedirs(root, exist_ok=True)
            elif not make_folder(Path(root)):
                raise FileExistsError("another program has just made it")

    def remove(self) -> None:
        """Delete the folder and everything in it."""
        with self._open("written") as (files, root):
            if files.exists(root):
                files.rm(root, recursive=True)

    def put(self, local: Path, job_id: str) -> PackedFolder:
        """Upload a file under a name of its own: another attempt at the same job does not overwrite it."""
        digest = file_digest(local).hexdigest()
        name = f"{job_id}.{secrets.token_hex(TOKEN_BYTES)}.tar.gz"
        with self._open("written") as (files, root):
            files.put_file(str(local), f"{root}/{name}")
        return PackedFolder(name=name, size=local.stat().st_size, sha256=digest)

    def open(self, packed: PackedFolder) -> BinaryIO:
        """Return a stream of the packed folder's bytes."""
        with self._open("read") as (files, root):
            return cast("BinaryIO", files.open(f"{root}/{packed.name}", "rb"))

    def delete(self, packed: PackedFolder) -> None:
        """Delete the packed folder."""
        with self._open("written") as (files, root):
            files.rm_file(f"{root}/{packed.name}")

    def greet(self, word: str) -> None:
        """Leave a word: a worker that reads it reaches the same folder."""
        with self._open("written") as (files, root):
            files.pipe_file(f"{root}/{HELLO}", word.encode())

    def answers(self, word: str) -> bool:
        """Return whether the client's word is there, and a file can be written beside it."""
        with self._open("written") as (files, root):
            if not files.exists(f"{root}/{HELLO}") or files.cat_file(f"{root}/{HELLO}") != word.encode():
                return False
            mine = f"{root}/{HELLO}.{secrets.token_hex(TOKEN_BYTES)}"
            files.pipe_file(mine, b"")
            files.rm_file(mine)
            return True

    @contextmanager
    def _open(self, purpose: str) -> Iterator[tuple[Any, str]]:
        """The file system and the folder's name in it. Whatever it raises becomes a HostError that names the exchange.

        Each thread opens its own, since not every file system can be shared.
        """
        import fsspec  # noqa: PLC0415 - of the extra `cluster`

        try:
            if "://" in self.url:
                files, root = fsspec.core.url_to_fs(self.url)
                # a listing that is kept in memory lacks what other machines have written since
                files.invalidate_cache()
                yield files, root.rstrip("/")
            else:
                yield fsspec.filesystem("file"), self.url
        except (FileNotFoundError, HostError):
            raise
        except Exception as error:
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            raise HostError(
                f"the exchange {self.url} cannot be {purpose}: {reason}",
                hint="give --exchange a folder or URL that this machine and every worker can write",
            ) from error


def check_url(text: str) -> str:
    """Return what `--exchange` says, a path made absolute.

    Raises UsageError for what workers cannot reach, and for a password: it would be sent to all of them.
    """
    if "://" not in text:
        return str(Path(text).absolute())
    import fsspec  # noqa: PLC0415 - of the extra `cluster`

    known = "a path, s3://bucket/folder, gs://…, abfs://… or sftp://host/folder"
    try:
        parts = urlsplit(text)
    except ValueError as error:
        raise UsageError(f"--exchange {text}: {error}", hint=f"give {known}") from error
    if parts.password is not None:
        raise UsageError(
            "--exchange holds a password, which every worker and its logs would see",
            hint="let each machine have credentials of its own (a key, environment variables, a configuration file)",
        )
    if parts.scheme in OWN_MEMORY:
        raise UsageError(
            f"--exchange {text}: memory belongs to one process", hint="give a path or s3://…, sftp://…"
        )
    try:
        fsspec.get_filesystem_class(parts.scheme)
    except ImportError as error:
        raise UsageError(f"--exchange {text}: {error}", hint="install it here and on every worker") from error
    except ValueError as error:
        raise UsageError(f"--exchange {text}: {error}", hint=f"give {known}") from error
    return text


def pack(folder: Path, file: Path) -> None:
    """Pack everything in `folder`, without the grader's own hidden files."""
    with tarfile.open(file, "x:gz", compresslevel=LEVEL) as archive:
        for path in sorted(folder.iterdir()):
            if not path.name.startswith("."):  # what is half written
                archive.add(path, arcname=path.name)


def unpack(stream: BinaryIO, packed: PackedFolder, folder: Path) -> None:
    """Unpack a folder's files into `folder`. Raises HostError for other content than was sent, for more than results
    ever are, and for anything that is neither file nor folder or leads out; `folder` is then to be thrown away."""
    measured = _Measured(stream, packed)
    try:
        with tarfile.open(fileobj=cast("BinaryIO", measured), mode="r|gz") as archive:
            _extract(archive, packed, folder)
        # to the end of the file, so that size and digest are those of all of it
        while measured.read(CHUNK_BYTES):
            pass
    except (tarfile.TarError, zlib.error, EOFError, ValueError, OSError) as error:
        raise _refuse(packed, str(error) or type(error).__name__) from error
    if (measured.size, measured.digest.hexdigest()) != (packed.size, packed.sha256):
        raise _refuse(packed, "it is not what the worker sent")


def _extract(archive: tarfile.TarFile, packed: PackedFolder, folder: Path) -> None:
    size, count = 0, 0
    while (member := archive.next()) is not None:
        size, count = size + member.size, count + 1
        if count > ENTRIES or size > UNPACKED_BYTES:
            raise _refuse(packed, "it holds more than results ever are")
        if not (member.isreg() or member.isdir()):
            # with neither links nor devices among them, no name leads anywhere but below `folder`
            raise _refuse(packed, "it holds something that is neither file nor folder")
        archive.extract(member, folder, set_attrs=False, filter="data")
        archive.members = []  # type: ignore[attr-defined] # it would keep all of them in memory


class _Measured:
    """A stream that counts and digests what is read from it."""

    def __init__(self, stream: BinaryIO, packed: PackedFolder) -> None:
        self._stream, self._packed = stream, packed
        self.size, self.digest = 0, hashlib.sha256()

    def read(self, size: int) -> bytes:
        data = self._stream.read(size)
        self.size += len(data)
        self.digest.update(data)
        if self.size > min(self._packed.size, PACKED_BYTES):
            raise _refuse(self._packed, "it is larger than what the worker sent")
        return data


def _refuse(packed: PackedFolder, why: str) -> HostError:
    hint = "check whether another program writes into the exchange"
    return HostError(f"{packed.name} cannot be unpacked: {why}", hint=hint)


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


# once: a worker's files may be updated while it runs with those that it has loaded
@cache
def _digest_code() -> str:
    """Return a digest of the grader's own files: two of one version may differ."""
    folder = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder)
        # what a wheel brings along and a checkout has elsewhere
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
    packed = None
    try:
        with temporary_folder("run") as folder, _lab(request) as job:
            outcome = _grade_in(folder, request.model_copy(update={"job": job}), is_wanted)
            if is_machines(outcome):
                outcome = outcome.model_copy(update={"message": f"{outcome.message} (on {host})"})
            # the client has no use for anything else, and would have to clear it away
            if not outcome.kept and outcome.kind != "interrupted" and is_wanted():
                packed = _deliver(folder, request)
    except (GraderError, OSError) as error:
        message = getattr(error, "message", "") or str(error)
        raise HostError(f"{message} (on {host})", hint=getattr(error, "hint", "")) from error
    return Report(outcome=outcome, packed=packed)


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


def _deliver(folder: Path, request: GradeRequest) -> PackedFolder | None:
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
    # in a thread, since Dask's own loop must not wait
    await asyncio.to_thread(_processes.dismiss, batch)


class _Processes:
    """The processes of this worker, and the batch that each of them works for."""

    def __init__(self) -> None:
        self._idle: list[Worker] = []
        self._busy: dict[Worker, str] = {}
        self._changed = threading.Condition()

    @contextmanager
    def borrow(self, batch: str) -> Iterator[Worker]:
        """Lend a process for one job; one that was interrupted is not used again."""
        with self._changed:
            process = self._idle.pop() if self._idle else Worker(WorkerLimits(idle_s=IDLE_S))
            self._busy[process] = batch
        try:
            yield process
        finally:
            if process.stopped:
                # outside the lock, since it may take a while
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
