"""Reads statements of Python 2 as Python 3, with lib2to3's fixers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from grader.line_slips.python import without_texts

STATEMENT_LINES_MAX = 12
FIXERS = ("print", "except", "exec", "raise", "repr", "ne", "numliterals", "long", "unicode")
OLD_PRINT = re.compile(r"\bprint\b(?!\s*\()")
OF_FIXERS = re.compile(
    r"print|except|exec|raise|`|<>|long|unicode|unichr|\b0\d|[0-9a-f]l\b|\bur?['\"]", re.IGNORECASE
)
"""What there is in all that the fixers change."""


def as_python3(lines: list[str], at: int) -> Iterator[str]:
    """Yield the text with the statement at the line read as Python 2."""
    for start in range(at, max(-1, at - STATEMENT_LINES_MAX), -1):
        for end in range(at + 1, min(len(lines), start + STATEMENT_LINES_MAX) + 1):
            fixed = _fixed_statement(lines[start:end])
            if fixed is not None:
                yield "\n".join([*lines[:start], *fixed, *lines[end:]])
                return


def _fixed_statement(lines: list[str]) -> list[str] | None:
    """The same as Python 3; None where it is not a statement by itself, or nothing of it is Python 2."""
    if not OF_FIXERS.search("\n".join(lines)):
        return None
    indentation = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    first = lines[0].strip()
    keyword = re.match(r"\w*", first)
    head = {"elif": "if x:\n    pass\n", "else": "if x:\n    pass\n", "except": "try:\n    pass\n"}
    before = head.get(keyword[0] if keyword else "", "")
    after = "    pass\n" if without_texts(lines[-1]).rstrip().endswith(":") else ""
    source = before + "\n".join([first, *lines[1:]]) + "\n" + after
    # where each `print` has its brackets, it is no statement, and would get a second pair of them
    tools = _tools()[::-1] if OLD_PRINT.search(without_texts(source)) else _tools()[:1]
    fixed = next((f for tool in tools if (f := _refactor(tool, source)) not in (None, source)), None)
    if fixed is None:
        return None
    body = fixed.removeprefix(before).removesuffix("\n" + after if after else "\n").split("\n")
    return [indentation + body[0], *body[1:]]


_TOOLS: list[Any] = []


def _tools() -> list[Any]:
    """First for a file whose `print` is Python 3 already."""
    if not _TOOLS:
        from fissix.refactor import RefactoringTool  # noqa: PLC0415 - found once `site` is in the path

        names = [f"fissix.fixes.fix_{name}" for name in FIXERS]
        _TOOLS.append(RefactoringTool([n for n in names if "print" not in n], {"print_function": True}))
        _TOOLS.append(RefactoringTool(names))
    return _TOOLS


def _refactor(tool: Any, source: str) -> str | None:  # noqa: ANN401 - a library without types
    try:
        return str(tool.refactor_string(source, "script"))
    except Exception:  # noqa: BLE001 - the library raises whatever its parser and tokenizer do
        return None
