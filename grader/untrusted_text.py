r"""Text that others wrote, made visible: what would steer a terminal or command a CI's log is written out.

An escape becomes `\x1b`. Every room may use this; `grader.report.text` has what documents need beyond it.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from typing import Any

HIDDEN_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
# Drawn as nothing, though their categories are those of letters and marks (Default_Ignorable_Code_Point, and a blank).
INVISIBLE = frozenset(
    {0x034F, 0x115F, 0x1160, 0x17B4, 0x17B5, 0x180B, 0x180C, 0x180D, 0x180F, 0x2800, 0x3164, 0xFFA0}
    | {*range(0xFE00, 0xFE0E), *range(0xE0100, 0xE01F0)}
)
STACKED_MAX = 4
CACHED_SIGNS = 1 << 16
CRITERIA_CHARS = 600_000
"""What all the texts of a report's criteria together may have."""
TEXTS_EACH = 8
CITATIONS_MAX = 20

_NAMED = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}
# `##[error]`, `##vso[…]`, `##teamcity[…]` count anywhere in a line, GitHub's `::error::` at a line's start only.
_COMMAND = re.compile(r"#(?=#[A-Za-z]{0,20}\[)")
_COLOUR = re.compile(r"\x1b(?:\[[0-9;]*[A-Za-z]|\][^\x07\x1b]*(?:\x07|\x1b\\))")
_COMMAND_AT_START = re.compile(r"^((?:[^\S\n]|\x1b\[[0-9;]*m)*):(?=:)", re.MULTILINE)


def steers(character: str) -> bool:
    """Return whether it cannot be seen: a control, format, private, unassigned or invisible character."""
    return unicodedata.category(character) in HIDDEN_CATEGORIES or ord(character) in INVISIBLE


def without_colours(text: str) -> str:
    """Return the text without the codes that colour a terminal or name its window."""
    return _COLOUR.sub("", text)


def visible(text: str, *, lines: bool = False) -> str:
    """Return `text` with whatever steers, hides or commands written out. With `lines`, line ends and tabs stay.

    What is visible already stays as it is.
    """
    if not (text.isascii() and text.isprintable()):
        text = _unstack_marks(text.translate(_LINES if lines else _LINE))
    return without_ci_commands(text)


def without_ci_commands(text: str) -> str:
    """Return lines that no CI system takes for a command to itself. Colours that are ours may stand before them."""
    if "##" in text:
        text = _COMMAND.sub(r"\\x23", text)
    return _COMMAND_AT_START.sub(r"\1\\x3a", text) if "::" in text else text


def clip(text: str, limit: int) -> str:
    """Return `text`, or its beginning and how much is left out."""
    return _cut(text[:limit], max(0, len(text) - limit))


def line(text: str, limit: int) -> str:
    """Return one visible line that is hardly longer than `limit` characters; it says how many of `text` are left
    out."""
    if len(text) <= limit and len(shown := visible(text)) <= limit:
        return shown
    head = _fitting(text, limit, visible)
    return _cut(visible(head), len(text) - len(head))


def text_limit(criteria: int, most: int) -> int:
    """Return how long one text of a report may be, so that a report of many criteria does not grow without end."""
    return max(200, min(most, CRITERIA_CHARS // (TEXTS_EACH * max(criteria, 1))))


def json_text(data: object, *, ascii_only: bool = False) -> str:
    """Return JSON that can be printed anywhere: nothing in it steers or hides, and it reads back as `data`.

    Numbers that JSON does not have become null, lone surrogates the text of their escape.
    """
    try:
        text = _as_json(data, ascii_only=ascii_only)
    except ValueError:
        text = _as_json(_without_surrogates(data), ascii_only=ascii_only)
    return _json_escaped(text) + "\n"


def _as_json(data: object, *, ascii_only: bool) -> str:
    """Return what `json.dumps` would, in a third of the time. Raises ValueError for a lone surrogate."""
    from pydantic_core import to_json  # noqa: PLC0415 - the parser of the command line must start fast

    return to_json(data, indent=2, ensure_ascii=ascii_only, inf_nan_mode="null").decode()


def clipped(data: Any, limit: int) -> Any:  # noqa: ANN401 - JSON
    """Return the data with every text clipped to what JSON writes in `limit` characters, and of citations the first."""
    if isinstance(data, str):
        if len(data) <= limit and "##" not in data and data.isascii() and data.isprintable():
            return data
        head = _fitting(data, limit, _json_escaped)
        return _cut(head, len(data) - len(head))
    if isinstance(data, dict):
        return {
            key: clipped(item[:CITATIONS_MAX], max(120, limit // 4))
            if key == "citations"
            else clipped(item, limit)
            for key, item in data.items()
        }
    return [clipped(item, limit) for item in data] if isinstance(data, list) else data


def _fitting(text: str, limit: int, written: Callable[[str], str]) -> str:
    """Return the beginning of `text` that is written in `limit` characters."""
    head = text[:limit]
    # at least one letter less each time, so that it ends
    while (length := len(written(head))) > limit:
        head = head[: min(len(head) - 1, len(head) * limit // length)]
    return head


def _cut(head: str, left: int) -> str:
    return f"{head}… ({left} more characters)" if left else head


def _without_surrogates(data: Any) -> Any:  # noqa: ANN401 - JSON
    if isinstance(data, str):
        return data.encode("utf-8", "backslashreplace").decode()
    if isinstance(data, dict):
        return {_without_surrogates(key): _without_surrogates(item) for key, item in data.items()}
    return [_without_surrogates(item) for item in data] if isinstance(data, list | tuple) else data


def _json_escaped(text: str) -> str:
    if not (text.isascii() and text.isprintable()):  # of a document, most rows have nothing to escape
        rows = text.split("\n")
        text = "\n".join(row if row.isascii() and row.isprintable() else row.translate(_JSON) for row in rows)
    return _COMMAND.sub(r"\\u0023", text) if "##" in text else text


def _json_escape(character: str) -> str:
    units = character.encode("utf-16-be", "surrogatepass")
    # JSON writes a character beyond 16 bits as two surrogates
    return "".join(f"\\u{units[i]:02x}{units[i + 1]:02x}" for i in range(0, len(units), 2))


class _Signs(dict[int, int | str]):
    """A table for `str.translate` that fills itself as characters turn up: what steers is `written` otherwise."""

    def __init__(self, kept: str, written: Callable[[str], str]) -> None:
        super().__init__({ord(character): character for character in kept})
        self._written = written

    def __missing__(self, code: int) -> int | str:
        found: int | str = self._written(chr(code)) if steers(chr(code)) else code
        if len(self) < CACHED_SIGNS:  # a text with all of Unicode in it does not fill the memory
            self[code] = found
        return found


def _written_out(character: str) -> str:
    code = ord(character)
    if character in _NAMED:
        return _NAMED[character]
    if code <= 0xFF:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code <= 0xFFFF else f"\\U{code:08x}"


def _unstack_marks(text: str) -> str:
    """Marks that are drawn over their letter, and in number over the lines around it: four, then written out."""
    if text.isascii() or not any(map(_is_mark, text)):
        return text
    shown, height = [], 0
    for character in text:
        height = height + 1 if _is_mark(character) else 0
        shown.append(character if height <= STACKED_MAX else _written_out(character))
    return "".join(shown)


def _is_mark(character: str) -> bool:
    return unicodedata.category(character) in {"Mn", "Me"}


_LINE, _LINES, _JSON = _Signs("", _written_out), _Signs("\n\t", _written_out), _Signs("", _json_escape)
