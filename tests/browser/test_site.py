"""The documents as a site: everyone can read them, in light and dark, on a desktop and a phone."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts.pages import ROOT
from tests.browser.conftest import DESKTOP, PHONE
from tests.docs.test_site import build_site

HANDLERS = """() => [...document.querySelectorAll("*")].flatMap((one) => [...one.attributes])
    .filter((one) => one.name.startsWith("on") || one.value.startsWith("javascript:")).map((one) => one.name)"""


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    assert build_site(ROOT, folder).returncode == 0
    return folder


@pytest.mark.full
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_every_page_is_accessible_and_loads_nothing_from_elsewhere(browser, axe, site, size, scheme) -> None:
    context = browser.new_context(
        viewport={"width": size.width, "height": size.height}, color_scheme=scheme, reduced_motion="reduce"
    )
    page, found, asked = context.new_page(), {}, []
    page.on("request", lambda request: asked.append(request.url))
    pages = sorted(path for path in site.rglob("*.html") if path.name != "404.html")
    for path in pages:
        page.goto(path.as_uri())
        found[str(path.relative_to(site))] = axe(page) + page.evaluate(HANDLERS)
    context.close()
    assert {url for url in asked if not url.startswith((site.as_uri(), "data:"))} == set()
    assert len(pages) > 30
    assert {name: faults for name, faults in found.items() if faults} == {}


@pytest.mark.full
def test_every_page_keeps_to_the_rules_of_html(validate, site) -> None:
    assert validate(*(path for path in site.rglob("*.html") if path.name != "404.html")) == []
