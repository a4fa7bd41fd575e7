"""Who ended a process by SIGKILL: the kernel of a machine without memory, somebody on it, or its own program."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

SHORT = 0.1
"""Where less than this part of the memory is available, helpers of the system (earlyoom, systemd-oomd) kill too."""
BELOW = re.compile(r"Killed signal terminated program|process has died \[pid \d+, exit code -9,")
"""What the compiler's driver and roslaunch say of a process of theirs that SIGKILL ended."""


class Killed:
    """The processes of one run that were killed, and not by the arena; those that broke a limit are not among them.

    Nobody can tell a program that kills itself from one that is killed once. Who is killed in every run, while the
    machine has memory, has done it itself: nothing in a sandbox can kill the sandbox's own process.
    """

    def __init__(self, *, sandboxed: bool) -> None:
        self._sandboxed = sandboxed
        self._names: dict[str, None] = {}
        self._from_outside = False
        self._limited: set[str] = set()
        self._stopping: set[str] = set()
        self._kills_before = _kernel_kills()

    def stopping(self, name: str) -> None:
        """From now on it is the grader who ends it."""
        self._stopping.add(name)

    def limited(self, name: str) -> None:
        self._limited.add(name)

    def printed(self, name: str, line: str) -> None:
        if name not in self._stopping and BELOW.search(line):
            self._names[name] = None

    def ended(self, record: dict[str, Any]) -> None:
        """A process's last event."""
        if record["signal"] == signal.SIGKILL and record["stopped_by"] is None:
            self._names[record["name"]] = None
            self._from_outside |= self._sandboxed and record["exit_code"] is None

    def first(self, *, last_run: bool) -> str:
        """The name of one whom the machine may have killed, or nothing."""
        own = last_run and not self._from_outside and not self._short_of_memory()
        return "" if own else next((name for name in self._names if name not in self._limited), "")

    def _short_of_memory(self) -> bool:
        return _kernel_kills() != self._kills_before or _available() < SHORT


def _kernel_kills() -> int:
    """How often the kernel of this machine has killed a process for want of memory (Documentation/filesystems/proc)."""
    return _numbers("/proc/vmstat").get("oom_kill", 0)


def _available() -> float:
    """The part of this machine's memory that can be had."""
    memory = _numbers("/proc/meminfo")
    return memory.get("MemAvailable:", 0) / memory.get("MemTotal:", 1)


def _numbers(path: str) -> dict[str, int]:
    try:
        rows = [line.split() for line in Path(path).read_text().splitlines()]
    except OSError:
        return {}
    return {row[0]: int(row[1]) for row in rows if len(row) > 1 and row[1].isdecimal()}
