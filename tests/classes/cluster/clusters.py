"""Clusters for tests: a scheduler and workers, each a process of its own, on the loopback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.support.processes import until

DASK = (sys.executable, "-m", "dask")
ROOT = Path(__file__).resolve().parents[3]


class Cluster:
    """A scheduler at `address`; `worker()` starts one more worker. With `tls` all of them show `certificates`."""

    def __init__(self, folder: Path, *, preload: str = "", tls: bool = False) -> None:
        self._folder = folder
        self.certificates = _certificates(folder) if tls else {}
        self._processes: list[subprocess.Popen[bytes]] = []
        address = folder / "address.json"
        self.scheduler, _ = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0",
            "--no-dashboard", "--scheduler-file", str(address), *self._tls(), *_preload(preload)
        )  # fmt: skip
        until(lambda: address.exists() and address.read_text().endswith("}"))
        self.address = str(json.loads(address.read_text())["address"])

    def worker(self, *, threads: int = 1, nanny: bool = False, preload: str = "") -> subprocess.Popen[bytes]:
        """Its process (that of its nanny, where it has one), once the scheduler knows it."""
        process, log = self._start(
            "worker", self.address, "--no-dashboard", "--nthreads", str(threads), "--memory-limit", "0",
            "--local-directory", str(self._folder), "--nanny" if nanny else "--no-nanny",
            *self._tls(), *_preload(preload)
        )  # fmt: skip
        until(lambda: b"Registered to" in log.read_bytes())
        return process

    def close(self) -> None:
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            with suppress(subprocess.TimeoutExpired):
                process.wait(10)
            process.kill()
            process.wait()

    def _tls(self) -> list[str]:
        """Options of `dask scheduler` and `dask worker`, as docs/how-to/cluster.md has them."""
        files = [f"--tls-{name}={path}" for name, path in self.certificates.items()]
        return ["--protocol=tls", *files] if files else []

    def _start(self, *args: str) -> tuple[subprocess.Popen[bytes], Path]:
        log = self._folder / f"{args[0]}-{len(self._processes)}.log"
        env = {**os.environ, "PYTHONPATH": str(ROOT)}
        with log.open("wb") as file:
            process = subprocess.Popen([*DASK, *args], stdout=file, stderr=file, cwd=self._folder, env=env)
        self._processes.append(process)
        return process, log


@contextmanager
def cluster(folder: Path, *, preload: str = "", tls: bool = False) -> Iterator[Cluster]:
    """Ended with everything that belongs to it."""
    made = Cluster(folder, preload=preload, tls=tls)
    try:
        yield made
    finally:
        made.close()


def _preload(name: str) -> list[str]:
    return ["--preload", f"tests.classes.cluster.preloads.{name}"] if name else []


def _certificates(folder: Path) -> dict[str, Path]:
    """Files for both ends; the certificate has signed itself, so it is the authority too."""
    from distributed.security import Security  # noqa: PLC0415 - takes half a second to load

    made = Security.temporary()
    files = {"ca-file": made.tls_ca_file, "cert": made.tls_client_cert, "key": made.tls_client_key}
    for name, text in files.items():
        (folder / name).write_text(str(text))
    return {name: folder / name for name in files}


def kill(pid: int) -> None:
    os.kill(pid, signal.SIGKILL)
