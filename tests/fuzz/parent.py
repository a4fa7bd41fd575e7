"""Runs cases in a process of their own, so that a hang or a crash is a finding and not the end of the run."""

from __future__ import annotations

import json
import os
import re
import select
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tests.fuzz.loop import HEADER

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CPU_S, WALL_S, LOOK_S = 20.0, 200.0, 2.0
"""What a case may take that does not end by itself: on a busy machine little CPU takes long."""
TICKS_HZ = os.sysconf("SC_CLK_TCK")
Side = Literal["grader", "ros"]
COMMANDS: dict[Side, tuple[str, ...]] = {
    "grader": (sys.executable, "-m", "tests.fuzz.child"),
    "ros": ("/usr/bin/python3", "-s", "-B", str(HERE / "ros_child.py")),
}


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a case ended; `kind` is `fine`, `refused`, or one of a finding."""

    kind: str
    error: str = ""
    where: str = ""
    trace: str = ""
    cpu_s: float = 0.0
    memory_bytes: int = 0

    @property
    def finding(self) -> bool:
        return self.kind not in {"fine", "refused"}

    @property
    def signature(self) -> str:
        """The same for findings of one cause, as far as that can be told; fit for a file's name."""
        error = self.error.partition(":")[0] if self.kind == "raised" else ""
        return re.sub(r"\W+", "-", "-".join(filter(None, (self.kind, error, self.where))))

    @property
    def shape(self) -> str:
        """What the parser made of it: two refusals for the same reason look alike."""
        return f"{self.kind} {re.sub(r'[0-9]+', '0', self.error)[:60]}"

    def __str__(self) -> str:
        return f"{self.kind}: {self.error} in {self.where}\n{self.trace}"


class Runner:
    """One process for each side, started when it is first needed and again when it had to be ended."""

    def __init__(self) -> None:
        self._processes: dict[Side, subprocess.Popen[bytes]] = {}

    def run(self, side: Side, target: str, data: bytes) -> Outcome:
        process = self._process(side)
        pipe = process.stdin
        assert pipe is not None
        try:
            pipe.write(HEADER.pack(len(target), len(data)) + target.encode() + data)
            pipe.flush()
        except BrokenPipeError:
            return self._ended(side, Outcome(kind="died"))
        answer = self._answer(process)
        if answer is None:
            return self._ended(side, Outcome(kind="hang", error="no answer"))
        if not answer:
            return self._ended(side, Outcome(kind="died"))
        outcome = _outcome(json.loads(answer))
        return self._ended(side, outcome) if outcome.kind == "memory" else outcome

    def close(self) -> None:
        for side in list(self._processes):
            self._end(side)

    def _process(self, side: Side) -> subprocess.Popen[bytes]:
        if side not in self._processes:
            self._processes[side] = subprocess.Popen(
                COMMANDS[side], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
        return self._processes[side]

    @staticmethod
    def _answer(process: subprocess.Popen[bytes]) -> bytes | None:
        """A whole line; b"" where the process has ended, None where it takes too long."""
        pipe = process.stdout
        assert pipe is not None
        line, deadline_s, cpu_s = b"", time.monotonic() + WALL_S, _cpu_s(process.pid) + CPU_S
        while not line.endswith(b"\n"):
            if not select.select([pipe], [], [], LOOK_S)[0]:
                if time.monotonic() > deadline_s or _cpu_s(process.pid) > cpu_s:
                    return None
                continue
            piece = os.read(pipe.fileno(), 1 << 16)
            if not piece:
                return b""
            line += piece
        return line

    def _ended(self, side: Side, outcome: Outcome) -> Outcome:
        code = self._end(side)
        if outcome.kind != "died":
            return outcome
        return Outcome(kind="died", error=f"exit code {code}")

    def _end(self, side: Side) -> int:
        process = self._processes.pop(side)
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            return process.wait(0.5)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()


def _cpu_s(pid: int) -> float:
    """Of its user and system time (man 5 proc); 0 where it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICKS_HZ


def _outcome(answer: Mapping[str, object]) -> Outcome:
    fields = dict(answer)
    return Outcome(memory_bytes=fields.pop("bytes"), **fields)  # type: ignore[arg-type] # made by loop.py
