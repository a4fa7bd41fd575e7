"""Slips of the pen."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from grader.mutation.python import Script

OPENING = re.compile(r"""^[a-zA-Z]{0,2}(?:'''|\"\"\"|'|")""")
WORD = re.compile(r"\{[^{}]*\}|%\(\w+\)\w|%[-+ #0-9.]*[a-z]|\\.|([A-Za-z]{3,})")


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


def texts_in(script: Script, node: ast.AST) -> Iterator[ast.Constant | ast.JoinedStr]:
    """The texts of an expression, an f-string as one."""
    for found in ast.walk(node):
        in_pattern = isinstance(script.parents.get(found), ast.JoinedStr | ast.FormattedValue)
        if isinstance(found, ast.JoinedStr) or (
            isinstance(found, ast.Constant) and isinstance(found.value, str) and not in_pattern
        ):
            yield found
