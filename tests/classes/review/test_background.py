"""What follows a decision is done soon, not at each of many, and not lost at the end."""

from __future__ import annotations

from threading import Event

from grader.classes.review.session import BackgroundWriter, Pace
from grader.errors import Busy

WAIT_S = 60


class Work:
    """Counts how often it is done; fails the first `failing` times."""

    def __init__(self, failing: int = 0) -> None:
        self.done, self.failing = 0, failing
        self.failed = Event()

    def __call__(self) -> None:
        if self.failing:
            self.failing -= 1
            self.failed.set()
            raise Busy("another batch works here")
        self.done += 1


def followed(work: Work, **pace: float) -> BackgroundWriter:
    writer = BackgroundWriter(work, Pace(**pace))
    writer.start()
    return writer


def test_many_changes_close_together_are_one() -> None:
    work = Work()
    writer = followed(work, quiet_s=0.3)
    for _ in range(100):
        writer.changed()
    assert writer.wait(WAIT_S)
    assert work.done == 1
    writer.close()


def test_who_never_rests_does_not_put_it_off_for_ever() -> None:
    work = Work()
    writer = followed(work, quiet_s=3600, latest_s=0.05)
    writer.changed()
    assert writer.wait(WAIT_S)
    assert work.done == 1
    writer.close()


def test_what_fails_is_tried_again() -> None:
    work = Work(failing=3)
    writer = followed(work, quiet_s=0.01, again_s=0.01)
    writer.changed()
    assert writer.wait(WAIT_S)
    assert (work.done, writer.trouble) == (1, "")
    writer.close()


def test_closing_does_what_is_left_at_once() -> None:
    work = Work()
    writer = followed(work, quiet_s=3600, latest_s=3600)
    writer.changed()
    assert writer.close()
    assert work.done == 1


def test_closing_with_nothing_left_does_nothing() -> None:
    work = Work()
    assert followed(work).close()
    assert work.done == 0


def test_closing_says_what_could_not_be_done() -> None:
    work = Work(failing=1000)
    writer = followed(work, quiet_s=0.01, again_s=3600, closing_s=0.01)
    writer.changed()
    assert work.failed.wait(WAIT_S)
    assert not writer.close()
    assert writer.trouble == "another batch works here"


def test_closing_waits_for_another_that_works_in_the_folder() -> None:
    work = Work(failing=3)
    writer = followed(work, quiet_s=3600, latest_s=3600, again_s=0.01)
    writer.changed()
    assert writer.close()
    assert work.done == 1
