"""`ClusterHands`: does a batch's jobs on a Dask cluster."""

from __future__ import annotations

import hashlib
import secrets
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path

from grader.classes.batch.job import Job, Outcome
from grader.classes.cluster import remote
from grader.classes.cluster.address import LOCAL, check_address, is_encrypted
from grader.classes.cluster.connecting import connected
from grader.classes.cluster.crew import Needs
from grader.classes.cluster.exchange import Exchange, checked_url
from grader.classes.cluster.shift import Shift
from grader.errors import GraderError
from grader.rubric.load import LoadedRubric, started

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
        versions = remote.versions()
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
