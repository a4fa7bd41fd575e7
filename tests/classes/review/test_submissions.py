"""One criterion across the class: the list of criteria, its submissions one after the other."""

from __future__ import annotations

import re

import pytest

from grader.classes.review.submissions import across
from tests.classes.review.a_class import overrides_of
from tests.classes.review.running import rows


def test_criteria_with_most_open_ones_first(page, review) -> None:
    found = across(review.submissions.items(), [("counter-wrap", "W"), ("chatter-rate", "R"), ("style", "S")])
    assert [(one.id, one.counts["open"], one.first) for one in found] == [
        ("style", 3, "ada"),
        ("chatter-rate", 1, "eve"),
        ("counter-wrap", 0, ""),
    ]
    assert found[2].counts["lost"] == 1
    text = page.text("/criteria")
    assert re.findall(r'class="row" href="([^"]+)"', text)[0] == "/s/ada/?c=style&amp;show=open"
    assert 'href="/?c=counter-wrap"' in text


@pytest.mark.parametrize(
    ("query", "names"),
    [
        ("c=style&show=open", ["ada", "dana", "eve"]),
        ("c=chatter-rate&show=open", ["eve"]),
        ("c=counter-wrap&show=lost", ["dana"]),
        ("c=style&show=decided", []),
        ("c=nothing&show=open", ["ada", "dana", "eve", "fay", "gus"]),
    ],
)
def test_the_list_of_one(page, query, names) -> None:
    assert rows(page.text(f"/?{query}")) == names


def test_only_its_card_is_shown(page) -> None:
    text = page.text("/s/dana/?c=counter-wrap")
    assert re.findall(r'data-criterion="([\w-]+)"', text) == ["counter-wrap"]
    assert 'src="/s/dana/report/report.html#criterion-' in text


def test_save_and_go_on_to_the_end(page, out) -> None:
    seen, path = [], "/s/ada/?c=style&show=open"
    while path.startswith("/s/"):
        key = path.split("/")[2]
        seen.append(key)
        form = page.form(key, "style", path)
        answer = page.send(key, "style", form, points="7", do="next")
        assert answer.status_code == 303
        path = answer.location
    assert (seen, path) == (["ada", "dana", "eve"], "/criteria")
    assert {name: found["style"]["points"] for name, found in overrides_of(out).items()} == {
        "ada": 7,
        "dana": 7,
        "eve": 7,
    }
    assert rows(page.text("/?c=style&show=decided")) == ["ada", "dana", "eve"]


@pytest.mark.full
def test_many_reports_are_written_by_other_processes(page, review, out, monkeypatch) -> None:
    monkeypatch.setattr("grader.classes.review.session.FEW", 0)
    form = page.form("ada", "style", "/s/ada/?c=style")
    page.client.post("/s/ada/c/style", data={**form, "points": "7", "comment": "All alike", "do": "alike"})
    assert review.background.wait(600)
    assert review.left() == 0
    for name in ("ada", "dana", "eve"):
        assert "All alike" in (out / name / "report.html").read_text()
    assert "All alike" in (out / "gradebook.csv").read_text()
