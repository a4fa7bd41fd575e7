"""Which Dask clusters and which of their workers grade.

`connect` gives a client of a cluster that runs already, or of one that is started on this machine for trying it.
"""

from __future__ import annotations

import asyncio
import logging
import re
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, KeysView, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from grader.classes.cluster import worker
from grader.errors import HostError, UsageError
from grader.installable import install_extra
from grader.portable import on_interrupt
from grader.ros_env import INSTALL_HINT

CONNECT_S = 15.0
LOGGERS = (*(f"distributed{part}" for part in ("", ".client", ".scheduler", ".nanny")), "tornado", "asyncio")
TLS = tuple(f"DASK_DISTRIBUTED__COMM__TLS__{name}" for name in ("CA_FILE", "CLIENT__CERT", "CLIENT__KEY"))
LOCAL = "local"
ENCRYPTED = ("tls", "wss")
"""Of Dask's protocols, those in which both ends show certificates."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://(\[[0-9A-Fa-f:.%]+\]|[^\s:/\[\]@]+):[0-9]{1,5}/?")
GOES_ON = "then run the same command again: it continues where it stopped"
OPEN = "it listens without certificates: start it with the protocol of its scheduler"
Answer = Mapping[str, str] | BaseException | None


def check_address(text: str, *, insecure: bool = False) -> str:
    """Return what `--cluster` says: `tls://host:8786` or `local`; with `insecure` also `tcp://host:8786` and the like.

    Raises UsageError for anything else, and if Dask is missing.
    """
    if text != LOCAL and not _ADDRESS.fullmatch(text):
        raise UsageError(
            f"--cluster {text}: not the address of a Dask scheduler",
            hint="give tls://host:8786 as `dask scheduler` prints it, or `local`",
        )
    if text != LOCAL and not is_encrypted(text) and not insecure:
        raise UsageError(
            f"--cluster {text}: this scheduler asks for no certificate: "
            "anyone who reaches its port can run programs as its user",
            hint="use tls:// (docs/how-to/cluster.md says how); if you are alone on that network, "
            "add --cluster-insecure",
        )
    try:
        import cryptography  # noqa: F401, PLC0415 - only to know that it is there: `local` makes certificates
        import distributed  # noqa: F401, PLC0415 - as above
    except ImportError as error:
        raise UsageError(f"--cluster needs Dask: {error}", hint=install_extra("cluster")) from error
    return text


@contextmanager
def connect(address: str) -> Iterator[Any]:
    """A `distributed.Client`. Raises HostError if no scheduler answers, or one without this grader."""
    from distributed import Client  # noqa: PLC0415 - slow to load
    from distributed.versions import VersionMismatchWarning  # noqa: PLC0415 - as above

    warnings.filterwarnings("ignore", category=VersionMismatchWarning)  # each worker is asked what matters
    for name in LOGGERS:  # what Dask logs about lost connections, the grader says where it matters
        logging.getLogger(name).setLevel(logging.CRITICAL)
    if address != LOCAL:
        _check_address_answers(address)
        with _client(Client, address) as client:
            _check_scheduler(client, address)
            yield client
        return
    from grader.classes.cluster.local import own_cluster  # noqa: PLC0415 - slow to load

    with ExitStack() as stack:
        # its processes are ended in order, and not by the terminal's Ctrl-C
        with on_interrupt(signal.SIG_IGN):
            cluster = stack.enter_context(own_cluster())
        yield stack.enter_context(Client(cluster, set_as_default=False))


def _check_address_answers(address: str) -> None:
    """Dask's own client waits for ever if something else than a scheduler listens."""
    try:
        asyncio.run(asyncio.wait_for(_answer(address), CONNECT_S))
    # two different exceptions before Python 3.11
    except (TimeoutError, asyncio.TimeoutError, OSError) as error:
        raise _no_scheduler(address) from error
    except Exception as error:
        if address.startswith("tls") and "ssl_context" in str(error):
            hint = f"set {', '.join(TLS)} to their files"
            raise HostError(
                f"{address} needs certificates, and none are configured here", hint=hint
            ) from error
        message = f"what answers at {address} is not a Dask scheduler ({type(error).__name__})"
        raise HostError(
            message, hint="give the address that `dask scheduler` prints, of a like version"
        ) from error


async def _answer(address: str) -> None:
    from distributed import rpc  # noqa: PLC0415 - slow to load

    async with rpc(address, connection_args=_security(address).get_connection_args("client")) as scheduler:
        await scheduler.versions()


def _security(address: str) -> Any:  # noqa: ANN401 - Dask has no types
    """Return what Dask's settings say about certificates; a scheduler with TLS leads to no worker without."""
    from distributed import Security  # noqa: PLC0415 - slow to load

    return Security(require_encryption=True) if is_encrypted(address) else Security()


@contextmanager
def _client(make: Any, address: str) -> Iterator[Any]:  # noqa: ANN401 - Dask has no types
    try:
        client = make(address, timeout=CONNECT_S, set_as_default=False, security=_security(address))
    except (OSError, ValueError, ImportError, RuntimeError) as error:
        raise _no_scheduler(address) from error
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_S)


def _no_scheduler(address: str) -> HostError:
    return HostError(
        f"no Dask scheduler answers at {address} within {CONNECT_S:g} s",
        hint="start one there with `dask scheduler`, and check whether a firewall is in between",
    )


