"""The documents as a site: everyone can read them, in light and dark, on a desktop and a phone."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts.pages import ROOT
from tests.browser.conftest import DESKTOP, PHONE
from tests.docs.test_site import build_site

WCAG = ("wcag2a", "wcag2aa", "wcag21a", "wcag21aa")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    assert build_site(ROOT, folder).returncode == 0
    return folder


@pytest.mark.full
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_every_page_is_accessible(browser, axe, site, size, scheme) -> None:
    context = browser.new_context(
        viewport={"width": size.width, "height": size.height}, color_scheme=scheme, reduced_motion="reduce"
    )
    page, found = context.new_page(), {}
    pages = sorted(path for path in site.rglob("*.html") if path.name != "404.html")
    for path in pages:
        page.goto(path.as_uri())
        found[str(path.relative_to(site))] = axe(page, *WCAG)
    context.close()
    assert len(pages) > 30
    assert {name: faults for name, faults in found.items() if faults} == {}
