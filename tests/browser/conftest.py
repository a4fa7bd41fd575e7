"""A real browser for tests: pages are opened from files and from loopback, and may say nothing and ask for nothing.

The browser lives as long as this package's tests: Playwright's loop would be in the way of others.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, Protocol
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, expect, sync_playwright

from tests.browser import ground

expect.set_options(timeout=60_000)  # how busy the machine is says nothing of a page
LOOPBACK = {"127.0.0.1", "localhost", "::1"}


class Size(NamedTuple):
    width: int
    height: int


DESKTOP, PHONE = Size(1280, 900), Size(390, 844)


class Visit(Protocol):
    """Opens a file or an address in a window of its own."""

    def __call__(self, place: Path | str, *, size: Size = DESKTOP, dark: bool = False) -> Page: ...


def need_ground() -> None:
    """Skip where the browser or a tool is missing; where CI says that it is CI, that is a failure."""
    why = ground.missing()
    if why is not None and os.environ.get("CI", "").lower() in {"true", "1"}:
        pytest.fail(why, pytrace=False)
    if why is not None:
        pytest.skip(why)


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Chromium, headless."""
    need_ground()
    with sync_playwright() as playwright:
        # Chromium's own sandbox does not work for root, and /dev/shm is small in containers.
        chromium = playwright.chromium.launch(
            executable_path=ground.chromium(), args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        yield chromium
        chromium.close()


@pytest.fixture
def complaints() -> list[str]:
    """What the pages of a test said on their console, threw and asked others for, so far. A test that
    provokes one takes it out."""
    return []


@contextmanager
def _visits(browser: Browser, complaints: list[str]) -> Iterator[Visit]:
    contexts = []

    def open_page(place: Path | str, *, size: Size = DESKTOP, dark: bool = False) -> Page:
        context = browser.new_context(
            viewport={"width": size.width, "height": size.height},
            color_scheme="dark" if dark else "light",
            reduced_motion="reduce",
            accept_downloads=True,
        )
        contexts.append(context)
        context.set_default_timeout(600_000)
        page = context.new_page()
        address = place.absolute().as_uri() if isinstance(place, Path) else place
        _watch(page, address, complaints)
        page.goto(address)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.fixture
def visit(browser: Browser, complaints: list[str]) -> Iterator[Visit]:
    """Opens pages; at the end none of them may have complained."""
    with _visits(browser, complaints) as open_page:
        yield open_page


@pytest.fixture(scope="module")
def visit_once(browser: Browser) -> Iterator[Visit]:
    """The same, for a page that several tests look at and none changes."""
    with _visits(browser, []) as open_page:
        yield open_page


@pytest.fixture
def axe(browser: Browser) -> Callable[..., list[str]]:
    """What axe has against a page as it is now, a line for each rule and place; with tags, by the rules of these."""
    source = ground.AXE.read_text(encoding="utf-8")

    def violations(page: Page, *tags: str) -> list[str]:
        page.evaluate(source)
        options = {"resultTypes": ["violations"], **({"runOnly": list(tags)} if tags else {})}
        found = page.evaluate("(options) => axe.run(options)", options)
        return [
            f"{rule['id']}: {node['target']} {node['failureSummary']}"
            for rule in found["violations"]
            for node in rule["nodes"]
        ]

    return violations


@pytest.fixture
def validate(browser: Browser) -> Callable[..., list[str]]:
    """What html-validate has against files, a line each."""
    return ground.validate


def _watch(page: Page, address: str, complaints: list[str]) -> None:
    def said(message: ConsoleMessage) -> None:
        if message.type in {"error", "warning", "assert"}:
            complaints.append(f"console: {message.text}")

    page.on("console", said)
    page.on("pageerror", lambda error: complaints.append(f"thrown: {error}"))
    page.on(
        "request", lambda request: _own(request.url, address) or complaints.append(f"asked: {request.url}")
    )


def _own(asked: str, address: str) -> bool:
    """Whether a page may ask for that: itself, what it holds already, and its own server on loopback."""
    to, own = urlsplit(asked), urlsplit(address)
    if to.scheme in {"data", "blob", "about"}:
        return True
    if own.scheme == "file":
        return asked.partition("#")[0] == address.partition("#")[0]
    return (to.scheme, to.netloc) == (own.scheme, own.netloc) and to.hostname in LOOPBACK
