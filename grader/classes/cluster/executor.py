"""`ClusterExecutor`: grades a batch's submissions on the workers of a Dask cluster.

Dask decides which worker grades what, and repeats a task whose worker is lost. This client keeps one task for each
thread under way, gives them only to workers that can grade, and alone writes into the batch's folder.
"""

from __future__ import annotations

import asyncio
import hashlib
import pickle
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

from grader.classes.batch.job import GradingJob, SubmissionOutcome, failed_outcome
from grader.classes.cluster import worker
from grader.classes.cluster.connect import (
    GOES_ON,
    LOCAL,
    GradingWorkers,
    Needs,
    check_address,
    connect,
    is_encrypted,
)
from grader.classes.cluster.worker import (
    Exchange,
    GradeRequest,
    PackedFolder,
    Report,
    check_url,
    is_machines,
    pack,
    unpack,
)
from grader.errors import GraderError, HostError
from grader.files import temporary_folder
from grader.intake.names import safe_name
from grader.results import RESULT, Results
from grader.rubric.load import LoadedRubric, needs_ros, read_beside_rubric

PATIENCE_S = 60.0
EXCHANGE = ".grader-exchange"
TOKEN_BYTES = 6
LOOK_S = 1.0
RETRIES = 2
LOSSES = 3
ANSWERING = 3  # times as long is waited while a worker has still to say who it is
RESULT_S = 10.0
READS, PAUSE_S = 5, 1.0
LEAVE_S = 45.0
LOST = "the workers that graded it were lost"


class PackedFolderLost(HostError):
    """What a worker left cannot be had: the job is done once more."""


class ClusterExecutor:
    """The workers of the Dask cluster at `address` (`tls://host:8786`; `local` starts one for trying it).

    With `insecure` it may be one without certificates (`tcp://host:8786`), to which everybody who reaches it may send
    code. Results come back through `exchange`, any fsspec URL or path that all machines reach; by default a folder in
    `out`, the batch's folder. `say` gets one line for each worker that is left out. If no worker can grade for
    `patience_s`, HostError ends the batch.

    Raises UsageError for an impossible address or exchange, and if Dask is not installed.
    """

    def __init__(
        self,
        address: str,
        out: Path,
        exchange: str | None = None,
        *,
        insecure: bool = False,
        say: Callable[[str], None] = lambda _: None,
        patience_s: float = PATIENCE_S,
    ) -> None:
        self._address = check_address(address, insecure=insecure)
        self._exchange = Exchange(_exchange_url(out, exchange))
        self._say, self._patience_s = say, patience_s

    def run(self, jobs: Iterable[GradingJob], *, begun: Callable[[str], None]) -> Iterator[SubmissionOutcome]:
        """See `classes.batch.job.Executor.run`. Raises HostError if no scheduler can be reached, or it is lost."""
        waiting = iter(jobs)
        # for no job at all, no cluster is needed
        first = next(waiting, None)
        if first is None:
            return
        versions = worker.versions()
        if self._address == LOCAL:
            del versions["code"]  # its workers have our own files
        needs = Needs(
            versions=versions,
            ros=not first.static_only and needs_ros(first.rubric),
            encrypted=self._address == LOCAL or is_encrypted(self._address),
        )
        batch = secrets.token_hex(TOKEN_BYTES)
        with connect(self._address) as client:
            self._exchange.make()
            try:
                self._exchange.greet(batch)
                workers = GradingWorkers(client, self._exchange.url, batch, needs, self._say)
                lab = put_lab(first.rubric, self._exchange)
                tasks = _Tasks(client, self._exchange, batch, workers, self._patience_s, lab=lab)
                yield from tasks.run(chain([first], waiting), begun)
            finally:
                with suppress(GraderError, OSError):  # what is left is removed by the next batch
                    self._exchange.remove()


def _exchange_url(out: Path, exchange: str | None) -> str:
    """Return the folder of this batch alone: the same one when the batch goes on, another one for another `out`."""
    if exchange is None:
        return str(out.absolute() / EXCHANGE)
    whose = hashlib.sha256(f"{socket.gethostname()}\0{out.resolve()}".encode(errors="surrogateescape"))
    return f"{check_url(exchange).rstrip('/')}/grader-{whose.hexdigest()[:16]}"


