from __future__ import annotations

import io
import threading

from rich.console import Console

from grader.cli.display import LiveSteps, PlainSteps, Steps


class Clock:
    """A clock that stands until it is moved."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def drawn(steps: LiveSteps) -> list[str]:
    out = io.StringIO()
    Console(file=out, width=80, markup=False).print(steps)
    return [line.rstrip() for line in out.getvalue().splitlines()]


def test_live_shows_what_runs_what_it_waits_for_and_how_long():
    clock = Clock()
    steps = LiveSteps(clock)
    steps.step("build", "running", "catkin_make", 4)
    steps.step("real-time", "waiting", "for the build", 9)
    clock.now_s = 1.5
    assert drawn(steps) == [
        "▶ build      running  1.5 s of about 4 s  catkin_make",
        "· real-time  waiting  takes about 9 s     for the build",
        "total                 1.5 s               about 9 s to go",
    ]
    steps.step("build", "done")
    clock.now_s = 6.0
    steps.step("real-time", "running", "waiting for the first message on /chatter\x1b[2J")
    clock.now_s = 8.0
    lines = drawn(steps)
    assert lines[0] == "✓ build      done     1.5 s"
    assert lines[1].startswith("▶ real-time  running  2.0 s of about 9 s  waiting for the first message on")
    assert lines[2].endswith("about 7 s to go")


def test_live_keeps_to_its_rows_and_leaves_out_what_ended_first():
    clock = Clock()
    steps = LiveSteps(clock, rows=4)
    for index in range(6):
        clock.now_s = float(index)
        steps.step(f"s{index}", "running")
        if index in {1, 3, 4}:
            steps.step(f"s{index}", "done")
    assert [line.split()[1] for line in drawn(steps)[:-1]] == ["s0", "s2", "s5"]
    steps.step("s0", "done")
    steps.step("s2", "done")
    assert [line.split()[1] for line in drawn(steps)[:-1]] == ["s0", "s2", "s5"]


def test_plain_lines_only_at_a_change_of_state():
    out = io.StringIO()
    clock = Clock()
    steps = PlainSteps(out, clock)
    steps.step("build", "running", "a", 4)
    steps.step("build", "running", "b")
    clock.now_s = 2.0
    steps.step("build", "failed", "line one\nline two")
    lines = out.getvalue().splitlines()
    assert [line.split("  ", 1)[1] if "  " in line else line for line in lines] == [
        "running  0.0 s of about 4 s  a",
        "failed  2.0 s  line one\\nline two",
    ]
    assert all(line[2] == line[5] == ":" for line in lines)


def test_any_thread_may_tell():
    steps = Steps()

    def tell(name: str) -> None:
        for _ in range(200):
            steps.step(name, "running", "x")
        steps.step(name, "done")

    threads = [threading.Thread(target=tell, args=(f"s{i}",)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {step.state for step in steps.snapshot()} == {"done"}
    assert len(steps.snapshot()) == 8
