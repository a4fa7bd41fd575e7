"""Every link and picture of the pages points to something that is there; `make links` asks other sites."""

from __future__ import annotations

import posixpath
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from scripts.pages import ROOT, anchors, external_links, links, pages


def faults(path: Path, page: str) -> list[str]:
    """The links of the page that lead nowhere."""
    return [f"{target}: {said}" for target in links(page) if (said := _fault(path, page, target))]


def _fault(path: Path, page: str, target: str) -> str:
    parts = urlsplit(target)
    if parts.scheme:
        well = parts.scheme == "mailto" or (parts.scheme in {"http", "https"} and "." in parts.netloc)
        return "" if well else "no address of a page"
    if parts.path.startswith("/"):
        return "begins at the root of the disk"
    there = ROOT / posixpath.normpath(path.relative_to(ROOT).parent / unquote(parts.path))
    if parts.path and (not there.is_relative_to(ROOT) or not there.exists()):
        return "is not there"
    if not parts.fragment:
        return ""
    text = page if not parts.path else there.read_text(encoding="utf-8")
    return "" if parts.fragment in anchors(text) else "has no such heading"


@pytest.mark.parametrize("path", pages(), ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path: Path) -> None:
    assert faults(path, path.read_text(encoding="utf-8")) == []


def test_a_link_that_leads_nowhere_is_found() -> None:
    page = (
        "# A title\n[a](docs/none.md) [b](#a-title) [c](#none) ![d](docs/none.png) [e](docs/index.md#none)\n"
        "[f](https://) [g](https://example.org/x) [h](/etc/passwd) [i](../out.md) [j](docs/index.md) `[k](none)`\n"
    )
    found = [fault.split(":")[0] for fault in faults(ROOT / "README.md", page)]
    assert found == [
        "docs/none.md",
        "#none",
        "docs/none.png",
        "docs/index.md#none",
        "https",
        "/etc/passwd",
        "../out.md",
    ]


def test_addresses_are_found() -> None:
    assert list(external_links("[a](https://a.org) <https://b.org> [c](c.md)")) == [
        "https://a.org",
        "https://b.org",
    ]


@pytest.mark.parametrize("folder", ["tutorials", "how-to", "reference", "explanation"])
def test_a_folder_s_first_page_leads_to_all_others(folder: str) -> None:
    there = {path.name for path in (ROOT / "docs" / folder).glob("*.md")} - {"index.md"}
    first = (ROOT / "docs" / folder / "index.md").read_text(encoding="utf-8")
    assert there - {target.partition("#")[0] for target in links(first)} == set()
