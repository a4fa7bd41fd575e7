"""The review in a real browser: through the class, saving without a reload, two tabs, a report that is shut in."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import DESKTOP, PHONE
from tests.classes.review.a_class import CLASS, INCONCLUSIVE, Who, a_class, overrides_of
from tests.classes.review.running import Server

HOSTILE = (
    "<img src=x onerror=\"document.title='caught'\">\u202e</textarea><script>document.title='caught'</script>"
)
ON_PHONES = pytest.param(PHONE, marks=pytest.mark.full)
SIZES = pytest.mark.parametrize("size", [DESKTOP, ON_PHONES], ids=["desktop", "phone"])
ESCAPING = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>r</title></head><body>
<form id="f" method="post" action="{address}s/ada/c/style"><input name="points" value="10"></form>
<p id="out">began</p><script>
const tries = {{
  cookie: () => document.cookie,
  parent: () => parent.document.title,
  storage: () => localStorage.length,
  form: () => document.getElementById("f").submit(),
  top: () => {{ top.location = "{address}?hostile"; }},
  popup: () => open("{address}") ? "opened" : (() => {{ throw new Error("no") }})(),
}};
const found = {{}};
for (const [name, attempt] of Object.entries(tries)) {{
  try {{ found[name] = String(attempt()); }} catch (error) {{ found[name] = "refused"; }}
}}
fetch("{address}").then(() => {{ found.fetch = "fetched"; }}, () => {{ found.fetch = "refused"; }}).then(() => {{
  document.getElementById("out").textContent = JSON.stringify(found);
}});
</script></body></html>"""


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    hostile = Who(
        id="zoe", name=HOSTILE, group=HOSTILE, changes={"chatter-rate": {**INCONCLUSIVE, "message": HOSTILE}}
    )
    return a_class(tmp_path_factory.mktemp("class") / "out", (*CLASS, hostile))


@pytest.fixture
def out(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "out"))


@pytest.fixture
def server(out) -> Iterator[Server]:
    server = Server(out)
    yield server
    assert server.end()[0] == 0


@pytest.fixture
def opened(visit, server):
    """The page at a path, come in with the token."""

    def open_at(path: str = "", **given) -> Page:
        page = visit(server.address, **given)
        assert page.url == f"http://127.0.0.1:{server.port}/"
        if path:
            page.goto(page.url + path)
        return page

    return open_at


@SIZES
def test_through_the_class_and_save(opened, out, size) -> None:
    page = opened(size=size)
    page.get_by_role("link", name="Waiting for points").click()
    expect(page.locator("a.row")).to_have_count(4)
    page.get_by_role("link", name="ada", exact=True).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("ada")
    card = page.locator("#c-style")
    card.get_by_label("Points").fill("7.5")
    card.get_by_label("Comment").fill("clear names")
    expect(card.get_by_role("status")).to_have_text("not saved yet")
    card.get_by_role("button", name="Save", exact=True).click()
    expect(card.get_by_role("status")).to_have_text(re.compile(r"saved \d\d:\d\d:\d\d"))
    expect(card.locator(".of")).to_have_text("7.5 of 10")
    assert overrides_of(out)["ada"]["style"]["points"] == 7.5
    page.get_by_role("link", name="Next").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("dana")
    page.get_by_role("link", name="Previous").click()
    expect(page.locator("#c-style").get_by_label("Points")).to_have_value("7.5")
    report = page.frame_locator("#report")
    expect(report.get_by_text("clear names").first).to_be_attached()


@pytest.mark.full
def test_by_keyboard_alone(opened, out) -> None:
    page = opened()
    page.keyboard.press("j")
    page.keyboard.press("j")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("dana")
    page.wait_for_load_state()
    page.keyboard.press("e")
    page.keyboard.type("3")
    page.keyboard.press("Tab")
    page.keyboard.type("jk: too long")
    page.keyboard.press("Control+Enter")
    expect(page.locator("#c-style").get_by_role("status")).to_have_text(re.compile("^saved"))
    page.keyboard.press("Escape")
    page.keyboard.press("j")
    expect(page.get_by_role("heading", level=1)).to_have_text("eve")
    page.wait_for_load_state()
    page.keyboard.press("k")
    expect(page.get_by_role("heading", level=1)).to_have_text("dana")
    assert overrides_of(out)["dana"]["style"]["comment"] == "jk: too long"


@pytest.mark.full
def test_one_criterion_by_keyboard_alone(opened, out) -> None:
    page = opened("criteria")
    page.keyboard.press("j")
    page.keyboard.press("Enter")
    for name in ("ada", "dana"):
        expect(page.get_by_role("heading", level=1)).to_have_text(name)
        page.wait_for_load_state()
        page.keyboard.press("?")
        expect(page.get_by_role("dialog")).to_be_visible()
        page.keyboard.press("Escape")
        page.keyboard.press("e")
        page.keyboard.type("8")
        page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("eve")
    assert [overrides_of(out)[name]["style"]["points"] for name in ("ada", "dana")] == [8, 8]


@pytest.mark.full
def test_save_then_next(opened) -> None:
    page = opened("s/ada/?show=manual")
    card = page.locator("#c-style")
    card.get_by_label("Points").fill("1")
    card.get_by_role("button", name="Save, then next").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("dana")


