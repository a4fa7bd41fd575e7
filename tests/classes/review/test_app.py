"""What the pages show: the list, its filters, one submission; nobody's text becomes markup."""

from __future__ import annotations

import json
import re

import pytest

from grader.classes.overrides.write import write_override
from grader.classes.review.app import create_app
from grader.classes.review.cards import author_of
from grader.classes.review.session import open_session
from grader.classes.review.submissions import place_of
from grader.model.batch import RosterFault
from grader.model.result import Override
from tests.classes.review.a_class import INCONCLUSIVE, Who, a_class, overrides_of, result_of
from tests.classes.review.conftest import PORT, QUICK, TOKEN, Page
from tests.classes.review.running import rows

HOSTILE = "</td><script>alert(1)</script>\" onload='x' \u202e\u200bevil\x1b[2J"


@pytest.mark.full
@pytest.mark.parametrize(
    ("show", "names"),
    [
        ("all", ["ada", "dana", "eve", "fay", "gus"]),
        ("manual", ["ada", "dana", "eve"]),
        ("inconclusive", ["eve"]),
        ("error", ["fay", "gus"]),
        ("changed", []),
        ("<b>", ["ada", "dana", "eve", "fay", "gus"]),
    ],
)
def test_filters(page, show, names) -> None:
    assert rows(page.client.get("/", query_string={"show": show}).text) == names


def test_finding(page) -> None:
    assert rows(page.text("/?q=SCULLY")) == ["dana"]
    assert rows(page.text("/?q=eve&show=error")) == []
    assert "Nothing like that here" in page.text("/?q=nobody")


def test_a_submission_that_leaves_the_class_while_its_page_is_made_is_not_found(
    page, review, monkeypatch
) -> None:
    monkeypatch.setattr(review.submissions, "row", lambda _key: None)
    answer = page.client.get("/s/ada/")
    assert (answer.status_code, "The class has no such submission." in answer.text) == (404, True)


def test_what_changed_after_it_was_decided_is_found(page, out) -> None:
    page.save("ada", "chatter-rate", points="5", comment="lab machine")
    result = result_of(out, "ada")
    moved = result.overrides[0].model_copy(update={"changed": True})
    path = out / "ada" / "result.json"
    path.write_text(result.model_copy(update={"overrides": (moved,)}).model_dump_json(by_alias=True))
    assert rows(page.text("/?show=changed")) == ["ada"]
    assert "Look again" in page.text("/s/ada/")


def test_what_waits_comes_first_then_what_was_decided_then_the_rest(page) -> None:
    page.save("dana", "answers", points="3")
    text = page.text("/s/dana/")
    order = re.findall(r'id="c-([\w-]+)" data-criterion', text)
    assert order[:3] == ["style", "answers", "counter-wrap"]
    assert (
        text.index("Waiting for you") < text.index("Decided by a person") < text.index("All other criteria")
    )


def test_neighbours_at_both_ends(page) -> None:
    first, last = page.text("/s/ada/"), page.text("/s/gus/")
    assert 'id="before"' not in first
    assert 'href="/s/dana/"' in first
    assert 'id="after"' not in last
    assert "5 of 5" in last


def test_a_place_in_an_empty_class() -> None:
    place = place_of((), {"show": "manual", "q": "x" * 500, "page": "7"}, at="nobody")
    assert (place.before, place.after, place.position, place.total) == ("", "", 0, 0)
    assert (place.page, place.pages, place.rows) == (1, 1, [])
    assert len(place.q) == 100


@pytest.mark.parametrize(
    ("asked", "number", "names"),
    [
        ("", 1, ["ada", "dana"]),
        ("2", 2, ["eve", "fay"]),
        ("3", 3, ["gus"]),
        ("99", 3, ["gus"]),
        ("0", 1, ["ada", "dana"]),
        ("-1", 1, ["ada", "dana"]),
        ("٢", 1, ["ada", "dana"]),
    ],
)
def test_the_pages_of_a_long_list(page, monkeypatch, asked, number, names) -> None:
    monkeypatch.setattr("grader.classes.review.submissions.PAGE", 2)
    text = page.client.get("/", query_string={"page": asked}).text
    assert rows(text) == names
    first = 2 * number - 1
    assert f">{first} to {first + len(names) - 1} of 5<" in text
    assert ('rel="prev"' in text, 'rel="next"' in text) == (number > 1, number < 3)


def test_pages_keep_filter_and_words_and_are_found_again(page, review, monkeypatch) -> None:
    monkeypatch.setattr("grader.classes.review.submissions.PAGE", 2)
    text = page.text("/?show=manual&q=a&page=1")
    assert rows(text) == ["ada", "dana"]
    assert "Pages of the list" not in text
    text = page.text("/?show=manual")
    assert 'href="/?page=2&amp;show=manual"' in text
    assert rows(page.text("/?q=gus&page=1")) == ["gus"]
    assert 'href="/?page=2&amp;show=manual#row-eve"' in page.text("/s/eve/?show=manual")
    assert 'href="/#row-ada"' in page.text("/s/ada/")
    page.save("eve", "style", points="1")
    page.save("eve", "answers", points="1")
    assert review.background.wait(60)
    assert rows(page.text("/?show=manual&page=2")) == ["ada", "dana"]
    assert 'id="all" href="/?show=manual"' in page.text("/s/eve/?show=manual")


@pytest.mark.full
def test_hostile_names_stay_text(tmp_path) -> None:
    whos = (
        Who(
            id=HOSTILE,
            name=HOSTILE,
            group=HOSTILE,
            changes={"chatter-rate": INCONCLUSIVE | {"message": HOSTILE}},
        ),
        Who(id="a b/../../c?d#e%2f", name="x"),
    )
    faults = (RosterFault(where="roster.csv:9", id="../fault", text=HOSTILE),)
    out = a_class(tmp_path / "out", whos, faults)
    review = open_session(out, QUICK)
    review.start()
    page = Page(create_app(review, port=PORT, token=TOKEN, author=author_of(HOSTILE)))
    keys = rows(page.text("/"))
    assert len(keys) == 3
    for path in ["/", *(f"/s/{key}/" for key in keys), f"/?q={HOSTILE[:20]}"]:
        text = page.text(path)
        assert "<script>alert" not in text
        assert "\u202e" not in re.sub(r'value="[^"]*"', "", text)
        assert "\x1b" not in text
    for key in keys:
        assert re.fullmatch(r"[\w.-]+", key)
        assert page.save(key, "style", points="2", comment=HOSTILE).status_code == 303
    assert review.close()
    assert set(overrides_of(out)) == {HOSTILE, "a b/../../c?d#e%2f", "../fault"}
    assert not (tmp_path / "fault").exists()


def test_a_class_that_was_graded_again_is_seen(page, out) -> None:
    run = json.loads((out / "run.json").read_text())
    run["entries"] = run["entries"][:2]
    (out / "run.json").write_text(json.dumps(run))
    assert rows(page.text("/")) == ["ada", "dana"]


def test_a_decision_from_elsewhere_is_shown(page, out) -> None:
    write_override(
        out / "overrides.yaml", "ada", "style", Override(points=9, comment="by hand", author="Kim")
    )
    text = page.text("/s/ada/")
    assert "Decided by Kim" in text
    assert "by hand</textarea>" in text


def test_without_a_report_the_numbersays_so(page) -> None:
    assert "There is no report" in page.text("/s/gus/")


def test_the_report_of_an_older_batch_is_shown_as_text(page, out) -> None:
    (out / "ada" / "report.html").unlink()
    assert 'src="/s/ada/report/report.md"' in page.text("/s/ada/")
