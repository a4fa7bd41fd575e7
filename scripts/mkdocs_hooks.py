"""MkDocs hooks: links that leave docs/ go to the repository, where it has an address, and are plain words elsewhere.
A terminal's copy button copies the commands alone, the empty corner of a table is not a header, and what the theme
writes against HTML's rules is put right.
"""

from __future__ import annotations

import html
import re
from collections import Counter
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

    content = TERMINAL.sub(with_commands, content).replace("<th></th>", "<td></td>")
    return IMAGE.sub(r"\1>", HEADER.sub(r'<th scope="col"\1>', content))


HEADER = re.compile(r"<th(| style=[^>]*)>")
IMAGE = re.compile(r"(<img[^>]*?) ?/>")
NAMED_BY_AN_ICON = re.compile(
    r'(<nav class="md-nav" data-md-level="1" )aria-labelledby="\w+"([^>]*>\s*<label class="md-nav__title"[^>]*>'
    r"\s*<span[^>]*></span>\s*)([^<]*?)(\s*</label>)"
)
NAMED_LIST = re.compile(r'(<nav [^>]*aria-label=")([^"]*)')
SEARCH_FORM = re.compile(r'(<form class="md-search__form"[^>]*>)')
PALETTE_FORM = re.compile(r'<form( class="md-header__option"[^>]*>.*?)</form>', re.DOTALL)
SWITCH = re.compile(r'(<input class="md-toggle[^>]*) autocomplete="off"')


def on_post_page(output: str, **_: object) -> str:
    """The whole page, in which the theme's own markup keeps to HTML's rules: lists of pages have names, forms a button
    that sends them, and attributes values that are allowed."""
    output = output.replace(' tabindex=""', "")
    output = SWITCH.sub(r"\1", output)
    output = NAMED_BY_AN_ICON.sub(r'\1aria-label="\3"\2\3\4', output)
    output = PALETTE_FORM.sub(r"<div\1</div>", output)
    output = SEARCH_FORM.sub(r'\1<button type="submit" hidden>Search</button>', output)
    names = Counter[str]()

    def with_own_name(match: re.Match[str]) -> str:
        names[match[2]] += 1
        return match[0] if names[match[2]] == 1 else f"{match[1]}{match[2]} ({names[match[2]]})"

    return NAMED_LIST.sub(with_own_name, output)  # contents are in the list of pages and beside the text
