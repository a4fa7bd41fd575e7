"""Whoever starts the grader may ignore signals or hold them back: that changes neither the grading nor what is graded.

Sources of what is expected: man 2 execve (what is ignored and held back is handed on), man 2 waitpid (ECHILD).
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from grader import grade
from grader.arena import arena_process
from grader.arena.sandbox import why_no_sandbox
from grader.errors import HostError
from grader.portable import on_interrupt, own_session, wait_for_children
from tests.arena.support import printed, run_script
from tests.faulty import ROOT, RUBRIC, VICTIM, result_in
from tests.support.processes import lives

needs_sandbox = pytest.mark.skipif(bool(why_no_sandbox()), reason=f"no sandbox here: {why_no_sandbox()}")
DEAF = """
import os, signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
for number in (signal.SIGCHLD, signal.SIGHUP, signal.SIGTERM, signal.SIGUSR1):
    signal.signal(number, signal.SIG_IGN)
os.execv(sys.argv[1], sys.argv[1:])
"""


@pytest.mark.parametrize("before", [signal.SIG_DFL, signal.SIG_IGN, signal.default_int_handler])
def test_what_ctrl_c_did_before_a_block_it_does_after_it(before: signal.Handlers) -> None:
    own = signal.signal(signal.SIGINT, before)
    try:
        with on_interrupt(signal.SIG_IGN):
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGINT) is before
    finally:
        signal.signal(signal.SIGINT, own)


def deaf(*argv: str | Path) -> subprocess.CompletedProcess[str]:
    """A grader whose parent ignores some signals and holds all of them back."""
    command = [sys.executable, "-c", DEAF, sys.executable, "-m", "grader", *map(str, argv)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)


@contextmanager
def ignoring(*numbers: int) -> Iterator[None]:
    before = {number: signal.signal(number, signal.SIG_IGN) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.mark.ros
@needs_sandbox
def test_a_grader_whose_parent_hears_nothing_grades_in_a_sandbox(open_path: Path) -> None:
    done = deaf("grade", VICTIM, "--rubric", RUBRIC, "--out", open_path / "out", "--id", "ada")
    result = result_in(open_path / "out")
    assert (done.returncode, result.points) == (0, result.max_points), done.stderr
    assert result.environment.sandbox.startswith("bubblewrap")


@pytest.mark.full
@needs_sandbox
def test_the_doctor_finds_the_sandbox_then_too() -> None:
    done = deaf("doctor", "--json")
    assert '"--sandbox auto takes bubblewrap' in done.stdout, done.stdout + done.stderr


@pytest.mark.ros
@pytest.mark.parametrize("sandbox", ["auto", "none"])
def test_what_is_graded_hears_every_signal(tmp_path: Path, monkeypatch, sandbox: str) -> None:
    code = """
for line in open("/proc/self/status"):
    if line.startswith(("SigBlk", "SigIgn")):
        name, mask = line.split()
        print(name, [number for number in range(1, 32) if int(mask, 16) >> number - 1 & 1])
"""
    made: dict[tuple[object, ...], arena_process.Template] = {}
    monkeypatch.setattr(arena_process, "_templates", made)
    held = {signal.SIGTERM, signal.SIGCHLD, signal.SIGUSR2}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, held)
    try:
        with ignoring(signal.SIGHUP, signal.SIGUSR1, signal.SIGQUIT):
            run = run_script(tmp_path, code, sandbox=sandbox, limit_s=10)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for one in made.values():
            one.close()
    pythons_own = [signal.SIGPIPE.value, signal.SIGXFSZ.value]
    assert printed(run) == ["SigBlk: []", f"SigIgn: {pythons_own}"]


def test_a_program_that_ignores_its_children_gets_them_waited_for_while_it_grades(tmp_path: Path) -> None:
    codes: list[int] = []

    def told(*_: object) -> None:
        codes.append(subprocess.run(["/bin/sh", "-c", "exit 7"], check=False).returncode)

    with ignoring(signal.SIGCHLD):
        grade(VICTIM, RUBRIC, tmp_path, static_only=True, progress=told)
        assert signal.getsignal(signal.SIGCHLD) is signal.SIG_IGN
    assert set(codes) == {7}


def test_so_it_does_where_an_event_loop_runs(tmp_path: Path) -> None:
    async def main() -> str:
        return grade(VICTIM, RUBRIC, tmp_path, static_only=True).status

    with ignoring(signal.SIGCHLD):
        assert asyncio.run(main()) == "inconclusive"


def test_a_thread_that_cannot_change_it_says_so() -> None:
    caught: list[HostError] = []

    def work() -> None:
        try:
            with wait_for_children():
                pass
        except HostError as error:
            caught.append(error)

    with ignoring(signal.SIGCHLD):
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert "SIGCHLD" in caught[0].message
    assert "main thread" in caught[0].hint


def test_a_handler_of_the_program_stays() -> None:
    heard: list[int] = []
    before = signal.signal(signal.SIGCHLD, lambda number, _: heard.append(number))
    try:
        with wait_for_children():
            subprocess.run(["/bin/true"], check=True)
        assert heard
    finally:
        signal.signal(signal.SIGCHLD, before)


def test_ctrl_c_while_a_program_is_started_ends_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Python raises it between the start of the program and the line that would end it."""
    started: list[int] = []

    class Interrupted(subprocess.Popen):
        def __init__(self, *args, **options) -> None:
            super().__init__(*args, **options)
            started.append(self.pid)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with (
            pytest.raises(KeyboardInterrupt),
            own_session(["sleep", "3600"], cwd=tmp_path, env=dict(os.environ), stdout=1, stderr=2),
        ):
            pytest.fail("the interrupt was lost")
    finally:
        signal.signal(signal.SIGINT, before)
    assert not lives(started[0])
