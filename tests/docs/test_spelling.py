"""The pages are spelt, and all of them as the British spell."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from scripts.pages import ROOT, pages

AMERICAN = re.compile(
    r"\b(behaviors?|colors?|centers?|licenses?|gray|favor\w*|catalogs?|dialogs?|canceled|labeled|modeled|fulfill|"
    r"(?:analy|recogni|organi|seriali|normali|initiali|summari|visuali|optimi)z\w+)\b",
    re.IGNORECASE,
)

NAMES = ("Grade Center",)  # Blackboard's


def prose(page: str) -> str:
    """The page's text without its code and its addresses."""
    tokens = MarkdownIt("commonmark").enable("table").parse(page)
    inline = (child for token in tokens for child in token.children or ())
    text = " ".join(child.content for child in inline if child.type == "text")
    for name in NAMES:
        text = text.replace(name, "")
    return text


def test_no_page_installs_the_grader_from_an_index() -> None:
    """It is on none, so anyone could take its name there. Only the page for maintainers names the command, to warn."""
    from_index = re.compile(r"(?:pipx? install|pip3 install|uv add)\b[^`\n]*[ '\"]ros-lab-grader")
    found = {path.name for path in pages() if from_index.search(path.read_text(encoding="utf-8"))}
    assert found == {"releasing.md"}
    assert from_index.search("in a sentence (`pip install 'ros-lab-grader[review]'`)")


HTML = {"br", "details", "div", "img", "kbd", "picture", "source", "span", "sub", "summary", "sup"}


def tags(page: str) -> set[str]:
    """The HTML elements in a page's Markdown."""
    tokens = MarkdownIt("commonmark").enable("table").parse(page)
    every = (one for token in tokens for one in (token, *(token.children or ())))
    html = (one.content for one in every if one.type in {"html_block", "html_inline"})
    return {name for text in html for name in re.findall(r"<([a-z][\w-]*)", text, re.IGNORECASE)}


@pytest.mark.parametrize("path", pages(), ids=lambda path: str(path.relative_to(ROOT)))
def test_no_word_of_a_page_is_taken_for_html(path: Path) -> None:
    """`<node>` outside of code is not shown at all."""
    assert tags(path.read_text(encoding="utf-8")) <= HTML


def test_a_word_that_is_taken_for_html_is_found() -> None:
    assert tags("write `<node>` to DIR/<id>/, not &lt;tag>\n\n```\n<code>\n```\n") == {"id"}


@pytest.mark.parametrize("path", pages(), ids=lambda path: str(path.relative_to(ROOT)))
def test_a_page_is_british(path: Path) -> None:
    assert AMERICAN.findall(prose(path.read_text(encoding="utf-8"))) == []


def test_an_american_word_is_found_and_code_is_no_prose() -> None:
    page = "The color of a `license`, [recognized](center.md).\n\n```\ngray\n```\n"
    assert AMERICAN.findall(prose(page)) == ["color", "recognized"]


def test_no_page_has_a_common_slip() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "codespell_lib", *pages()], capture_output=True, text=True, check=False
    )
    assert done.stdout == ""
    assert done.returncode == 0
