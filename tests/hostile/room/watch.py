"""Runs the grader, and looks on: memory of its own processes, the disk, the time."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

LOOK_S = 0.02
OUTPUT_BYTES_MAX = 4 << 20
ARENA = b"/grader/arena/ros\0"
ARENA_DEPTH = 4


@dataclass(kw_only=True)
class Watched:
    """What a grading took. `exit_code` is negative for a signal; `late` says that its time ran out. `memory_bytes` is
    what the grader itself held, `machine_bytes` what the whole room took of the machine's memory."""

    exit_code: int = 0
    wall_s: float = 0.0
    late: bool = False
    memory_bytes: int = 0
    disk_bytes: int = 0
    machine_bytes: int = 0
    stdout: str = ""
    stderr: str = ""


@dataclass(frozen=True, kw_only=True)
class Used:
    """Ask for bytes that are taken: of the room's disk, and of the machine's memory."""

    disk: Callable[[], int]
    memory: Callable[[], int]


def watch(argv: Sequence[str], env: dict[str, str], uid: int, wall_s: float, used: Used) -> Watched:
    """Run it as the user `uid` to its end, or kill it when `wall_s` have passed."""
    seen, began, disk_before, memory_before = Watched(), time.monotonic(), used.disk(), used.memory()
    outputs = [os.memfd_create(name) for name in ("stdout", "stderr")]
    process = subprocess.Popen(
        argv, env=env, stdin=subprocess.DEVNULL, stdout=outputs[0], stderr=outputs[1], cwd=env["HOME"],
        user=uid, group=uid, extra_groups=[], start_new_session=True,
    )  # fmt: skip
    while not _ended(process):
        seen.memory_bytes = max(seen.memory_bytes, _memory_bytes(process.pid))
        seen.disk_bytes = max(seen.disk_bytes, used.disk() - disk_before)
        seen.machine_bytes = max(seen.machine_bytes, used.memory() - memory_before)
        if time.monotonic() - began > wall_s:
            seen.late = True
            process.kill()
    seen.exit_code, seen.wall_s = process.returncode, time.monotonic() - began
    seen.stdout, seen.stderr = (_text(descriptor) for descriptor in outputs)
    return seen


def _ended(process: subprocess.Popen[bytes]) -> bool:
    with suppress(subprocess.TimeoutExpired):
        process.wait(LOOK_S)
    return process.returncode is not None


def _text(descriptor: int) -> str:
    with os.fdopen(descriptor, "rb") as file:
        file.seek(0)
        return file.read(OUTPUT_BYTES_MAX).decode(errors="surrogateescape")


def _memory_bytes(pid: int) -> int:
    """The most that the grader itself and the arenas that are up have held, together."""
    return _peak_bytes(pid) + sum(map(_peak_bytes, _arenas(pid, ARENA_DEPTH)))


def _arenas(pid: int, depth: int) -> Iterator[int]:
    for child in _children(pid):
        command = _read(child, "cmdline")
        if ARENA in command and b"python" in command.partition(b"\0")[0]:
            yield from _children(child)  # it is the template, of which the arenas are copies
        elif depth:
            yield from _arenas(child, depth - 1)


def _children(pid: int) -> Iterator[int]:
    try:
        threads = os.listdir(f"/proc/{pid}/task")  # noqa: PTH208 - names alone
    except OSError:  # it has ended since
        return
    for thread in threads:
        yield from map(int, _read(pid, f"task/{thread}/children").split())


def _peak_bytes(pid: int) -> int:
    for line in _read(pid, "status").splitlines():
        if line.startswith(b"VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


def _read(pid: int, name: str) -> bytes:
    try:
        return Path("/proc", str(pid), name).read_bytes()
    except OSError:  # it has ended since
        return b""


def reap() -> None:
    """Orphans come to the room's first process."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            continue
