"""The pages that are made from the code are up to date, and every one of them is among those that are made."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from scripts.reference import FOLDER, PAGES


@pytest.mark.parametrize(("name", "made"), PAGES.items(), ids=list(PAGES))
def test_a_page_is_up_to_date(name: str, made: Callable[[], str]) -> None:
    assert (FOLDER / name).read_text(encoding="utf-8") == made(), "run: make reference"


def test_pages_that_say_so_are_made() -> None:
    said = {page.name for page in FOLDER.glob("*.md") if "made from the" in page.read_text(encoding="utf-8")}
    assert PAGES.keys() <= said
