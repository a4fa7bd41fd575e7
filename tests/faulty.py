"""The grader in a process and mount namespace of its own, on which faults are inflicted."""

from __future__ import annotations

import os
import re
import selectors
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from grader.model.result import GradingResult
from tests.support.processes import children_of

ROOT = Path(__file__).resolve().parent.parent
VICTIM = ROOT / "tests" / "hostile" / "victim"
RUBRIC = ROOT / "tests" / "faulty.yaml"
ROOM = ("unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--propagation", "private")
WAIT_S = 60.0
LOOK_S = 0.01
GRADER = r"(?!unshare |sh ).*python\S* -m grader grade "
TAKEN = {"fail", "partial", "blocked"}


def why_not() -> str:
    """Empty where such namespaces can be made."""
    if os.geteuid() != 0:
        return "namespaces for faults need root"
    return "" if shutil.which("unshare") else "unshare is not installed"


class Grading:
    """A grader that runs. `setup` is what a shell does in its namespaces before."""

    def __init__(self, argv: Sequence[str | Path], setup: str, env: dict[str, str]) -> None:
        self.err = ""
        self.process = subprocess.Popen(
            [*ROOM, "sh", "-ec", f'{setup}\n"$@"', "sh", *map(str, argv)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=ROOT,
            env={**os.environ, **env},
        )

    def await_line(self, *words: str) -> None:
        """Read what it tells until a line holds all these words."""
        pipe = self.process.stderr
        assert pipe is not None
        deadline = time.monotonic() + WAIT_S
        with selectors.DefaultSelector() as selector:
            selector.register(pipe, selectors.EVENT_READ)
            while not any(all(word in line for word in words) for line in self.err.splitlines()):
                assert selector.select(deadline - time.monotonic()), f"no {words} in: {self.err}"
                chunk = os.read(pipe.fileno(), 1 << 16)
                assert chunk, f"it ended without {words}: {self.err}"
                self.err += chunk.decode(errors="replace")

    def await_process(self, pattern: str, *, copy: bool = False) -> int:
        """The id of the first process below it whose command line begins with what fits the pattern; with `copy`, of
        the first that such a process has made of itself."""
        deadline = time.monotonic() + WAIT_S
        while time.monotonic() < deadline:
            for pid in below(self.process.pid):
                if re.match(pattern, command(pid)):
                    copies = [child for child in below(pid) if re.match(pattern, command(child))]
                    if not copy or copies:
                        return copies[0] if copy else pid
            with suppress(subprocess.TimeoutExpired):
                code = self.process.wait(LOOK_S)
                raise AssertionError(f"it ended with {code} and never ran {pattern}")
        raise AssertionError(f"no process like {pattern}")

    def kill(self, pattern: str, *, copy: bool = False) -> None:
        """Kill such a process, as soon as there is one."""
        with suppress(ProcessLookupError):
            os.kill(self.await_process(pattern, copy=copy), signal.SIGKILL)

    def kill_around(self, pattern: str, around: str) -> None:
        """Kill the outermost process that is like `around` and runs such a process."""
        pid = self.await_process(pattern)
        found = []
        with suppress(FileNotFoundError):  # it has ended since
            while pid > 1:
                found += [pid] if re.match(around, command(pid)) else []
                pid = int(Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[1])
        assert found, f"nothing like {around} around {pattern}"
        with suppress(ProcessLookupError):
            os.kill(found[-1], signal.SIGKILL)

    def end(self) -> int:
        """Its exit code."""
        out, err = self.process.communicate(timeout=2 * WAIT_S)
        self.err += err.decode(errors="replace")
        self.out = out.decode(errors="replace")
        return self.process.returncode

    @property
    def said(self) -> list[str]:
        """The lines of the error that it ended with."""
        lines = self.err.splitlines()
        first = next((n for n, line in enumerate(lines) if line.startswith("grader: ")), len(lines))
        return lines[first:]


@contextmanager
def grading(
    out: Path,
    *,
    setup: str = "",
    prefix: Sequence[str] = (),
    source: Path | str = VICTIM,
    program: Sequence[str] = (),
    **env: str,
) -> Iterator[Grading]:
    """A grading of the victim into `out/ada`, which is killed where a test fails."""
    grader = list(program) or [sys.executable, "-m", "grader"]
    argv = [*prefix, *grader, "grade", source, "--rubric", RUBRIC, "--out", out, "--id", "ada"]
    running = Grading(argv, setup, env)
    try:
        yield running
    finally:
        running.process.kill()
        running.process.communicate()


def result_in(out: Path) -> GradingResult:
    return GradingResult.model_validate_json((out / "ada" / "result.json").read_bytes())


def marked_down(result: GradingResult) -> list[str]:
    """Criteria that a fault of the machine has cost: there must be none."""
    return [f"{c.id}: {c.status.value}: {c.message}" for c in result.criteria if c.status.value in TAKEN]


def below(pid: int) -> list[int]:
    """All that it started, and what those started."""
    return [found for child in children_of(pid) for found in (child, *below(child))]


def command(pid: int) -> str:
    try:
        return Path("/proc", str(pid), "cmdline").read_bytes().decode(errors="replace").replace("\0", " ")
    except OSError:
        return ""
