"""A large class in a browser: each action of the class page and of the review shows what it should, and is timed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.timing import Timing
from tests.classes.review.a_class import INCONCLUSIVE, Who, a_class, overrides_of
from tests.classes.review.running import Server

COUNT = 300
GENEROUS_MS = 30_000
"""What no action may take on the busiest machine. How long they take is measured in benchmarks/README.md."""


def _who(number: int) -> Who:
    return Who(
        id=f"s{number:03}",
        name=f"Student {number}",
        recorded="dies-at-128" if number % 3 == 0 else "correct",
        changes={"chatter-rate": INCONCLUSIVE} if number % 10 == 1 else {},
        evidence=False,
    )


IDS = [f"s{number:03}" for number in range(COUNT)]
LOST = IDS[::3]
OPEN = IDS[1::10]


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    return a_class(tmp_path_factory.mktemp("class") / "out", [_who(number) for number in range(COUNT)])


@pytest.fixture
def took():
    """Takes each action's milliseconds; at the end they are printed."""
    found: dict[str, float] = {}
    yield found
    for what, ms in found.items():
        print(f"{what}: {ms:.0f} ms")
    assert found
    assert max(found.values()) < GENEROUS_MS


def _ids(page) -> list[str]:
    return page.locator("#submissions tbody tr").evaluate_all("rows => rows.map((row) => row.dataset.id)")


@pytest.mark.full
def test_each_action_of_the_class_page(visit, out, took, complaints) -> None:
    page = visit(out / "index.html")
    timing = Timing(page)
    took["open"] = timing.opening(page.url)
    assert _ids(page) == IDS[:100]
    took["sort by points"] = timing.changing(page.get_by_role("button", name="Points", exact=True).click)
    assert not set(_ids(page)) & set(LOST)
    took["sort by points, turned"] = timing.changing(
        page.get_by_role("button", name="Points", exact=True).click
    )
    assert sorted(_ids(page)) == LOST
    took["sort by submission"] = timing.changing(
        page.get_by_role("button", name="Submission", exact=True).click
    )
    assert _ids(page) == IDS[:100]
    took["next page"] = timing.changing(page.get_by_role("button", name="Next page").click)
    assert _ids(page) == IDS[100:200]
    page.get_by_role("searchbox").focus()
    took["search, one key"] = timing.changing(lambda: page.keyboard.press("7"), "keydown")
    assert _ids(page) == [one for one in IDS if "7" in one]
    page.get_by_role("searchbox").fill("")
    lost = page.locator("#filter-lost")
    took["filter by a lost criterion"] = timing.changing(
        lambda: lost.select_option(label="The counter resets to zero at 127"), "input"
    )
    assert _ids(page) == LOST
    common = page.locator("#diagnoses ~ ol > .diagnosis").first
    took["list the students with a common mistake"] = timing.changing(
        common.locator("summary").click,
        until="document.querySelector('.diagnosis[data-members] .members').childElementCount",
    )
    assert common.locator(".members a").all_inner_texts() == LOST
    took["show them in the table"] = timing.changing(
        common.get_by_role("button", name="Show them in the table").click
    )
    assert _ids(page) == LOST
    took["open a row"] = timing.following(page.locator("#submissions tbody a").nth(1).click)
    expect(page.get_by_role("main")).to_contain_text("The counter resets to zero at 127")
    assert page.url == (out / LOST[1] / "report.html").as_uri()
    assert complaints == [f"asked: {page.url}"]  # the one page that it was told to open
    complaints.clear()


def _through_the_pages(page, took, timing) -> None:
    """By keys over the end of a page and back, to a submission and back, and a search over all pages."""
    rows = page.locator("a.row")
    rows.last.focus()
    took["next page"] = timing.following(lambda: page.keyboard.press("j"), "keydown")
    assert rows.all_inner_texts() == IDS[100:200]
    expect(rows.first).to_be_focused()
    took["previous page"] = timing.following(lambda: page.keyboard.press("k"), "keydown")
    assert rows.all_inner_texts() == IDS[:100]
    expect(rows.last).to_be_focused()
    page.get_by_role("link", name="Next page").click()
    page.get_by_role("link", name="Next page").click()
    expect(rows.first).to_have_text(IDS[200])
    took["open a row of the last page"] = timing.following(rows.nth(50).click)
    expect(page.get_by_role("heading", level=1)).to_have_text(IDS[250])
    took["back to the list"] = timing.following(page.get_by_role("link", name="All", exact=True).click)
    assert rows.all_inner_texts() == IDS[200:]
    expect(rows.nth(50)).to_be_focused()
    page.get_by_role("searchbox").fill("ent 25")
    took["search"] = timing.following(lambda: page.keyboard.press("Enter"), "keydown")
    assert rows.all_inner_texts() == [IDS[25], *IDS[250:260]]


@pytest.mark.full
def test_each_action_of_the_review(visit, out, took) -> None:
    server = Server(out)
    page = visit(server.address)
    home = page.url
    timing = Timing(page)
    rows, heading = page.locator("a.row"), page.get_by_role("heading", level=1)
    took["list of the class"] = timing.opening(home)
    assert rows.all_inner_texts() == IDS[:100]
    _through_the_pages(page, took, timing)
    page.goto(home)
    took["one filter of it"] = timing.following(
        page.get_by_role("link", name=re.compile("^Not decided yet")).click
    )
    assert rows.all_inner_texts() == OPEN
    took["open a row"] = timing.following(rows.nth(1).click)
    expect(heading).to_have_text(OPEN[1])
    took["list by criterion"] = timing.opening(f"{home}criteria")
    style = page.get_by_role("row").filter(has_text="The code reads well")
    assert style.get_by_role("link").first.inner_text() == "The code reads well"
    took["open one criterion"] = timing.following(style.get_by_role("link").first.click)
    expect(heading).to_have_text(IDS[0])
    card = page.locator("#c-style")
    saved = "/^saved/.test(document.querySelector('#c-style .told').textContent)"
    card.get_by_label("Points").fill("7")
    save = card.get_by_role("button", name="Save", exact=True)
    took["save"] = timing.changing(save.click, until=saved)
    expect(card.locator(".of")).to_have_text("7 of 10")
    card.get_by_label("Points").fill("8")
    took["save, then next"] = timing.following(card.get_by_role("button", name="Save, then next").click)
    expect(heading).to_have_text(IDS[1])
    took["next"] = timing.following(lambda: page.keyboard.press("j"), "keydown")
    expect(heading).to_have_text(IDS[2])
    card.get_by_label("Points").fill("6")
    alike = card.get_by_role("button", name=re.compile("^Save for all"))
    many = int(re.search(r"\d+", alike.inner_text()).group())
    took[f"save for {many} in one go"] = timing.changing(alike.click, until=saved)
    points = [own["style"]["points"] for own in overrides_of(out).values()]
    assert sorted(points) == [6.0] * many + [8.0]
    assert many >= COUNT - 2
    took["take them back in one go"] = timing.changing(
        card.get_by_role("button", name="Take back all that were decided with it").click,
        until="document.querySelector('#c-style .of').textContent.startsWith('0 ')",
    )
    assert list(overrides_of(out)) == [IDS[0]]
    page.goto(f"{home}?c=style&show=decided")
    assert rows.all_inner_texts() == [IDS[0]]
    assert server.end()[0] == 0
