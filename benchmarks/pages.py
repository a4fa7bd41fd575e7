"""The class page and the review in a real browser: from a person's event until what it changes is on the screen."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from benchmarks.figures import NotMeasured
from tests.browser.ground import chromium
from tests.browser.timing import Timing

Taken = Iterator[tuple[str, float]]
"""What was done, and the milliseconds that it took."""
DIAGNOSIS = "#diagnoses ~ ol > .diagnosis"


@contextmanager
def browser_page() -> Iterator[Page]:
    """A page in a window of its own. Raises NotMeasured where there is no browser."""
    if chromium() is None:
        raise NotMeasured("there is no Chromium: apt-get install chromium")
    with sync_playwright() as playwright:
        # Chromium's own sandbox does not work for root, and /dev/shm is small in containers.
        browser = playwright.chromium.launch(
            executable_path=chromium(), args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.set_default_timeout(60_000)
        yield page
        browser.close()


def class_page(page: Page, path: Path, times: int) -> dict[str, list[float]]:
    """Return the milliseconds of each action on the class page at `path`, done anew so many times."""
    return _collected(lambda timing: _class_page(page, timing, path), page, times)


def review(page: Page, address: str, times: int) -> dict[str, list[float]]:
    """Return the milliseconds of each action in the review at `address`, done anew so many times."""
    page.goto(address)
    home = page.url
    return _collected(lambda timing: _review(page, timing, home), page, times)


def _collected(visit: Callable[[Timing], Taken], page: Page, times: int) -> dict[str, list[float]]:
    timing, found = Timing(page), dict[str, list[float]]()
    for _ in range(times):
        for what, ms in visit(timing):
            found.setdefault(what, []).append(ms)
    return found


def _class_page(page: Page, timing: Timing, path: Path) -> Taken:
    yield "open it", timing.opening(path.absolute().as_uri())
    yield "sort by points", timing.changing(page.get_by_role("button", name="Points", exact=True).click)
    yield (
        "sort by submission",
        timing.changing(page.get_by_role("button", name="Submission", exact=True).click),
    )
    yield "next page of the table", timing.changing(page.get_by_role("button", name="Next page").click)
    page.get_by_role("searchbox").focus()
    yield "search, each key", timing.changing(lambda: page.keyboard.press("7"), "keydown")
    page.get_by_role("searchbox").fill("")
    lost = page.locator("#filter-lost")
    yield "filter by a lost criterion", timing.changing(lambda: lost.select_option(index=1), "input")
    first = page.locator(DIAGNOSIS).first
    filled = f"document.querySelector('{DIAGNOSIS} .members').childElementCount"
    yield (
        "list the students with a common mistake",
        timing.changing(first.locator("summary").click, until=filled),
    )
    shown = first.get_by_role("button", name="Show them in the table")
    yield "show them in the table", timing.changing(shown.click)
    page.get_by_role("button", name="Show all", exact=True).first.click()
    yield "open a row: its report", timing.following(page.locator("#submissions tbody a").first.click)


def _review(page: Page, timing: Timing, home: str) -> Taken:
    yield "list of the class", timing.opening(home)
    page.locator("a.row").last.focus()
    yield "next page of it, by key", timing.following(lambda: page.keyboard.press("j"), "keydown")
    page.get_by_role("searchbox").fill("7")
    yield "search in it", timing.following(lambda: page.keyboard.press("Enter"), "keydown")
    page.goto(home)
    yield (
        "one filter of it",
        timing.following(page.get_by_role("link", name=re.compile("^Waiting for points")).click),
    )
    page.goto(home)
    yield "open a row: a submission", timing.following(page.locator("a.row").first.click)
    yield "list by criterion", timing.opening(f"{home}criteria")
    open_one = page.locator("a.row").first
    yield "open one criterion of the first submission", timing.following(open_one.click)
    where, form = page.url, page.locator("form.decide").first
    told = "document.querySelector('form.decide .told').textContent"
    form.get_by_label("Points").fill("7")
    save = form.get_by_role("button", name="Save", exact=True)
    yield "save", timing.changing(save.click, until=f"/^saved/.test({told})")
    back = form.get_by_role("button", name="Take back", exact=True)
    gone = "document.querySelector('form.decide [value=remove]').hidden"
    yield "take it back", timing.changing(back.click, until=gone)
    form.get_by_label("Points").fill("8")
    yield (
        "save, and go to the next one",
        timing.following(form.get_by_role("button", name="Save, then").click),
    )
    yield "go to the next one", timing.following(lambda: page.keyboard.press("j"), "keydown")
    page.goto(where)
    back.click()
    back.wait_for(state="hidden")
