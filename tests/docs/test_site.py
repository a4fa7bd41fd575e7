"""The site is built from the pages alone, loads nothing from anywhere, and no fault of a page goes by unnoticed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from lxml import html

from scripts.mkdocs_hooks import on_page_content
from scripts.pages import ROOT

LOADS = (
    "//script/@src",
    "//link[@rel='stylesheet' or @rel='icon' or @rel='preconnect']/@href",
    "//img/@src",
    "//iframe/@src",
)
FAULTS = {
    "a page that is not there": ("[a](none.md)", "none.md"),
    "a heading that is not there": ("[a](index.md#none)", "#none"),
    "a picture that is not there": ("![a](none.png)", "none.png"),
    "an address on the disk": ("[a](/none/)", "/none/"),
}


def build_site(repository: Path, site: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", site],
        cwd=repository,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    done = build_site(ROOT, folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.full
def test_every_page_is_in_the_navigation(site: Path) -> None:
    start = html.parse(site / "index.html")
    found = {str(target).partition("#")[0] for target in start.xpath("//nav//a/@href")}
    pages = {
        path.relative_to(ROOT / "docs").with_suffix(".html").as_posix()
        for path in (ROOT / "docs").rglob("*.md")
    }
    assert pages - found == set()


@pytest.mark.full
def test_nothing_is_loaded_from_anywhere(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    loaded = {
        f"{page.name}: {target}"
        for page in pages
        for wanted in LOADS
        for target in html.parse(page).xpath(wanted)
        if "//" in target
    }
    assert len(pages) > 20
    assert loaded == set()


@pytest.mark.full
def test_no_page_asks_for_a_diagram_that_would_be_drawn_by_a_script_from_elsewhere(site: Path) -> None:
    assert [
        page.name
        for page in site.rglob("*.html")
        if html.parse(page).xpath("//*[contains(@class, 'mermaid')]")
    ] == []


@pytest.mark.full
@pytest.mark.parametrize(("written", "named"), FAULTS.values(), ids=list(FAULTS))
def test_a_fault_of_a_page_ends_the_build(written: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text(f"# A page\n\n{written}\n", encoding="utf-8")
    kept = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[0]
    (tmp_path / "mkdocs.yml").write_text(f"{kept}\nnav: [index.md]\n", encoding="utf-8")
    (tmp_path / "scripts").mkdir()
    shutil.copy(ROOT / "scripts" / "mkdocs_hooks.py", tmp_path / "scripts")
    done = build_site(tmp_path, tmp_path / "site")
    assert done.returncode == 1
    assert named in done.stderr


def test_a_terminals_copy_button_copies_the_commands_alone() -> None:
    shown = (
        '<p>a</p><div class="highlight"><pre><code><span class="gp">$ </span>grep &quot;a&quot; *'
        '\n<span class="go">found</span>\n<span class="gp">$ </span>ls\n</code></pre></div>'
    )
    box = html.fromstring(f"<main>{on_page_content(shown)}</main>").find("div")
    assert box is not None
    assert box.get("data-copy") == 'grep "a" *\nls'
