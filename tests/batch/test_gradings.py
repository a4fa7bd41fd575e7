"""What a batch learns of each grading."""

from __future__ import annotations

from grader.classes.batch.gradings import _Steps


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
