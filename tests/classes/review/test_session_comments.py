"""Comments of the bank: given by their id, changed once for all; and one decision for all that are alike."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.classes.overrides import read_overrides
from grader.classes.review.app import create_app
from grader.classes.review.session import open_session
from grader.errors import RubricError
from grader.model.result import Override
from grader.model.verdict import Status
from tests.classes.overrides.samples import IDS, rubric
from tests.classes.review.a_class import Who, a_class, overrides_of, points_of, result_of
from tests.classes.review.conftest import PORT, QUICK, TOKEN, Page

WAIT_S = 60
BANK = """\
schema: grader.comments/1
style:
  names: {text: Names say nothing, points: 7}
  long: {text: Functions are long, change: -2}   # lecture 3
"""


def read(folder: Path, overrides: str, bank: str = BANK) -> dict[str, Override]:
    (folder / "comments.yaml").write_text(bank)
    (folder / "overrides.yaml").write_text(overrides)
    return dict(read_overrides(folder / "overrides.yaml", rubric(), IDS)["alice"])


@pytest.mark.parametrize(
    ("written", "points", "comment"),
    [
        ("comments: [long]", 8, "Functions are long"),
        ("comments: [names, long]", 5, "Names say nothing\nFunctions are long"),
        ("comments: [names], points: 9", 9, "Names say nothing"),
        ("comments: [names], comment: but well tested", 7, "Names say nothing\nbut well tested"),
        ("points: 3, comment: x", 3, "x"),
    ],
)
def test_what_an_override_comes_to(tmp_path, written, points, comment) -> None:
    found = read(tmp_path, f"alice: {{style: {{{written}}}}}")["style"]
    assert (found.points, found.comment) == (points, comment)


def test_points_stay_within_the_criterion(tmp_path) -> None:
    bank = "style:\n  good: {text: Very good, change: 20}\n  bad: {text: Very bad, change: -20}\n"
    assert read(tmp_path, "alice: {style: {comments: [good]}}", bank)["style"].points == 10
    assert read(tmp_path, "alice: {style: {comments: [bad]}}", bank)["style"].points == 0


@pytest.mark.parametrize(
    ("bank", "overrides", "fault"),
    [
        (
            BANK,
            "alice: {style: {comments: [name]}}",
            'there is no comment "name" of it in comments.yaml .did you mean',
        ),
        (BANK, "alice: {style: {comments: []}}", "points: "),
        ("styl:\n  a: {text: x}\n", "", 'comments.yaml:1: styl: there is no criterion "styl"'),
        ("style:\n  a: {text: x, points: 11}\n", "", "must be from 0 to 10, not 11"),
        ("style:\n  a: {text: x, points: 1, change: 1}\n", "", "has points and a change"),
        ("style:\n  A b: {text: x}\n", "", "style.A b"),
        ("schema: grader.comments/2\n", "", "a newer grader"),
    ],
)
def test_faults_are_named(tmp_path, bank, overrides, fault) -> None:
    with pytest.raises(RubricError) as caught:
        read(tmp_path, overrides, bank)
    assert any(re.search(fault, one) for one in caught.value.faults), caught.value.faults


@pytest.fixture
def csrf(page) -> str:
    return page.form("ada", "style")["csrf"]


def put(page, csrf: str, **fields: str):
    return page.client.post("/comments/style", data={"csrf": csrf, **fields})


def test_a_change_in_the_bank_changes_all_that_have_it(page, csrf, out, review) -> None:
    assert put(page, csrf, text="Names say nothing", points="7").status_code == 200
    for key in ("ada", "dana"):
        assert page.save(key, "style", bank="names-say-nothing", points="", comment="").status_code == 303
    page.save("eve", "style", points="9")
    answer = put(page, csrf, id="names-say-nothing", text="Names say too little", points="-1")
    assert "2 submissions with it" in answer.text
    assert review.background.wait(WAIT_S)
    assert [points_of(out, key, "style") for key in ("ada", "dana", "eve")] == [9, 9, 9]
    assert "Names say too little" in (out / "ada" / "report.html").read_text()
    assert overrides_of(out)["ada"]["style"]["comments"] == ["names-say-nothing"]
    assert "checked" in page.text("/s/ada/?c=style")


def test_a_change_by_hand_counts_too(page, csrf, out) -> None:
    put(page, csrf, text="Names", points="7")
    page.save("ada", "style", bank="names", points="")
    path = out / "comments.yaml"
    path.write_text(path.read_text().replace("points: 7", "points: 4"))
    assert "4 of 10" in page.text("/s/ada/?c=style")


@pytest.mark.parametrize("points", ["11", "seven", "--1"])
def test_a_wrong_comment_is_not_kept(page, csrf, out, points) -> None:
    assert put(page, csrf, text="Names", points=points).status_code == 400
    assert not (out / "comments.yaml").exists()


def test_one_decision_for_all_alike_and_back(page, out, review) -> None:
    form = page.form("dana", "style")
    page.save("eve", "style", points="2")
    assert page.send("dana", "style", form, points="6", do="alike").status_code == 303
    found = overrides_of(out)
    assert {key: one["style"]["points"] for key, one in found.items()} == {"ada": 6, "dana": 6, "eve": 2}
    assert review.background.wait(WAIT_S)
    assert result_of(out, "ada").overrides[0].points == 6
    page.save("ada", "style", points="7")
    assert page.send("dana", "style", page.form("dana", "style"), do="undo").status_code == 303
    assert {key: one["style"]["points"] for key, one in overrides_of(out).items()} == {"ada": 7, "eve": 2}


LATE = {"status": Status.INCONCLUSIVE, "points": 0.0, "message": "the machine was late"}
WHOS = (
    Who(id="ada", changes={"chatter-rate": LATE}),
    Who(id="dana", changes={"chatter-rate": LATE | {"message": "tf2_ros is not installed here"}}),
    Who(id="eve", changes={"chatter-rate": LATE}),
    Who(id="finn"),
)


def test_alike_is_what_its_own_check_said(tmp_path) -> None:
    out = a_class(tmp_path / "out", WHOS)
    page = Page(create_app(open_session(out, QUICK), port=PORT, token=TOKEN, author="A. Miller"))
    offers = {name: page.text(f"/s/{name}/?c=chatter-rate") for name in ("ada", "dana", "eve", "finn")}
    assert [name for name, text in offers.items() if "Save for all 2 alike" in text] == ["ada", "eve"]
    assert not any("Save for all" in offers[name] for name in ("dana", "finn"))


def test_one_that_is_decided_already_is_changed_with_those_alike(page, out) -> None:
    page.save("dana", "style", points="2")
    form = page.form("dana", "style")
    assert "Save for all 3 alike" in page.text("/s/dana/?c=style")
    assert page.send("dana", "style", form, points="6", do="alike").status_code == 303
    assert {one["style"]["points"] for one in overrides_of(out).values()} == {6}
    assert page.send("dana", "style", form, points="1", do="alike").status_code == 409
    assert {one["style"]["points"] for one in overrides_of(out).values()} == {6}
