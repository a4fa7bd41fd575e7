"""Seconds of the wall and of the CPU, and the machine that they were measured on."""

from __future__ import annotations

import ctypes
import os
import platform
import re
import resource
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from benchmarks.figures import NotMeasured

TIMEOUT_S = 600.0
PR_SET_CHILD_SUBREAPER = 36
LEAVE_S, LOOK_S, PEAKS_S = 10.0, 0.02, 0.2


@dataclass(frozen=True, kw_only=True)
class Cost:
    """`cpu_s` is that of a process with all its children; `text` is what it printed."""

    wall_s: float
    cpu_s: float
    code: int = 0
    text: str = ""


class Meter:
    """Counts from its making on: wall, own CPU, and the CPU of all descendants that have ended since.

    The kernel adds a process's CPU to that of who waits for it. A process that outlives its parent comes to this one,
    which waits for it too: nothing is missed but what ended while its parent ignored SIGCHLD.
    """

    def __init__(self) -> None:
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        self._wall_s, self._own_s, self._children_s = time.monotonic(), time.process_time(), children_cpu_s()

    def wall_s(self) -> float:
        return time.monotonic() - self._wall_s

    def own_cpu_s(self) -> float:
        return time.process_time() - self._own_s

    def children_cpu_s(self) -> float:
        with suppress(ChildProcessError):  # there is none
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass  # it outlived its parent, and has ended
        return children_cpu_s() - self._children_s

    def all_cpu_s(self) -> float:
        """Return the CPU seconds of this process and all that it started. Raises NotMeasured where some still run."""
        until_s = time.monotonic() + LEAVE_S
        with suppress(ChildProcessError):  # nothing is left
            while time.monotonic() < until_s:
                if os.waitpid(-1, os.WNOHANG)[0] == 0:
                    time.sleep(LOOK_S)
            raise NotMeasured("some of what was started still runs, and its CPU is not counted")
        return self.own_cpu_s() + self.children_cpu_s()


def children_cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def timed(
    argv: Sequence[str],
    *,
    env: Mapping[str, str] | None = None,
    cwd: Path | None = None,
    codes: Sequence[int] = (0,),
) -> Cost:
    """Run it to its end. Raises NotMeasured where its exit code is another one."""
    meter = Meter()
    done = subprocess.run(
        argv, env=env, cwd=cwd, capture_output=True, text=True, check=False, timeout=TIMEOUT_S
    )
    cost = Cost(wall_s=meter.wall_s(), cpu_s=meter.children_cpu_s(), code=done.returncode, text=done.stdout)
    if done.returncode not in codes:
        last = (done.stderr + done.stdout).strip()[-400:]
        raise NotMeasured(f"{' '.join(argv[:5])} ended with {done.returncode}: {last}")
    return cost


@contextmanager
def peak_sizes(groups: Mapping[str, Callable[[], Iterable[int]]]) -> Iterator[dict[str, float]]:
    """Yield the largest resident size (MB) of a process of each group, kept up to date while the block runs."""
    found, ended = dict.fromkeys(groups, 0.0), threading.Event()

    def look() -> None:
        while not ended.wait(PEAKS_S):
            for name, processes in groups.items():
                found[name] = max(found[name], *map(_peak_mb, processes()), 0.0)

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield found
    finally:
        ended.set()
        thread.join()


def _peak_mb(pid: int) -> float:
    """Return the largest resident size that the process had; 0 where it has ended."""
    with suppress(OSError):
        if kb := re.search(r"VmHWM:\s*(\d+) kB", Path(f"/proc/{pid}/status").read_text()):
            return int(kb[1]) / 1e3
    return 0.0


def grader_workers(pid: int) -> Iterator[int]:
    """Yield the worker processes of a grader, and the one that they are copies of."""
    for listed in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, listed.read_text().split()):
                if b"grader.workers" in Path(f"/proc/{child}/cmdline").read_bytes():
                    yield child
                yield from grader_workers(child)


def machine() -> str:
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    cpu = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown CPU")
    day = datetime.now(timezone.utc).date().isoformat()
    return (
        f"{day}, {os.cpu_count()} cores ({cpu}), Linux {platform.release()}, "
        f"Python {platform.python_version()}"
    )


def load() -> float:
    """The load average of the last minute."""
    return os.getloadavg()[0]
