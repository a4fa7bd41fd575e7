"""`ClusterHands`: does a batch's jobs on a Dask cluster."""

from __future__ import annotations

import hashlib
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from itertools import chain
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from grader.classes.batch.job import Job, Outcome
from grader.classes.cluster import worker
from grader.classes.cluster.connect import LOCAL, check_address, connected, is_encrypted
from grader.classes.cluster.crew import Answer, Crew, Needs, ask_of
from grader.classes.cluster.errands import Report, failed
from grader.classes.cluster.exchange import Exchange, checked_url
from grader.classes.cluster.placing import ParcelLost, place
from grader.classes.cluster.tasks import Task, Tasks
from grader.errors import GraderError, HostError
from grader.rubric.load import LoadedRubric
from grader.rubric.needs import started

PATIENCE_S = 60.0
EXCHANGE = ".grader-exchange"
TOKEN_BYTES = 6


class ClusterHands:
    """The workers of the Dask cluster at `address` (`tls://host:8786`; `local` starts one for trying it).

    With `insecure` it may be one without certificates (`tcp://host:8786`), to which all who reach it may send code.

    `out` is the batch's folder, which only this process writes. Results come back through `exchange`, any fsspec URL or
    path that all machines reach; by default a folder in `out`. `say` is told, in one line each, which workers are left
    out and why. Where no worker can grade for `patience_s`, HostError ends the batch.

    Raises UsageError for an address or exchange that cannot be, and where Dask is not installed.
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
        self._exchange = Exchange(_place(out, exchange))
        self._say, self._patience_s = say, patience_s

    def run(self, jobs: Iterable[Job], *, begun: Callable[[str], None]) -> Iterator[Outcome]:
        """As `classes.batch.executor.Hands.run` says.

        Raises HostError where no scheduler can be reached, or it is lost.
        """
        waiting = iter(jobs)
        first = next(waiting, None)
        if first is None:
            return
        needs = Needs(
            versions=self._versions(),
            ros=not first.static_only and needs_ros(first.rubric),
            encrypted=self._address == LOCAL or is_encrypted(self._address),
        )
        with connected(self._address) as client:
            word = secrets.token_hex(TOKEN_BYTES)
            self._exchange.make()
            try:
                self._exchange.greet(word)
                shift = Shift(
                    client=client,
                    address=self._address,
                    exchange=self._exchange,
                    batch=word,
                    needs=needs,
                    begun=begun,
                    say=self._say,
                    patience_s=self._patience_s,
                )
                yield from shift.run(chain([first], waiting))
            finally:
                with suppress(GraderError, OSError):  # what is left is removed by the next batch
                    self._exchange.remove()

    def _versions(self) -> dict[str, str]:
        """Those that a worker must have; one that is started here has our own files."""
        versions = worker.versions()
        return {k: v for k, v in versions.items() if k != "code"} if self._address == LOCAL else versions


def needs_ros(rubric: LoadedRubric) -> bool:
    """Whether anything of it is built or run."""
    if started(rubric.rubric).scenarios:
        return True
    checks = rubric.checks
    return any("build" in checks[c.check].facts for c in rubric.rubric.criteria if c.check in checks)


def _place(out: Path, exchange: str | None) -> str:
    """The folder of this batch alone: the same one when the batch goes on, another one for another `out`."""
    if exchange is None:
        return str(out.absolute() / EXCHANGE)
    whose = hashlib.sha256(f"{socket.gethostname()}\0{out.resolve()}".encode(errors="surrogateescape"))
    return f"{checked_url(exchange).rstrip('/')}/grader-{whose.hexdigest()[:16]}"


# [classes.cluster.shift] One batch's jobs on a cluster, from the first to the last: who grades what, and what is done when a worker is lost.
#
# Dask runs a task again elsewhere when its worker is lost; the client keeps a bounded number of tasks under way, knows
# how often each was begun, and gives up on one whose workers are lost again and again. All that happens (a worker
# answers, a task ends) comes into one inbox and is heeded in the caller's thread, which alone changes anything here.

LOOK_S = 1.0
TASKS_A_THREAD = 2
LOSSES = 3
ANSWERING = 3  # times as long is waited while a worker has still to say who it is
PLACERS = 4
LEAVE_S = 45.0
GOES_ON = "then run the same command again: it goes on where it stopped"
LOST = "the workers that graded it were lost"


class Shift:
    """`run` yields every job's outcome as it comes."""

    def __init__(
        self,
        *,
        client: Any,  # noqa: ANN401 - Dask has no types
        address: str,
        exchange: Exchange,
        batch: str,
        needs: Needs,
        begun: Callable[[str], None],
        say: Callable[[str], None],
        patience_s: float,
    ) -> None:
        self._client, self._address, self._exchange, self._batch = client, address, exchange, batch
        self._begun, self._say, self._patience_s = begun, say, patience_s
        self._inbox: SimpleQueue[Callable[[], Iterator[Outcome]]] = SimpleQueue()
        self._crew = Crew(needs, ask_of(client, exchange.url, batch), self._put(self._answered))
        self._tasks = Tasks(client, exchange.url, batch, self._put(self._ended))
        self._placers = ThreadPoolExecutor(PLACERS)
        self._looked = 0.0
        self._idle_since = time.monotonic()

    def run(self, jobs: Iterable[Job]) -> Iterator[Outcome]:
        """See `ClusterHands.run`."""
        waiting = iter(jobs)
        self._client.subscribe_topic(self._batch, self._put(self._told))
        try:
            while True:
                self._look()
                more = self._hand_out(waiting)
                if not more and not self._tasks and not self._tasks.back:
                    return
                yield from self._heeded()
        finally:
            self._stop()

    def _put(self, heed: Callable[..., Iterator[Outcome]]) -> Callable[..., None]:
        """What may be called in any thread, to have `heed` called in this one."""
        return lambda *said: self._inbox.put(partial(heed, *said))

    def _heeded(self) -> Iterator[Outcome]:
        try:
            heed = self._inbox.get(timeout=LOOK_S)
        except Empty:
            return
        yield from heed()

    def _hand_out(self, waiting: Iterator[Job]) -> bool:
        """As many as there are hands for. Whether there may be more jobs."""
        while len(self._tasks) < TASKS_A_THREAD * self._crew.threads:
            task = self._tasks.back.popleft() if self._tasks.back else None
            if task is None:
                job = next(waiting, None)
                if job is None:
                    return False
                task = Task(job=job)
            self._tasks.hand_out(task, list(self._crew.fit))
        return True

    def _told(self, event: tuple[float, dict[str, str]]) -> Iterator[Outcome]:
        """A worker begins a task, or reports what became of it."""
        said = event[1]
        key = said.get("key", "")
        task = self._tasks.get(key)
        if task is None or task.placing:
            return
        if "report" in said:
            task.placing = True
            report = Report.model_validate_json(said["report"])
            placing = self._placers.submit(place, task.job, report, self._exchange)
            placing.add_done_callback(partial(self._put(self._placed), key))
            return
        task.begun += 1
        if task.begun == 1:
            self._begun(task.job.entry.id)
        if task.begun > LOSSES:
            yield from self._again(key, LOST)

    def _ended(self, key: str) -> Iterator[Outcome]:
        task = self._tasks.get(key)
        if task is None or task.placing:
            return
        status = task.future.status
        if status == "error":
            yield from self._erred(key, task.future.exception())
        elif status == "cancelled":
            if self._client.status != "running":
                raise self._scheduler_gone()
            task.lost += 1
            yield from self._again(key, "it was cancelled on the cluster")

    def _erred(self, key: str, error: BaseException) -> Iterator[Outcome]:
        from distributed import KilledWorker  # noqa: PLC0415 - slow to load

        if isinstance(error, KilledWorker):
            yield from self._again(key, LOST)
            return
        hint = "look into the workers' logs, and install the same grader everywhere"
        message = f"a worker failed: {type(error).__name__}: {error}"
        yield failed(self._tasks.take_out(key).job, kind="internal", message=message, hint=hint)

    def _again(self, key: str, why: str) -> Iterator[Outcome]:
        """Hand it out once more, or give it up."""
        task = self._tasks.get(key)
        assert task is not None  # noqa: S101 - the caller has it
        if max(task.begun, task.lost) < LOSSES:
            self._tasks.take_back(key)
            return
        self._tasks.take_out(key)
        hint = "look into the workers' logs (out of memory?), then grade it again with `--only failed`"
        yield failed(task.job, kind="worker-lost", message=f"{why}, {LOSSES} times", hint=hint)

    def _placed(self, key: str, done: Future[Outcome]) -> Iterator[Outcome]:
        task = self._tasks.get(key)
        if task is None or done.cancelled():
            return
        error = done.exception()
        if isinstance(error, ParcelLost):
            task.lost += 1
            yield from self._again(key, error.message)
            return
        self._tasks.take_out(key)
        if error is None:
            yield done.result()
        elif isinstance(error, GraderError):
            yield failed(task.job, kind=error.kind, message=error.message, hint=error.hint)
        else:
            raise error

    def _look(self) -> None:
        """Once in a while: who is there, and whether anybody has what was handed out."""
        now = time.monotonic()
        if now - self._looked < LOOK_S:
            return
        self._looked = now
        try:
            self._crew.update(self._client.nthreads())
            held = {key for keys in self._client.processing().values() for key in keys}
        except Exception as error:
            raise self._scheduler_gone() from error
        if self._crew.fit:
            self._idle_since = now
            for key in self._tasks.missed_by(held):
                self._tasks.take_back(key)
        elif now - self._idle_since > self._patience_s * (ANSWERING if self._crew.asked else 1):
            raise self._nobody()

    def _answered(self, address: str, answer: Answer) -> Iterator[Outcome]:
        why = self._crew.settle(address, answer)
        if why:
            self._say(f"this worker is left out: {why}")
        yield from ()

    def _nobody(self) -> HostError:
        left_out = "; ".join(self._crew.left_out.values())
        what = f"no worker that can grade ({left_out})" if left_out else "no worker"
        files = " --tls-ca-file CA --tls-cert CERT --tls-key KEY" if is_encrypted(self._address) else ""
        start = f"start one with `dask worker {self._address} --nthreads 4{files}`, {GOES_ON}"
        return HostError(
            f"{what} at {self._address} for {self._patience_s:g} s",
            hint=start if self._address != LOCAL else "grade without --cluster",
        )

    def _scheduler_gone(self) -> HostError:
        return HostError(
            f"the connection to the scheduler at {self._address} is lost",
            hint=f"start the scheduler and its workers, {GOES_ON}",
        )

    def _stop(self) -> None:
        """Cancel what is under way, and wait until the workers have cleaned up."""
        alive = self._client.status == "running"
        with suppress(Exception):  # it ends in any case
            if alive:
                self._tasks.cancel_all()
                self._client.unsubscribe_topic(self._batch)
        self._placers.shutdown(wait=True, cancel_futures=True)
        if alive and self._crew.fit:
            thread = threading.Thread(target=self._dismiss, daemon=True)
            thread.start()
            thread.join(LEAVE_S)

    def _dismiss(self) -> None:
        with suppress(Exception):  # a worker that is gone needs no dismissal
            self._client.run(worker.dismiss, self._batch, workers=list(self._crew.fit), on_error="ignore")