@pytest.mark.full
def test_two_tabs_show_both_values(opened, out, complaints) -> None:
    one, two = opened("s/ada/"), opened("s/ada/")
    for page, points in ((one, "9"), (two, "2")):
        page.locator("#c-style").get_by_label("Points").fill(points)
        page.locator("#c-style").get_by_role("button", name="Save", exact=True).click()
        expect(page.locator("#c-style .told")).to_have_text(re.compile("^(saved|not saved$)"))
    expect(two.locator("#c-style").get_by_role("alert")).to_contain_text("9 points by Kim")
    expect(two.locator("#c-style").get_by_label("Points")).to_have_value("2")
    assert overrides_of(out)["ada"]["style"]["points"] == 9
    two.locator("#c-style").get_by_role("button", name="Save", exact=True).click()
    expect(two.locator("#c-style .told")).to_have_text(re.compile("^saved"))
    assert overrides_of(out)["ada"]["style"]["points"] == 2
    assert all("409" in said for said in complaints), complaints
    complaints.clear()


@pytest.mark.full
def test_taking_back(opened, out) -> None:
    page = opened("s/dana/")
    card = page.locator("#c-counter-wrap")
    card.locator("summary").click()
    card.get_by_label("Points").fill("5")
    card.get_by_label("Reason").fill("the handout was wrong")
    card.get_by_role("button", name="Save", exact=True).click()
    expect(card.locator(".of")).to_have_text("5 of 15")
    card.get_by_role("button", name="Back to the check").click()
    expect(card.locator(".of")).to_have_text("0 of 15")
    expect(card.get_by_label("Points")).to_have_value("")
    assert overrides_of(out) == {}


@pytest.mark.full
def test_without_javascript_everything_is_saved(browser, server, out) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(server.address)
    page.get_by_role("link", name="ada", exact=True).click()
    page.locator("#c-style").get_by_label("Points").fill("4")
    page.locator("#c-style").get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#c-style .told")).to_have_text(re.compile("^saved"))
    assert overrides_of(out)["ada"]["style"]["points"] == 4
    context.close()


@pytest.mark.full
def test_the_name_is_changed_in_the_page(opened, out) -> None:
    page = opened("s/ada/")
    page.get_by_text("You decide as").click()
    page.get_by_label("Your name").fill("Ruth")
    page.get_by_role("button", name="Remember").click()
    expect(page.locator(".author")).to_have_text("Ruth")
    page.locator("#c-style").get_by_label("Points").fill("4")
    page.locator("#c-style").get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#c-style .told")).to_have_text(re.compile("^saved"))
    assert overrides_of(out)["ada"]["style"]["author"] == "Ruth"


def test_hostile_text_stays_text(opened) -> None:
    page = opened()
    expect(page.get_by_role("row").last).to_contain_text("<img src=x")
    page.goto(page.url + "s/zoe/")
    card = page.locator("#c-style")
    card.get_by_label("Points").fill("4")
    card.get_by_label("Comment").fill(HOSTILE)
    card.get_by_role("button", name="Save", exact=True).click()
    expect(card.get_by_role("status")).to_have_text(re.compile("^saved"))
    page.reload()
    expect(card.get_by_label("Comment")).to_have_value(HOSTILE)
    assert "caught" not in page.title()
    assert page.locator("img").count() == 0


def test_a_hostile_report_reaches_nothing(opened, server, out, complaints) -> None:
    address = f"http://127.0.0.1:{server.port}/"
    (out / "ada" / "report.html").write_text(ESCAPING.format(address=address))
    page = opened("s/ada/")
    told = page.frame_locator("#report").locator("#out")
    expect(told).to_have_text(re.compile(r"^\{"))
    found = json.loads(told.text_content())
    assert {
        name: found[name] for name in ("cookie", "parent", "storage", "top", "popup", "fetch")
    } == dict.fromkeys(("cookie", "parent", "storage", "top", "popup", "fetch"), "refused")
    assert page.url == f"{address}s/ada/"
    assert not (out / "overrides.yaml").exists()
    complaints.clear()


@pytest.mark.full
def test_opened_by_a_file_of_its_user(visit, server, tmp_path, complaints) -> None:
    path = tmp_path / "open.html"
    path.write_text(
        f'<!doctype html><title>x</title><meta http-equiv="refresh" content="0; url={server.address}">'
    )
    page = visit(path)
    expect(page.get_by_role("heading", level=1)).to_contain_text("Lab 1")
    assert server.token not in page.url
    complaints.clear()


LOOKS = [(size, dark) for size in (DESKTOP, PHONE) for dark in (False, True)]


@pytest.mark.full
def test_the_pages_are_clean(opened, axe, validate, tmp_path) -> None:
    kept = []
    for path, size, dark in [
        (path, *look)
        for path in ("", "criteria", "s/dana/?c=style", "s/dana/", "s/fay/", "s/gus/")
        for look in LOOKS
    ]:
        page = opened(path, size=size, dark=dark)
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        assert axe(page) == []
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        kept.append(tmp_path / f"page-{len(kept)}.html")
        kept[-1].write_text(page.request.get(page.url).text(), encoding="utf-8")
    assert validate(*kept) == []
