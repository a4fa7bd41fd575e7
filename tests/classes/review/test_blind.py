"""Marking without names: nothing in a page tells whose work it is, until it is published."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from grader.classes.batch.folder import open_batch
from grader.classes.feedback.publish import Publishing, publish
from grader.classes.review.app import create_app
from grader.classes.review.session import open_session
from grader.classes.review.submissions import Mask
from grader.rubric.load import load_rubric
from tests.classes.review.a_class import INCONCLUSIVE, Who, a_class, overrides_of
from tests.classes.review.conftest import PORT, QUICK, TOKEN, Page
from tests.classes.review.running import rows

TELLING = "in /home/qwilliam/lab1: see https://github.com/qwilliam/lab1, mail quentin.williams@example.org"
WHOS = (
    Who(
        id="qwilliam",
        name="Quentin Williams",
        group="Tuesday",
        changes={"chatter-rate": {**INCONCLUSIVE, "message": TELLING}},
    ),
    Who(id="zdoe-77", name="Zoe Doe", recorded="dies-at-128"),
    Who(id="xerxes", error="there is no package of Xerxes in it"),
)
SECRET = re.compile(
    r"qwilliam|quentin|williams|tuesday|zdoe|\bzoe\b|\bdoe\b|xerxes|github\.com|/gone", re.IGNORECASE
)


@pytest.fixture(scope="module")
def blind_class(tmp_path_factory) -> Path:
    return a_class(tmp_path_factory.mktemp("blind") / "out", WHOS)


@pytest.fixture
def blind(blind_class, tmp_path):
    out = Path(shutil.copytree(blind_class, tmp_path / "out"))
    review = open_session(out, QUICK)
    review.blind = True
    review.start()
    yield out, Page(create_app(review, port=PORT, token=TOKEN, author="Ann"))
    review.close()


def test_no_page_tells_who_it_is(blind) -> None:
    out, page = blind
    assert SECRET.search((out / "qwilliam" / "report.html").read_text())
    keys = rows(page.text("/"))
    assert sorted(keys) == ["submission-1", "submission-2", "submission-3"]
    paths = ["/", "/criteria", "/?c=style", "/?c=chatter-rate", "/comments"]
    for key in keys:
        paths += [
            f"/s/{key}/",
            f"/s/{key}/?c=style",
            f"/s/{key}/?c=chatter-rate",
            f"/s/{key}/?c=counter-wrap",
        ]
    for path in paths:
        assert SECRET.findall(page.text(path)) == [], path
    reports = [page.client.get(f"/s/{key}/report/report.html") for key in keys]
    assert sorted(answer.status_code for answer in reports) == [200, 200, 404]
    for answer in reports:
        assert SECRET.findall(answer.text) == []


@pytest.mark.parametrize(
    "path", ["/s/qwilliam/", "/s/qwilliam/report/report.html", "/s/qwilliam/evidence/package.mcap"]
)
def test_names_are_no_addresses(blind, path) -> None:
    assert blind[1].client.get(path).status_code == 404


def test_evidence_and_other_files_are_not_given(blind) -> None:
    _, page = blind
    for key in rows(page.text("/")):
        for name in ("evidence/package.mcap", "report/result.json", "report/console.log", "report/report.md"):
            assert page.client.get(f"/s/{key}/{name}").status_code == 404


def test_who_is_searched_for_is_not_found(blind) -> None:
    assert rows(blind[1].text("/?q=quentin")) == []
    assert len(rows(blind[1].text("/?q=submission"))) == 3


def test_a_decision_goes_to_the_right_one(blind) -> None:
    out, page = blind
    key = rows(page.text("/?c=chatter-rate&show=open"))[0]
    answer = page.save(key, "style", points="4")
    assert answer.status_code == 303
    assert "qwilliam" not in answer.location
    assert overrides_of(out)["qwilliam"]["style"]["points"] == 4
    assert SECRET.findall(page.text(f"/s/{key}/?c=style")) == []


def test_what_is_published_has_its_name(blind) -> None:
    out, page = blind
    batch = open_batch(out)
    publish(batch, load_rubric(batch.run.rubric_source), Publishing(only=("zdoe-77",)))
    keys = rows(page.text("/"))
    assert "zdoe-77" in keys
    assert len([key for key in keys if key.startswith("submission-")]) == 2
    assert "Zoe Doe" in page.text("/s/zdoe-77/")


def test_names_are_stable(blind_class) -> None:
    called = []
    for _ in range(2):
        review = open_session(blind_class, QUICK)
        review.blind = True
        called.append([(item.title, item.key) for item in review.items()])
    assert called[0] == called[1]
    assert called[0][0][0] == "Submission 1"


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("max(ada_lovelace, 3)", "max(…_…, 3)"),
        ("Adam and ADA", "Adam and …"),
        ("a.b@c.ac.uk wrote", "… wrote"),
        ("git@github.com:ada/lab.git", "…"),
        ("@decorator", "@decorator"),
    ],
)
def test_what_is_taken_out(text, left) -> None:
    assert Mask(frozenset({"ada", "lovelace"})).text(text) == left