@dataclass(kw_only=True, eq=False)
class _Task:
    """A job and the future of its grading by one of `workers`. `losses`: how often that came to nothing."""

    job: GradingJob
    future: Any = None
    workers: frozenset[str] = frozenset()
    losses: int = 0


class _Tasks:
    """A batch's tasks on the cluster, from the first to the last."""

    def __init__(
        self,
        client: Any,  # noqa: ANN401 - Dask has no types
        exchange: Exchange,
        batch: str,
        workers: GradingWorkers,
        patience_s: float,
        *,
        lab: PackedFolder | None = None,
    ) -> None:
        self._lab = lab
        self._client, self._exchange, self._batch = client, exchange, batch
        self._workers, self._patience_s = workers, patience_s
        self._running: list[_Task] = []
        self._back: deque[_Task] = deque()
        self._count = 0
        self._looked_s, self._idle_since_s = 0.0, time.monotonic()

    def run(self, jobs: Iterable[GradingJob], begun: Callable[[str], None]) -> Iterator[SubmissionOutcome]:
        """See `ClusterExecutor.run`."""
        waiting = iter(jobs)
        try:
            while True:
                # before looking, so that an answer that comes in between ends the wait below
                self._workers.changed.clear()
                yield from self._look()
                more = self._submit(waiting, begun)
                if not (more or self._running or self._back):
                    return
                done = [task for task in self._running if task.future.done()]
                self._running = [task for task in self._running if task not in done]
                # again before results are unpacked, so that no thread of a worker waits for that
                self._submit(waiting, begun)
                for task in done:
                    outcome = self._finish(task)
                    if outcome is not None:
                        yield outcome
                if not done:
                    self._workers.changed.wait(LOOK_S)
        finally:
            self._stop()

    def _submit(self, waiting: Iterator[GradingJob], begun: Callable[[str], None]) -> bool:
        """Give each thread that can grade a task. Return whether there may be more jobs."""
        while len(self._running) < self._workers.threads:
            task = self._back.popleft() if self._back else None
            if task is None:
                job = next(waiting, None)
                if job is None:
                    return False
                task = _Task(job=job)
                begun(job.entry.id)
            self._hand_out(task)
        return True

    def _hand_out(self, task: _Task) -> None:
        source = Path(task.job.entry.source)
        seen = source.is_absolute() and (source.exists() or source.is_symlink())
        request = GradeRequest(
            job=task.job, exchange=self._exchange.url, batch=self._batch, seen=seen, lab=self._lab
        )
        task.workers = frozenset(self._workers.fit)
        task.future = self._client.submit(
            worker.perform,
            pickle.dumps(request),
            key=f"grade-{self._batch}-{self._count}",
            pure=False,  # Dask may not take one task's result for another's
            retries=RETRIES,
            workers=list(task.workers),
            allow_other_workers=False,
        )
        task.future.add_done_callback(lambda _: self._workers.changed.set())
        self._count += 1
        self._running.append(task)

    def _finish(self, task: _Task) -> SubmissionOutcome | None:
        """Put the results into place. Return the outcome; None if the job is done once more."""
        from distributed import CancelledError, KilledWorker  # noqa: PLC0415 - slow to load

        try:
            report = Report.model_validate_json(task.future.result(timeout=RESULT_S))
            return store_results(task.job, report, self._exchange)
        except (TimeoutError, asyncio.TimeoutError):  # lost with its worker: Dask has it done again
            self._running.append(task)
            return None
        except (PackedFolderLost, CancelledError, KilledWorker) as error:
            if self._client.status != "running":
                raise self._scheduler_lost() from error
            # Dask gives this up only after it has lost several workers by it
            task.losses += LOSSES if isinstance(error, KilledWorker) else 0
            return self._repeat(task, error.message if isinstance(error, PackedFolderLost) else LOST)
        except GraderError as error:
            return failed_outcome(task.job, kind=error.kind, message=error.message, hint=error.hint)
        except Exception as error:  # noqa: BLE001 - whatever a worker's environment lacks, the others are graded
            hint = "look into the workers' logs, and install the same grader everywhere"
            message = f"a worker failed: {type(error).__name__}: {error}"
            return failed_outcome(task.job, kind="internal", message=message, hint=hint)

    def _repeat(self, task: _Task, why: str) -> SubmissionOutcome | None:
        """Queue the job once more, or give it up."""
        with suppress(Exception):  # its worker is gone, or the scheduler
            task.future.cancel()
        task.losses += 1
        if task.losses < LOSSES:
            self._back.append(task)
            return None
        hint = "look into the workers' logs (out of memory?), then grade it again with `--only failed`"
        return failed_outcome(
            task.job, kind="worker-lost", message=f"{why}, at least {LOSSES} times", hint=hint
        )

    def _look(self) -> Iterator[SubmissionOutcome]:
        """Once a second, look which workers there are. Repeat what was given only to workers that are gone."""
        self._workers.take_answers()
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        try:
            self._workers.look()
        except Exception as error:
            raise self._scheduler_lost() from error
        for task in list(self._running):
            if not task.future.done() and not task.workers & self._workers.known:
                self._running.remove(task)
                outcome = self._repeat(task, LOST)
                if outcome is not None:
                    yield outcome
        if self._workers.fit:
            self._idle_since_s = now_s
        elif now_s - self._idle_since_s > self._patience_s * (ANSWERING if self._workers.asked else 1):
            raise self._workers.none_fit(self._patience_s)

    def _scheduler_lost(self) -> HostError:
        message = f"the connection to the scheduler at {self._workers.address} is lost"
        return HostError(message, hint=f"start the scheduler and its workers, {GOES_ON}")

    def _stop(self) -> None:
        """Cancel running tasks, and wait until the workers have cleaned up."""
        if self._client.status != "running":
            return
        with suppress(Exception):  # it ends in any case
            self._client.cancel([task.future for task in self._running])
        if self._workers.fit:
            # in a thread, since a worker that hangs would never answer
            thread = threading.Thread(target=self._dismiss, daemon=True)
            thread.start()
            thread.join(LEAVE_S)

    def _dismiss(self) -> None:
        with suppress(Exception):  # a worker that is gone needs no dismissal
            workers = list(self._workers.fit)
            self._client.run(worker.dismiss, self._batch, workers=workers, on_error="ignore")


