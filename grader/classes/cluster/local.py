"""A cluster on this machine for one batch, which other users of the machine can neither reach nor change.

Scheduler, nannies and workers listen on the loopback, where every user may knock: they speak TLS only, with
certificates that were made for this cluster and are in the memory of its processes alone. Dask's pages are off: it
opens their ports even where no dashboard is asked for.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask.config
import distributed
from distributed.security import Security

from grader.files import temporary_folder

THREADS_A_CORE = 4  # a grading waits most of the time
HOST, PROTOCOL = "127.0.0.1", "tls://"


class Scheduler(distributed.Scheduler):  # type: ignore[misc] # Dask has no types
    """Without a port for pages."""

    def start_http_server(self, *_: object, **__: object) -> None:
        """Nothing listens."""


class LocalWorker(distributed.Worker):  # type: ignore[misc] # Dask has no types
    """Without a port for pages."""

    def start_http_server(self, *_: object, **__: object) -> None:
        """Nothing listens."""


@contextmanager
def own_cluster() -> Iterator[Any]:
    """A `distributed.SpecCluster`; its certificates go with it."""
    security = Security.temporary()
    with temporary_folder("run") as folder, dask.config.set(_settings(folder)):
        cluster = distributed.SpecCluster(
            scheduler={"cls": Scheduler, "options": {**_listening(security), "dashboard": False}},
            workers={number: _nanny(security, folder) for number in range(os.cpu_count() or 1)},
            security=security,
            silence_logs=logging.CRITICAL,
        )
        with cluster:
            yield cluster


def _settings(folder: Path) -> dict[str, Any]:
    """Dask imports modules from its scratch folder, which is one in `/tmp` that another user may have made. A process
    is started by `spawn`, which hands over the certificates through a pipe."""
    return {"temporary-directory": str(folder), "distributed.worker.multiprocessing-method": "spawn"}


def _listening(security: Security) -> dict[str, Any]:
    return {"host": HOST, "protocol": PROTOCOL, "security": security}


def _nanny(security: Security, folder: Path) -> dict[str, Any]:
    options = {
        **_listening(security),
        "nthreads": THREADS_A_CORE,
        "memory_limit": 0,  # no limit: Dask's would end a worker with all that it grades
        "local_directory": str(folder),
        "silence_logs": logging.CRITICAL,
        "worker_class": LocalWorker,
        "dashboard": False,
    }
    return {"cls": distributed.Nanny, "options": options}
