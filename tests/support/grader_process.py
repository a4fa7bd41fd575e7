"""A grader in a process of its own, and what it leaves."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class Grader:
    """Runs `grader` in processes that can be told from all others by their temporary folder."""

    def __init__(self) -> None:
        self.temporary = Path(tempfile.mkdtemp(prefix="grader-test-"))
        self.temporary.chmod(0o711)
        self.env = {**os.environ, "TMPDIR": str(self.temporary)}
        self.started: list[subprocess.Popen[str]] = []

    def start(self, *argv: str | Path, **env: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "grader", *map(str, argv)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**self.env, **env},
            cwd=ROOT,
            start_new_session=True,
        )
        self.started.append(process)
        return process

    def end(self) -> None:
        """What a failed test left running must not disturb the next."""
        for process in self.started:
            process.kill()
            process.communicate()
        shutil.rmtree(self.temporary)

    def run(self, *argv: str | Path, **env: str) -> tuple[int, str, str]:
        process = self.start(*argv, **env)
        out, err = process.communicate()
        return process.returncode, out, err

    def processes(self) -> list[str]:
        """Command lines of what still runs of ours: sandboxes name the temporary folder, arenas have it from us."""
        marker = str(self.temporary).encode()
        return [
            command.decode(errors="replace").replace("\0", " ")[:200]
            for pid in (path.name for path in Path("/proc").iterdir() if path.name.isdigit())
            if marker in (command := _read(pid, "cmdline")) or marker in _read(pid, "environ")
        ]

    def await_none(self, within_s: float) -> list[str]:
        """What is left when nothing is, or when the time is over."""
        deadline = time.monotonic() + within_s
        while (left := self.processes()) and time.monotonic() < deadline:
            os.sched_yield()
        return left


def _read(pid: str, name: str) -> bytes:
    try:
        return Path("/proc", pid, name).read_bytes()
    except OSError:  # it has ended since
        return b""
