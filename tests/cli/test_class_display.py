"""What a batch says of its progress: counts, points so far, an honest guess of what is left."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from grader.classes.batch.job import SubmissionOutcome, _Steps
from grader.cli.class_display import LATELY, BatchProgress, LiveClass, PlainClass, summary


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def outcome(name: str, **more) -> SubmissionOutcome:
    return SubmissionOutcome(
        **{"id": name, "status": "graded", "points": 80.0, "max_points": 100.0, "wall_s": 2.0, **more}
    )


def test_counts_and_points_so_far() -> None:
    progress = BatchProgress()
    progress.planned(5)
    for name in ("a", "b", "c", "d"):
        progress.begun(name)
    progress.ended(outcome("a"))
    progress.ended(outcome("b", status="inconclusive", points=40.0))
    progress.ended(outcome("c", status="error", points=0.0))
    assert (progress.done, list(progress.running), progress.waiting) == (3, ["d"], 1)
    assert progress.mean_points == 60
    words = summary(progress)
    assert words.startswith(
        "3 of 5 done, 1 running, 1 waiting, 1 not decided yet, 1 failed; 60 points on average"
    )


def test_nothing_is_said_of_the_time_left_before_anything_is_known() -> None:
    progress = BatchProgress(clock=Clock())
    progress.planned(10)
    assert progress.left_s is None
    progress.ended(outcome("a", kept=True))
    progress.ended(outcome("b", kept=True))
    assert progress.left_s is None


@pytest.mark.parametrize("count", [10, 5 * LATELY])
def test_the_time_left_at_an_even_pace(count: int) -> None:
    clock = Clock()
    progress = BatchProgress(clock=clock)
    progress.planned(2 * count)
    for number in range(count):
        clock.now_s += 2.0
        progress.ended(outcome(str(number)))
    assert progress.left_s == pytest.approx(2.0 * count, rel=0.01)


def test_what_was_complete_does_not_make_the_rest_look_quick() -> None:
    clock = Clock()
    progress = BatchProgress(clock=clock)
    progress.planned(200)
    for number in range(100):
        clock.now_s += 0.01
        progress.ended(outcome(f"kept-{number}", kept=True, wall_s=0.01))
    for number in range(10):
        clock.now_s += 2.0
        progress.ended(outcome(str(number)))
    assert progress.left_s == pytest.approx(180, rel=0.05)


def test_a_log_has_a_line_for_each_submission_and_no_control_signs() -> None:
    stream = io.StringIO()
    shown = PlainClass(stream)
    shown.planned(2)
    shown.ended(outcome("ada\x1b[31m"))
    shown.ended(outcome("bob", status="error", message="::error::no package\n"))
    first, second = stream.getvalue().splitlines()
    assert "80/100" in first
    assert "\x1b" not in first
    assert "no package" in second
    assert "[2 of 2 done, 1 failed" in second


def test_a_log_of_thousands_has_a_line_for_each_hundredth_and_each_failure() -> None:
    stream = io.StringIO()
    shown = PlainClass(stream)
    shown.planned(10_000)
    for number in range(10_000):
        shown.ended(outcome(str(number), status="error" if number == 77 else "graded"))
    assert len(stream.getvalue().splitlines()) == 101


def test_a_terminal_shows_a_bar_what_runs_and_what_failed() -> None:
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=True, width=80, height=24)
    shown = LiveClass(console)
    shown.planned(30)
    for number in range(12):
        shown.begun(f"s{number}")
    shown.ended(outcome("s0", status="error", message="no package"))
    console.print(shown)
    text = stream.getvalue()
    assert "no package" in text
    assert "s1" in text
    assert "and 3 more" in text
    assert "1 of 30 done, 11 running, 18 waiting, 1 failed" in text


def test_a_run_that_is_made_again_is_counted_and_one_that_is_still_going_on_is_not() -> None:
    steps = _Steps()
    for name in ("intake", "build", "talker", "launch"):
        steps.step(name, "running")
        steps.step(name, "done")
    assert steps.again == 0
    steps.step("talker", "waiting", "to be run again")
    steps.step("talker", "running")
    assert steps.again == 0
    steps.step("talker", "done")
    steps.step("talker", "done")
    assert steps.again == 2
