"""What follows a decision is done soon and never lost, also with two tabs and two people."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest

from grader.classes.overrides.write import write_override
from grader.classes.review.app import create_app
from grader.classes.review.session import BackgroundWriter, Pace, open_session
from grader.errors import Busy
from grader.model.result import Override
from tests.classes.review.a_class import overrides_of
from tests.classes.review.conftest import PORT, QUICK, TOKEN, Page

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


def test_the_second_one_sees_both_values(page, app, out) -> None:
    other = Page(app)
    mine, theirs = page.form("ada", "style"), other.form("ada", "style")
    other.send("ada", "style", theirs, points="9", comment="very good")
    answer = page.send("ada", "style", mine, points="2", comment="poor")
    assert answer.status_code == 409
    assert "9 points by A. Miller: very good" in answer.text
    assert "2 points: poor" in answer.text
    assert 'value="2"' in answer.text
    assert "poor</textarea>" in answer.text
    assert overrides_of(out)["ada"]["style"]["points"] == 9


@pytest.mark.full
def test_saving_again_after_that_is_a_decision(page, app, out) -> None:
    other = Page(app)
    mine = page.form("ada", "style")
    other.save("ada", "style", points="9")
    clash = page.send("ada", "style", mine, script=True, points="2")
    assert clash.status_code == 409
    assert "Not saved" in clash.json["notes"]
    answer = page.send("ada", "style", {**mine, "seen": clash.json["seen"]}, script=True, points="2")
    assert answer.status_code == 200
    assert overrides_of(out)["ada"]["style"]["points"] == 2


def test_removing_what_another_tab_changed_is_a_clash(page, app, out) -> None:
    page.save("ada", "style", points="5")
    mine = page.form("ada", "style")
    Page(app).save("ada", "style", points="6")
    assert page.send("ada", "style", mine, do="remove").status_code == 409
    assert overrides_of(out)["ada"]["style"]["points"] == 6


@pytest.mark.full
def test_changing_what_another_tab_removed_is_a_clash(page, app, out) -> None:
    page.save("ada", "style", points="5")
    mine = page.form("ada", "style")
    Page(app).save("ada", "style", do="remove")
    answer = page.send("ada", "style", mine, points="6")
    assert answer.status_code == 409
    assert "it was taken back" in answer.text
    assert overrides_of(out) == {}


def test_an_edit_by_hand_counts_as_another_tab(page, out) -> None:
    mine = page.form("ada", "style")
    write_override(out / "overrides.yaml", "ada", "style", Override(points=1, author="hand"))
    assert page.send("ada", "style", mine, points="6").status_code == 409
    assert overrides_of(out)["ada"]["style"]["points"] == 1


def test_the_same_twice_is_no_clash(page, out) -> None:
    mine = page.form("ada", "style")
    assert page.send("ada", "style", mine, points="6").status_code == 303
    assert page.send("ada", "style", mine, points="6").status_code == 303
    assert overrides_of(out)["ada"]["style"]["points"] == 6


def test_different_criteria_are_no_clash(page, app, out) -> None:
    other = Page(app)
    mine, theirs = page.form("ada", "style"), other.form("ada", "answers")
    other.send("ada", "answers", theirs, points="9")
    assert page.send("ada", "style", mine, points="2").status_code == 303
    assert {k: v["points"] for k, v in overrides_of(out)["ada"].items()} == {"style": 2, "answers": 9}


@pytest.mark.full
def test_of_many_at_once_one_wins_and_all_others_are_told(app, out) -> None:
    tabs = [Page(app) for _ in range(6)]
    forms = [tab.form("ada", "style") for tab in tabs]
    with ThreadPoolExecutor(len(tabs)) as pool:
        answers = list(
            pool.map(
                lambda i: tabs[i].send("ada", "style", forms[i], script=True, points=str(i)).status_code,
                range(len(tabs)),
            )
        )
    assert sorted(answers) == [200, 409, 409, 409, 409, 409]
    assert overrides_of(out)["ada"]["style"]["points"] == answers.index(200)


def test_two_reviews_of_one_class_do_not_lose_anything(page, out) -> None:

    second = open_session(out, QUICK)
    second.start()
    other = Page(create_app(second, port=PORT, token=TOKEN, author="Kim"))
    mine, theirs = page.form("ada", "style"), other.form("ada", "style")
    with ThreadPoolExecutor(2) as pool:
        one = pool.submit(page.send, "ada", "style", mine, script=True, points="1")
        two = pool.submit(other.send, "ada", "style", theirs, script=True, points="2")
        assert sorted([one.result().status_code, two.result().status_code]) == [200, 409]
    second.close()
