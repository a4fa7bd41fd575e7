"""Who killed a process: what is known of the machine decides, never against a student."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from grader.arena import arena_process, session
from grader.arena.session import Killed

INSIDE = {"signal": 9, "exit_code": 137, "stopped_by": None}
WALL = {"signal": 9, "exit_code": None, "stopped_by": None}


@pytest.fixture(autouse=True)
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Sets what the machine's files say: kills for want of memory, and the memory left in a hundred."""

    def says(kills: int, left: int) -> None:
        (tmp_path / "vmstat").write_text(f"nr_free_pages 7\noom_kill {kills}\n")
        (tmp_path / "meminfo").write_text(f"MemTotal: 100 kB\nMemFree: 1 kB\nMemAvailable: {left} kB\nBad\n")

    real = session.read_numbers
    monkeypatch.setattr(session, "read_numbers", lambda path: real(tmp_path / path.name))
    says(3, 50)
    return says


def suspect(*events: dict[str, object], sandboxed: bool = True) -> Killed:
    seen = Killed(sandboxed=sandboxed)
    for event in events:
        seen.ended({"name": "talker", **event})
    return seen


@pytest.mark.parametrize(
    "event",
    [
        {"signal": None, "exit_code": 1, "stopped_by": None},
        {"signal": 11, "exit_code": 139, "stopped_by": None},
        {"signal": 9, "exit_code": 137, "stopped_by": "KILL"},
    ],
)
def test_other_ends_are_no_matter(event) -> None:
    assert suspect(event).first(last_run=False) == ""


@pytest.mark.parametrize("event", [INSIDE, WALL])
def test_a_kill_is_not_believed_at_first(event) -> None:
    assert suspect(event).first(last_run=False) == "talker"


def test_who_is_killed_in_every_run_has_done_it_itself() -> None:
    assert suspect(INSIDE).first(last_run=True) == ""
    assert suspect(WALL, sandboxed=False).first(last_run=True) == ""


def test_nothing_inside_can_kill_the_wall() -> None:
    assert suspect(WALL).first(last_run=True) == "talker"


@pytest.mark.parametrize(("kills", "left"), [(4, 50), (3, 5)], ids=["the kernel killed", "little is left"])
def test_a_machine_without_memory_is_always_suspected(machine, kills: int, left: int) -> None:
    seen = suspect(INSIDE)
    machine(kills, left)
    assert seen.first(last_run=True) == "talker"


def test_a_limit_explains_the_kill() -> None:
    seen = suspect(INSIDE)
    seen.limited("talker")
    assert seen.first(last_run=False) == ""


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("g++: fatal error: Killed signal terminated program cc1plus", "talker"),
        ("[talker-2] process has died [pid 17, exit code -9, cmd /x/talker.py __name:=talker", "talker"),
        ("[talker-2] process has died [pid 17, exit code 1, cmd /x/talker.py", ""),
        ("Killed", ""),
    ],
)
def test_what_compiler_and_roslaunch_say_counts_until_they_are_stopped(line: str, name: str) -> None:
    seen, later = suspect(), suspect()
    seen.printed("talker", line)
    assert seen.first(last_run=False) == name
    later.stopping("talker")
    later.printed("talker", line)
    assert later.first(last_run=False) == ""


def test_a_machine_that_tells_nothing_is_suspected(tmp_path: Path) -> None:
    for name in ("vmstat", "meminfo"):
        (tmp_path / name).unlink()
    assert suspect(INSIDE).first(last_run=True) == "talker"


def test_a_late_answer_is_not_taken_for_that_to_the_next_request(monkeypatch) -> None:
    monkeypatch.setattr(arena_process, "ANSWER_S", 0.5)
    slow = """
import socket, struct, sys, time
sock = socket.socket(fileno=0)
for number in (1, 2):
    sock.recvmsg(64, 1024)
    time.sleep(0.7 if number == 1 else 0)
    sock.send(struct.pack("<id", number, 0.0))
"""
    template = arena_process.Template([sys.executable, "-c", slow], {})
    descriptor = os.open(os.devnull, os.O_RDONLY)
    try:
        template.forget(1)  # is not told that there was no answer
        with pytest.raises(OSError, match="Bad file descriptor"):
            template.start([descriptor])
    finally:
        os.close(descriptor)
        template.close()


def test_an_arena_that_comes_too_late_does_not_take_the_commands_of_the_next(monkeypatch) -> None:
    """Both have the same pipes: what asked for it has started another one with them."""
    monkeypatch.setattr(arena_process, "_templates", {})
    room = Path(arena_process.__file__).with_name("ros")
    code = f"""
import os, sys
sys.path.insert(0, {str(room)!r})
from importlib.machinery import SourceFileLoader
def live():
    while os.read(0, 1):
        os.write(1, b"%d" % os.getpid())
SourceFileLoader("room", {str(room / "__main__.py")!r}).load_module().stand_by(live, ())
"""
    argv = [sys.executable, "-c", code]
    late = arena_process.template_of(argv, {})
    late.forget(0)  # it has begun
    late._sock.settimeout(0.2)
    assert late._popen is not None
    os.kill(late._popen.pid, signal.SIGSTOP)
    (commands_r, commands), (output, output_w) = os.pipe(), os.pipe()
    template, pid, _ = arena_process.start_arena(argv, {}, [commands_r, output_w, output_w])
    os.kill(late._popen.pid, signal.SIGCONT)
    late.close()
    for _ in range(20):
        time.sleep(0.02)
        os.write(commands, b"x")
        assert int(os.read(output, 100)) == pid
    for descriptor in (commands, commands_r, output, output_w):
        os.close(descriptor)
    template.forget(pid)
    template.close()
