"""Edits of a text by exact positions, and misspelt words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class Edit:
    """`text` takes the place of the characters from `start` up to `end`."""

    start: int
    end: int
    text: str


def apply_edits(text: str, edits: Iterable[Edit]) -> str:
    """Return the text with all edits made. Raises ValueError where two of them overlap."""
    parts, position = [], 0
    for edit in sorted(edits):
        if edit.start < position:
            raise ValueError(f"two edits overlap at {edit.start}")
        parts += [text[position : edit.start], edit.text]
        position = edit.end
    return "".join([*parts, text[position:]])


def line_at(text: str, position: int) -> int:
    """Return the line of a position, counted from 1."""
    return text.count("\n", 0, position) + 1


def whole_lines(text: str, start: int, end: int) -> tuple[int, int]:
    """The span with its indentation and its line end, where it has its lines for itself; else the span as it is."""
    first = text.rfind("\n", 0, start) + 1
    last = text.find("\n", end)
    last = len(text) if last < 0 else last + 1
    alone = not text[first:start].strip() and not text[end:last].strip()
    return (first, last) if alone else (start, end)


# ---- misspellings

OPENING = re.compile(r"""^[a-zA-Z]{0,2}(?:'''|\"\"\"|'|")""")
WORD = re.compile(r"\{[^{}]*\}|%\(\w+\)\w|%[-+ #0-9.]*[a-z]|\\.|([^\W\d_]{3,})")


def misspelt_name(name: str) -> str:
    """A name without its last letter but one: `chattr`."""
    return name[:-2] + name[-1:] if len(name) > 2 else f"{name}{name[-1:]}"


def misspelt_literal(source: str) -> str:
    """A text's source with its first word misspelt, places for values left alone; as it was where there is none."""
    opening = OPENING.match(source)
    start = opening.end() if opening else 0
    for match in WORD.finditer(source, start):
        if match[1]:
            return source[: match.start(1)] + misspelt_name(match[1]) + source[match.end(1) :]
    return source


def texts_in(node: ast.AST) -> Iterator[ast.Constant | ast.JoinedStr]:
    """The texts of an expression, an f-string as one; none that only names something (`get_param('x')`, `d['x']`)."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str)):
        yield node
        return
    if isinstance(node, ast.Subscript):
        return
    named = isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2].startswith("get_")
    for child in ast.iter_child_nodes(node) if not named else ():
        yield from texts_in(child)
