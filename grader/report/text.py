"""Text that others wrote, made harmless: shown, never obeyed."""

from __future__ import annotations

import re
import unicodedata

HIDDEN_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
NAMED = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}

LINKED = re.compile(
    r"""(?:
      [A-Za-z][A-Za-z0-9+.-]{0,32}://[^\s`]+  # an address with its scheme
    | (?:www\.|mailto:|xmpp:)[^\s`]+        # what GitHub links without one
    | [\w.+-]{0,64}@[\w-][\w./+-]*          # a mention, or an e-mail address
    | (?<!\w)[A-Za-z]{0,40}[\#!]\d+         # a reference to an issue or a merge request
    )+""",
    re.VERBOSE,
)
MARKUP = re.compile(r"[\\`*\[\]|~$]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])")
ENTITIES = {"&": "&amp;", "<": "&lt;", ">": "&gt;"}


def visible(text: str, *, lines: bool = False) -> str:
    r"""`text` with every character that steers or hides written out: an escape becomes `\x1b`.

    With `lines`, line ends and tabs stay. No other control, format, private or unassigned character does.
    """
    if text.isascii() and text.isprintable():
        return text
    keep = "\n\t" if lines else ""
    return "".join(c if c in keep or not _steers(c) else _written_out(c) for c in text)


def _steers(character: str) -> bool:
    return unicodedata.category(character) in HIDDEN_CATEGORIES


def _written_out(character: str) -> str:
    code = ord(character)
    if character in NAMED:
        return NAMED[character]
    if code <= 0xFF:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code <= 0xFFFF else f"\\U{code:08x}"


def markdown(text: str, *, cell: bool = False) -> str:
    """One line of Markdown that reads as `text`: no markup, link, mention or HTML of it takes effect."""
    text = visible(text)
    parts, position = [], 0
    for match in LINKED.finditer(text):
        parts += [_escaped(text[position : match.start()]), markdown_code(match.group(), cell=cell)]
        position = match.end()
    return "".join([*parts, _escaped(text[position:])])


def _escaped(text: str) -> str:
    text = "".join(ENTITIES.get(c, c) for c in text)
    return MARKUP.sub(lambda match: "\\" + match.group(), text)


def markdown_code(text: str, *, cell: bool = False) -> str:
    """A code span that shows `text` as it is. A bar is escaped in a table's `cell`, and only there."""
    text = visible(text)
    if not text.strip():
        return ""
    fence = "`" * (1 + max((len(run) for run in re.findall("`+", text)), default=0))
    pad = " " if text[0] in "` " or text[-1] in "` " else ""
    return f"{fence}{pad}{text.replace('|', chr(92) + '|') if cell else text}{pad}{fence}"


def clip(text: str, limit: int) -> str:
    """`text`, or its beginning and how much is left out."""
    return text if len(text) <= limit else f"{text[:limit]}… ({len(text) - limit} more characters)"


def number(value: float, digits: int = 3) -> str:
    """`10`, `87.5`: no zeros that say nothing."""
    return f"{value:.{digits}f}".rstrip("0").rstrip(".") or "0"
