"""The repository's Markdown pages, their links and the anchors that these may point to."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin

ROOT = Path(__file__).resolve().parent.parent
NAMED = ("README.md", "SECURITY.md", "CONTRIBUTING.md", "CHANGELOG.md", "benchmarks/README.md")


def pages() -> list[Path]:
    """Every page that people are meant to read."""
    return [*(ROOT / name for name in NAMED), *sorted((ROOT / "docs").rglob("*.md"))]


def links(page: str) -> list[str]:
    """Where its links and pictures point, in order."""
    inline = (child for token in _parsed(page) for child in token.children or ())
    found = (child.attrGet("href") or child.attrGet("src") for child in inline)
    return [str(target) for target in found if target]


def external_links(page: str) -> Iterator[str]:
    """Those that leave the repository."""
    return (target for target in links(page) if "://" in target)


@cache
def anchors(page: str) -> frozenset[str]:
    """The names of its headings, as GitHub makes them."""
    return frozenset(str(token.attrGet("id")) for token in _parsed(page) if token.type == "heading_open")


def _parsed(page: str) -> list[Token]:
    markdown = MarkdownIt("commonmark").enable("table").use(anchors_plugin, max_level=6)
    return markdown.parse(page)