def _check_scheduler(client: Any, address: str) -> None:  # noqa: ANN401 - Dask has no types
    """Raise HostError if the scheduler has another grader or Python: it reads the tasks that it passes on."""
    try:
        there = client.run_on_scheduler(worker.versions)
    except Exception as error:
        if not _has_no_grader(error):
            raise _no_scheduler(address) from error
        raise HostError(
            f"the scheduler at {address} has no grader like this one",
            hint="install the same grader, with the extra [cluster], where the scheduler runs",
        ) from error
    here = worker.versions()
    for name in ("grader", "python"):
        if there[name] != here[name]:
            raise HostError(
                f"the scheduler at {address} has {name} {there[name]}, here it is {here[name]}",
                hint="use the same environment for the client, the scheduler and the workers",
            )


def is_encrypted(address: str) -> bool:
    """Return whether the scheduler or worker at `address` asks for a certificate."""
    return address.partition("://")[0] in ENCRYPTED


@dataclass(frozen=True, kw_only=True)
class Needs:
    """What a worker must have: the client's `versions`, and ROS. `encrypted`: it must ask for certificates."""

    versions: Mapping[str, str]
    ros: bool
    encrypted: bool = False


class GradingWorkers:
    """The workers of a cluster that can grade: each is asked once who it is, and left out by name if it differs.

    `known` are the addresses of all workers, `fit` maps those that can grade to their number of threads. `changed` is
    set when one has answered.
    """

    def __init__(
        self,
        client: Any,  # noqa: ANN401 - Dask has no types
        exchange: str,
        batch: str,
        needs: Needs,
        say: Callable[[str], None],
    ) -> None:
        self.fit: dict[str, int] = {}
        self._left_out: dict[str, str] = {}
        self._threads: dict[str, int] = {}
        self._answers: SimpleQueue[tuple[str, Answer]] = SimpleQueue()
        self.changed = threading.Event()
        self._client, self._exchange, self._batch = client, exchange, batch
        self._needs, self._say = needs, say

    @property
    def address(self) -> str:
        """The scheduler's."""
        return str(self._client.scheduler.address)

    @property
    def known(self) -> KeysView[str]:
        return self._threads.keys()

    @property
    def threads(self) -> int:
        """The threads of all workers that can grade."""
        return sum(self.fit.values())

    @property
    def asked(self) -> int:
        """How many have not answered yet."""
        return len(self._threads) - len(self.fit) - len(self._left_out)

    def look(self) -> None:
        """Take in which workers the scheduler knows now, and ask new ones who they are."""
        threads = self._client.nthreads()
        for address in self._threads.keys() - threads.keys():
            self._forget(address)
        for address in threads.keys() - self._threads.keys():
            self._threads[address] = threads[address]
            # a thread each, since asking waits for as long as a worker is silent
            threading.Thread(target=self._ask, args=(address,), daemon=True).start()

    def take_answers(self) -> None:
        """Take in the answers that have come."""
        with suppress(Empty):
            while True:
                self._take_in(*self._answers.get_nowait())

    def none_fit(self, patience_s: float) -> HostError:
        """Return the error that no worker can grade."""
        left_out = "; ".join(self._left_out.values())
        what = f"no worker that can grade ({left_out})" if left_out else "no worker"
        files = " --tls-ca-file CA --tls-cert CERT --tls-key KEY" if is_encrypted(self.address) else ""
        return HostError(
            f"{what} at {self.address} for {patience_s:g} s",
            hint=f"start one with `dask worker {self.address} --nthreads 4{files}`, {GOES_ON}",
        )

    def _ask(self, address: str) -> None:
        answer: Answer
        try:
            said = self._client.run(
                worker.describe, self._exchange, self._batch, workers=[address], on_error="return"
            )
            answer = said.get(address)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is this worker's answer
            answer = error
        self._answers.put((address, answer))
        self.changed.set()

    def _take_in(self, address: str, answer: Answer) -> None:
        # it left while it was asked
        if address not in self._threads:
            return
        if answer is None or isinstance(answer, OSError):
            self._forget(address)  # gone while it was asked, or asked again
            return
        is_open = self._needs.encrypted and not is_encrypted(address)
        why = OPEN if is_open else why_not(answer, self._needs)
        if not why:
            self.fit[address] = self._threads[address]
            return
        host = "" if isinstance(answer, BaseException) else f" ({answer.get('host', '')})"
        self._left_out[address] = f"{address}{host}: {why}"
        self._say(f"this worker is left out: {self._left_out[address]}")

    def _forget(self, address: str) -> None:
        self._threads.pop(address, None)
        self.fit.pop(address, None)
        self._left_out.pop(address, None)


def why_not(answer: Mapping[str, str] | BaseException, needs: Needs) -> str:
    """Return why a worker that says this cannot grade; nothing if it can."""
    if isinstance(answer, BaseException) and _has_no_grader(answer):
        return "no grader like this one is installed there"
    if isinstance(answer, BaseException):
        return f"it cannot answer: {type(answer).__name__}: {answer}"
    for name, here in needs.versions.items():
        there = answer.get(name, "")
        if there != here and name == "code":
            return "its grader has other files than this one: update both, and start it again"
        if there != here:
            return f"it has {name} {there or 'of no version'}, here it is {here}"
    if needs.ros and not answer.get("ros"):
        return f"no ROS 1 there; {INSTALL_HINT}"
    return answer.get("kept_out", "")


def _has_no_grader(error: BaseException) -> bool:
    """Return whether that is why a worker or scheduler could not answer. Dask sends some errors as their text."""
    return isinstance(error, ImportError) or "ModuleNotFoundError" in str(error)
