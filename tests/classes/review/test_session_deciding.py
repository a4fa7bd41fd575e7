"""What an instructor decides in the page stands in `overrides.yaml` at once, and results and gradebook follow."""

from __future__ import annotations

import csv
import json
from datetime import datetime

import pytest

from grader.classes.batch.run import hold_folder
from grader.classes.review.session import Pace, open_session
from grader.model.result import Override
from tests.classes.review.a_class import overrides_of, points_of, result_of
from tests.classes.review.conftest import QUICK

WAIT_S = 60


@pytest.mark.full
def test_points_of_a_manual_criterion_are_saved_at_once(page, out) -> None:
    answer = page.save("ada", "style", points="7.5", comment="clear names,\r\nlong functions")
    assert answer.status_code == 303
    assert overrides_of(out) == {
        "ada": {
            "style": {
                "points": 7.5,
                "comment": "clear names,\nlong functions",
                "author": "A. Miller",
                "date": datetime.now().astimezone().date(),
            }
        }
    }
    assert points_of(out, "ada", "style") == 7.5


def test_reports_follow_at_once_and_the_books_soon(page, out, review) -> None:
    before = result_of(out, "ada").points
    page.save("ada", "style", points="10", comment="")
    assert result_of(out, "ada").points == before + 10
    assert "A. Miller" in (out / "ada" / "report.md").read_text()
    assert review.background.wait(WAIT_S)
    with (out / "gradebook.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = {row["id"]: row for row in csv.DictReader(file)}
    assert float(rows["ada"]["points"]) == before + 10
    lines = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    assert next(line for line in lines if line["submission"]["id"] == "ada")["points"] == before + 10


def test_a_check_is_overridden_with_a_reason_only(page, out) -> None:
    bare = page.save("dana", "counter-wrap", points="10", comment=" ")
    assert bare.status_code == 400
    assert "Say why" in bare.text
    assert not (out / "overrides.yaml").exists()
    page.save("dana", "counter-wrap", points="5", comment="the handout was wrong")
    assert overrides_of(out)["dana"]["counter-wrap"]["comment"] == "the handout was wrong"
    assert points_of(out, "dana", "counter-wrap") == 5
    assert "The check says fail, 0 of" in page.text("/s/dana/")


def test_taking_back_gives_the_checks_points(page, out, review) -> None:
    before = points_of(out, "dana", "counter-wrap")
    page.save("dana", "counter-wrap", points="5", comment="x")
    page.save("dana", "counter-wrap", do="remove")
    assert overrides_of(out) == {}
    assert review.background.wait(60)
    assert points_of(out, "dana", "counter-wrap") == before
    assert result_of(out, "dana").overrides == ()


@pytest.mark.full
@pytest.mark.parametrize(
    ("points", "said"),
    [
        ("", "How many points?"),
        ("10.5", "at most 10 points"),
        ("-1", "Points are a number"),
        ("nan", "Points are a number"),
        ("inf", "Points are a number"),
        ("1e1", "Points are a number"),
        ("1_0", "Points are a number"),
        ("٣", "Points are a number"),
        ("<b>7</b>", "Points are a number"),
        ("9" * 400, "Points are a number"),
    ],
)
def test_points_that_are_none_are_named_and_what_was_typed_stays(page, out, points, said) -> None:
    answer = page.save("ada", "style", points=points, comment="my long comment")
    assert answer.status_code == 400
    assert said in answer.text
    assert "my long comment</textarea>" in answer.text
    assert not (out / "overrides.yaml").exists()


@pytest.mark.full
@pytest.mark.parametrize(("typed", "points"), [("7,5", 7.5), (" 3 ", 3), ("0", 0), ("10.", 10), (".5", 0.5)])
def test_points_as_people_type_them(page, out, typed, points) -> None:
    page.save("ada", "style", points=typed)
    assert overrides_of(out)["ada"]["style"]["points"] == points


def test_a_comment_that_is_too_long_is_named_and_stays(page, out) -> None:
    answer = page.save("ada", "style", points="3", comment="x" * 2001)
    assert answer.status_code == 400
    assert "At most 2000 characters" in answer.text
    assert not (out / "overrides.yaml").exists()


def test_a_comment_comes_back_as_it_was_typed(page, out) -> None:
    comment = "</textarea><script>alert(1)</script>\n\n\"quoted\" 'so' & ümläut: {a: 1} #x \u202eevil"
    page.save("ada", "style", points="3", comment=comment)
    assert overrides_of(out)["ada"]["style"]["comment"] == comment
    text = page.text("/s/ada/")
    assert "<script>alert" not in text
    again = page.send("ada", "style", page.form("ada", "style"), points="4", comment=comment)
    assert again.status_code == 303
    assert overrides_of(out)["ada"]["style"]["comment"] == comment


@pytest.mark.full
def test_the_author_is_remembered_in_the_session(page, app, out) -> None:
    csrf = page.form("ada", "style")["csrf"]
    answer = page.client.post("/author", data={"csrf": csrf, "author": "  Kim\nLee ", "key": "ada"})
    assert answer.headers["Location"] == "/s/ada/"
    page.save("ada", "style", points="1")
    page.save("dana", "style", points="2")
    assert overrides_of(out)["ada"]["style"]["author"] == "Kim Lee"
    assert overrides_of(out)["dana"]["style"]["author"] == "Kim Lee"
    other = type(page)(app)
    other.save("eve", "style", points="2")
    assert overrides_of(out)["eve"]["style"]["author"] == "A. Miller"


def test_save_then_next_goes_on_in_the_filter(page) -> None:
    form = page.form("ada", "style", "/s/ada/?show=inconclusive")
    answer = page.send("ada", "style", form, points="1", do="next")
    assert answer.headers["Location"] == "/s/eve/?show=inconclusive"


@pytest.mark.full
def test_what_left_the_filter_still_has_neighbours(page) -> None:
    page.save("dana", "style", points="1")
    page.save("dana", "answers", points="1")
    text = page.text("/s/dana/?show=manual")
    assert 'id="before" rel="prev" href="/s/ada/?show=manual"' in text
    assert 'id="after" rel="next" href="/s/eve/?show=manual"' in text


def test_the_script_is_told_what_changed(page) -> None:
    form = page.form("ada", "style")
    answer = page.send("ada", "style", form, script=True, points="7", comment="")
    told = answer.json
    assert answer.status_code == 200
    assert told["said"].startswith("saved ")
    assert "7 of 10" in told["head"]
    assert told["seen"] != form["seen"]
    again = page.send("ada", "style", {**form, "seen": told["seen"]}, script=True, points="8")
    assert again.status_code == 200


def test_an_overrides_file_with_faults_is_said_and_left_alone(page, out) -> None:
    form = page.form("ada", "style")
    (out / "overrides.yaml").write_text("ada: {style: {points: many}}\n")
    answer = page.send("ada", "style", form, points="3", comment="mine")
    assert answer.status_code == 422
    assert "overrides.yaml:1" in answer.text
    assert "mine</textarea>" in answer.text
    assert (out / "overrides.yaml").read_text() == "ada: {style: {points: many}}\n"
    assert "Nothing can be saved" in page.text("/s/ada/")


@pytest.mark.full
def test_comments_in_the_file_stay(page, out) -> None:
    (out / "overrides.yaml").write_text("# by hand\nada:\n  style: {points: 2}  # after talking to her\n")
    page.save("dana", "style", points="1")
    text = (out / "overrides.yaml").read_text()
    assert "# by hand" in text
    assert "# after talking to her" in text


def test_what_was_decided_by_hand_meanwhile_is_settled_when_the_review_begins(out, app, review) -> None:
    review.close()
    (out / "overrides.yaml").write_text("ada:\n  style: {points: 2}\n")

    again = open_session(out, QUICK)
    again.start()
    assert again.background.wait(WAIT_S)
    again.close()
    assert points_of(out, "ada", "style") == 2


def test_what_could_not_be_graded_can_be_given_points(page, out) -> None:
    page.save("fay", "style", points="4")
    assert points_of(out, "fay", "style") == 4
    assert result_of(out, "fay").status == "error"


def test_what_is_not_graded_yet_keeps_its_points_for_later(page, out) -> None:
    answer = page.send("gus", "style", page.form("gus", "style"), script=True, points="4")
    assert answer.status_code == 200
    assert "as soon as the submission has a result" in answer.json["said"]
    assert overrides_of(out)["gus"]["style"]["points"] == 4
    assert not (out / "gus").exists()


def test_while_a_batch_works_decisions_are_kept_and_applied_when_it_has_ended(page, out, review) -> None:
    assert review.background.wait(WAIT_S)
    form = page.form("ada", "style")
    with hold_folder(out):
        answer = page.send("ada", "style", form, script=True, points="6")
        assert "a batch is running in this folder" in answer.json["said"]
        assert overrides_of(out)["ada"]["style"]["points"] == 6
        assert points_of(out, "ada", "style") == 0
        assert "6 of 10" in page.text("/s/ada/")
    assert review.background.wait(WAIT_S)
    assert points_of(out, "ada", "style") == 6


@pytest.mark.full
def test_closing_writes_what_is_left(out) -> None:

    review = open_session(out, Pace(quiet_s=3600, latest_s=3600))
    review.start()
    item = review.submissions.item("ada")
    assert item is not None

    review.save(item, "style", Override(points=3), "")
    before = (out / "gradebook.csv").read_bytes()
    assert review.close()
    assert (out / "gradebook.csv").read_bytes() != before


def test_the_batchs_own_times_stay(page, out, review) -> None:
    before = json.loads((out / "run.json").read_text())
    page.save("ada", "style", points="3")
    assert review.background.wait(WAIT_S)
    after = json.loads((out / "run.json").read_text())
    assert after["ended_at"] == before["ended_at"]
    assert after["state"] == "complete"


def test_a_result_of_another_rubric_waits_for_it(page, out, review) -> None:
    assert review.background.wait(
        WAIT_S
    )  # it settles the class at its start, and would write the result as it was
    result = result_of(out, "ada")
    other = result.model_copy(update={"rubric": result.rubric.model_copy(update={"digest": "other"})})
    (out / "ada" / "result.json").write_text(other.model_dump_json(by_alias=True))
    answer = page.send("ada", "style", page.form("ada", "style"), script=True, points="4")
    assert "judged by another rubric" in answer.json["said"]
    assert overrides_of(out)["ada"]["style"]["points"] == 4
    assert result_of(out, "ada") == other


def test_a_review_beside_a_batch_that_is_ended_without_a_decision_leaves_nothing_undone(out) -> None:
    run = json.loads((out / "run.json").read_text())
    (out / "run.json").write_text(json.dumps(run | {"state": "running"}))
    (out / "gradebook.csv").unlink()
    review = open_session(out, QUICK)
    with hold_folder(out):
        assert review.batch_runs()
        review.start()
        assert review.close()
    assert not review.batch_runs()


@pytest.mark.full
def test_who_changes_their_mind_quickly_gets_the_last_of_it(page, out, review) -> None:
    form = page.form("ada", "style")
    for points in range(1, 11):
        answer = page.send("ada", "style", form, script=True, points=str(points))
        assert answer.status_code == 200
        form["seen"] = answer.json["seen"]
    assert review.background.wait(WAIT_S)
    assert overrides_of(out)["ada"]["style"]["points"] == 10
    assert points_of(out, "ada", "style") == 10
    assert ",10," in (out / "gradebook.csv").read_text()
