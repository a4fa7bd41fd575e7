"""A client of a Dask cluster: of one that runs already, or of one that is started on this machine for trying it."""

from __future__ import annotations

import asyncio
import logging
import re
import signal
import threading
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from grader.classes.cluster import worker
from grader.classes.cluster.crew import has_no_grader
from grader.errors import HostError, UsageError

CONNECT_S = 15.0
TLS = tuple(f"DASK_DISTRIBUTED__COMM__TLS__{name}" for name in ("CA_FILE", "CLIENT__CERT", "CLIENT__KEY"))


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client`. Raises HostError where no scheduler answers, or one without this grader."""
    from distributed import Client  # noqa: PLC0415 - slow to load
    from distributed.versions import VersionMismatchWarning  # noqa: PLC0415 - as above

    warnings.filterwarnings("ignore", category=VersionMismatchWarning)  # each worker is asked what matters
    _silence()
    if address != LOCAL:
        _check_address_answers(address)
        with _client(Client, address) as client:
            _check_scheduler(client, address)
            yield client
        return
    from grader.classes.cluster.local import own_cluster  # noqa: PLC0415 - slow to load

    with ExitStack() as stack:
        with _not_interrupted():
            cluster = stack.enter_context(own_cluster())
        yield stack.enter_context(Client(cluster, set_as_default=False))


def _check_address_answers(address: str) -> None:
    """Dask's own client waits for ever where something else than a scheduler listens."""
    try:
        asyncio.run(asyncio.wait_for(_answer(address), CONNECT_S))
    except (TimeoutError, asyncio.TimeoutError, OSError) as error:
        raise _nobody_answers(address) from error
    except Exception as error:
        if address.startswith("tls") and "ssl_context" in str(error):
            hint = f"set {', '.join(TLS)} to their files"
            raise HostError(
                f"{address} needs certificates, and none are configured here", hint=hint
            ) from error
        message = f"what answers at {address} is no Dask scheduler ({type(error).__name__})"
        raise HostError(
            message, hint="give the address that `dask scheduler` prints, of a like version"
        ) from error


async def _answer(address: str) -> None:
    from distributed import rpc  # noqa: PLC0415 - slow to load

    async with rpc(address, connection_args=_security(address).get_connection_args("client")) as scheduler:
        await scheduler.versions()


def _security(address: str) -> Any:  # noqa: ANN401 - Dask has no types
    """What Dask's settings say of certificates; who is reached by TLS leads us to nobody without."""
    from distributed import Security  # noqa: PLC0415 - slow to load

    return Security(require_encryption=True) if is_encrypted(address) else Security()


@contextmanager
def _client(make: Any, address: str) -> Iterator[Any]:  # noqa: ANN401 - Dask has no types
    try:
        client = make(address, timeout=CONNECT_S, set_as_default=False, security=_security(address))
    except (OSError, ValueError, ImportError, RuntimeError) as error:
        raise _nobody_answers(address) from error
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_S)


def _nobody_answers(address: str) -> HostError:
    return HostError(
        f"no Dask scheduler answers at {address} within {CONNECT_S:g} s",
        hint="start one there with `dask scheduler`, and look whether a firewall is between",
    )


def _check_scheduler(client: Any, address: str) -> None:  # noqa: ANN401 - Dask has no types
    """The scheduler reads what it hands on: it needs the same grader as the workers."""
    try:
        there = client.run_on_scheduler(worker.versions)
    except Exception as error:
        if not has_no_grader(error):
            raise _nobody_answers(address) from error
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


def _silence() -> None:
    """What Dask logs of lost connections is said by the grader where it matters."""
    for name in (
        "distributed",
        "distributed.client",
        "distributed.scheduler",
        "distributed.nanny",
        "tornado",
        "asyncio",
    ):
        logging.getLogger(name).setLevel(logging.CRITICAL)


@contextmanager
def _not_interrupted() -> Iterator[None]:
    """Processes that are started in here do not hear a Ctrl-C on the terminal: they are ended in order."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


# [classes.cluster.address] Which clusters `--cluster` may name: those where both ends show certificates, others only if that is asked for.

LOCAL = "local"
EXTRA = 'pip install "ros-lab-grader[cluster]"'
ENCRYPTED = ("tls", "wss")
"""Of Dask's protocols, those in which both ends show certificates."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://(\[[0-9A-Fa-f:.%]+\]|[^\s:/\[\]@]+):[0-9]{1,5}/?")


def check_address(text: str, *, insecure: bool = False) -> str:
    """What `--cluster` says: `tls://host:8786`, or `local`; with `insecure` also `tcp://host:8786` and its like.

    Raises UsageError for what is neither, and where Dask is missing.
    """
    if text != LOCAL and not _ADDRESS.fullmatch(text):
        raise UsageError(
            f"--cluster {text}: not the address of a Dask scheduler",
            hint="give tls://host:8786 as `dask scheduler` prints it, or `local`",
        )
    if text != LOCAL and not is_encrypted(text) and not insecure:
        raise UsageError(
            f"--cluster {text}: this scheduler asks for no certificate: "
            "all who reach its port can run programs as its user",
            hint="use tls:// (docs/how-to/cluster.md says how); where nobody else is in that network, "
            "add --cluster-insecure",
        )
    try:
        import cryptography  # noqa: F401, PLC0415 - only to know that it is there: `local` makes certificates
        import distributed  # noqa: F401, PLC0415 - as above
    except ImportError as error:
        raise UsageError(f"--cluster needs Dask: {error}", hint=EXTRA) from error
    return text


def is_encrypted(address: str) -> bool:
    """Whether who listens there, scheduler or worker, asks for a certificate."""
    return address.partition("://")[0] in ENCRYPTED
