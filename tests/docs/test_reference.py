"""The pages that are made from the code are up to date, and every one of them is among those that are made."""

from __future__ import annotations

import pytest

from scripts.reference import FOLDER, PAGES, made


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return made()


def test_pages_are_up_to_date(pages: dict[str, str]) -> None:
    old = [name for name, text in pages.items() if (FOLDER / name).read_text(encoding="utf-8") != text]
    assert old == [], "run: make reference"


def test_pages_that_say_so_are_made(pages: dict[str, str]) -> None:
    said = {page.name for page in FOLDER.glob("*.md") if "made from the" in page.read_text(encoding="utf-8")}
    assert {*PAGES, "formats.md"} <= said <= {*pages, "index.md"}
