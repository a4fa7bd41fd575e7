"""MkDocs hooks: links that leave docs/ go to the repository, where it has an address, and are plain words elsewhere.
A terminal's copy button copies the commands alone, and the empty corner of a table is no header.
"""

from __future__ import annotations

import html
import re
from pathlib import Path, PurePosixPath
from posixpath import normpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parent.parent
TERMINAL = re.compile(r'<div class="highlight">(.*?)</div>', re.DOTALL)
TAG = re.compile(r"<[^>]*>")
PROMPT = "$ "
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, **_: object) -> str:
    """The page with its links to files outside docs/ made to work on the site."""
    folder = PurePosixPath("docs", page.file.src_uri).parent

    def replaced(match: re.Match[str]) -> str:
        words, target, anchor = match[1], match[2], match[3] or ""
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        path = normpath(str(folder / target))
        if path.startswith(("docs/", "..")) or not (ROOT / path).exists():
            return match[0]
        if not config.repo_url:
            return words
        return f"[{words}]({config.repo_url.rstrip('/')}/blob/main/{path}{anchor})"

    return LINK.sub(replaced, markdown)


def on_page_content(content: str, **_: object) -> str:
    """The page's HTML, in which `data-copy` says what a terminal's copy button copies."""

    def with_commands(match: re.Match[str]) -> str:
        lines = html.unescape(TAG.sub("", match[1])).splitlines()
        commands = "\n".join(line.removeprefix(PROMPT) for line in lines if line.startswith(PROMPT))
        copied = f' data-copy="{html.escape(commands)}"' if commands else ""
        return f'<div class="highlight"{copied}>{match[1]}</div>'

    return TERMINAL.sub(with_commands, content).replace("<th></th>", "<td></td>")