def put_lab(rubric: LoadedRubric, exchange: Exchange) -> PackedFolder | None:
    """Put the rubric and what it brings along into the exchange; None where that is its file alone."""
    files = read_beside_rubric(rubric)
    if not files:
        return None
    with temporary_folder("lab") as folder:
        packed = folder / "packed"
        for name, data in {rubric.path.name: rubric.path.read_bytes(), **files}.items():
            target = folder / "lab" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        pack(folder / "lab", packed)
        return exchange.put(packed, "lab")


def store_results(job: GradingJob, report: Report, exchange: Exchange) -> SubmissionOutcome:
    """Unpack a report's results into `job.out`, and return the outcome.

    A complete result is replaced by no error but the submission's own. Raises PackedFolderLost, and as `Results` does.
    """
    outcome, packed = report.outcome, report.packed
    if packed is None:
        return outcome
    with Results(job.out / safe_name(job.entry.id)) as results:
        if is_machines(outcome) and results.complete:
            stays = f"the result of an earlier run stays as it is: {results.folder / RESULT}"
            outcome = outcome.model_copy(update={"hint": stays})
        else:
            _unpack(packed, exchange, results)
            results.commit()
    with suppress(HostError, OSError):  # whatever is left goes with the exchange
        exchange.delete(packed)
    return outcome


def _unpack(packed: PackedFolder, exchange: Exchange, results: Results) -> None:
    try:
        with _open(exchange, packed) as stream:
            unpack(stream, packed, results.new)
    except (HostError, OSError) as error:
        message = getattr(error, "message", "") or str(error)
        raise PackedFolderLost(message, hint=getattr(error, "hint", "")) from error
    # of a submission that could not be graded: as if it had been graded here
    if not any(results.evidence.iterdir()):
        results.evidence.rmdir()
    if not (results.new / RESULT).is_file():
        raise PackedFolderLost(f"{packed.name} holds no {RESULT}")


def _open(exchange: Exchange, packed: PackedFolder) -> BinaryIO:
    """A shared folder may show a new file some time later."""
    for _ in range(READS - 1):
        with suppress(FileNotFoundError):
            return exchange.open(packed)
        time.sleep(PAUSE_S)
    return exchange.open(packed)
