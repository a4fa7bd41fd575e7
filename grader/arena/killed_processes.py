"""Which processes of a run were killed, and not by the arena: that run says nothing about a student.

What is known of each process's end, and of the machine's memory, comes in; the name of a process that the machine may
have killed goes out.
"""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

from grader.arena.admission import MEMINFO, read_numbers

SHORT = 0.1
"""Where less than this part of the memory is available, helpers of the system (earlyoom, systemd-oomd) kill too."""
BELOW = re.compile(r"Killed signal terminated program|process has died \[pid \d+, exit code -9,")
"""What the compiler's driver and roslaunch say of a process of theirs that SIGKILL ended."""


class Killed:
    """The processes of one run that were killed, and not by the arena: by the kernel of a machine without memory, by
    a person, or by their own program. Those that broke a limit are not among them.

    A program that kills itself looks like one that is killed once. One that is killed in every run, while the
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
        """Take note that from now on the grader ends the process."""
        self._stopping.add(name)

    def starting(self, name: str) -> None:
        """Take note that from now on the process ends by itself again."""
        self._stopping.discard(name)

    def limited(self, name: str) -> None:
        self._limited.add(name)

    def printed(self, name: str, line: str) -> None:
        if name not in self._stopping and BELOW.search(line):
            self._names[name] = None

    def ended(self, record: dict[str, Any]) -> None:
        """Take note of a process's last event."""
        if record["signal"] == signal.SIGKILL and record["stopped_by"] is None:
            self._names[record["name"]] = None
            self._from_outside |= self._sandboxed and record["exit_code"] is None

    def first(self, *, last_run: bool) -> str:
        """Return the name of a process that the machine may have killed, or nothing."""
        own = last_run and not self._from_outside and not self._short_of_memory()
        return "" if own else next((name for name in self._names if name not in self._limited), "")

    def _short_of_memory(self) -> bool:
        return _kernel_kills() != self._kills_before or _available() < SHORT


def _kernel_kills() -> int:
    """Return how often this machine's kernel has killed a process for lack of memory
    (Documentation/filesystems/proc)."""
    return read_numbers(Path("/proc/vmstat")).get("oom_kill", 0)


def _available() -> float:
    """Return the part of this machine's memory that is available."""
    memory = read_numbers(MEMINFO)
    return memory.get("MemAvailable", 0) / memory.get("MemTotal", 1)
