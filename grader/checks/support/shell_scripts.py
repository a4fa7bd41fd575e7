"""Why a shell script does not come to the line that opens a page, or gives that line nothing, as its lines say."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

ARGUMENT = re.compile(r"\$(?:[1-9@*#]|\{[1-9@*#]\})")
"""What is given on the script's command line, or how much that is."""
CHARS_MAX = 20_000
_OPENS = re.compile(r"\s*(if|for|while|until|case|select)\b|.*\(\)\s*\{")
_CLOSES = re.compile(r"\s*(?:fi|done|esac|\})(?=[\s;&|)]|$)")
_TURNS = re.compile(r"\s*(?:else|elif)\b")
_LEAVES = re.compile(r"\s*(exit|break|continue|return)\b[^;&|#]*(?:#.*)?$")
_ASSIGNS = re.compile(r"\s*(?:export\s+)?([A-Za-z_]\w*)=")
_CLOSED = re.compile(r"[;\s](?:fi|done|esac)\s*(?:[;#].*)?$")
_ENDS = {
    "exit": "ends the script",
    "return": "ends the script",
    "break": "leaves the loop",
    "continue": "skips the rest",
}
Block = tuple[int, str]
"""The line with which an `if` or a loop begins: its number and text."""


class Line(NamedTuple):
    """A line, what is wrong with it, and what to do."""

    number: int
    why: str
    fix: str


def find_obstacle(lines: Sequence[str], program: str, url: str, *, given: bool) -> Line | None:
    """Return what keeps a script from opening the page with the program, None where its lines do not say. `given`: it
    is started with arguments."""
    calls = re.compile(rf"\s*(?:\w+=\S*\s+|exec\s+|nohup\s+|sudo\s+)*{re.escape(program)}\b")
    stack, assigned = list[Block](), dict[str, int]()
    above = list[tuple[int, str, tuple[Block, ...]]]()
    for number, line in enumerate(lines, 1):
        if _CLOSES.match(line) and stack:
            stack.pop()
        elif _TURNS.match(line) and stack:
            stack[-1] = (number, line)
        if calls.match(line):
            for at, word, blocks in above:
                if blocks == tuple(stack[: len(blocks)]):
                    return Line(at, f"`{word}` {_ENDS[word]} before line {number}", f"delete line {at}")
            return None if given else _without_arguments(number, line, stack, assigned, url)
        if left := _LEAVES.match(line):
            above.append((number, left[1], tuple(stack)))
        if (found := _ASSIGNS.match(line)) and ARGUMENT.search(line):
            assigned[found[1]] = number
        if _OPENS.match(line) and not _CLOSED.search(line):
            stack.append((number, line))
    return None


def unclosed_quote(lines: Sequence[str]) -> Line | None:
    """Return the first line that opens a quote of a script in which one is never closed."""
    if _is_closed("\n".join(lines)[:CHARS_MAX]):
        return None
    for number, line in enumerate(lines, 1):
        quote = next((one for one in "\"'" if not _is_closed(line) and _is_closed(line + one)), "")
        if quote:
            why = f"the quote {quote} is opened and never closed"
            return Line(number, why, f"on line {number}, write `{line.strip()}{quote}`")
    return None


def _is_closed(text: str) -> bool:
    with suppress(ValueError):
        return shlex.split(text, comments=True) is not None
    return False


def _without_arguments(
    number: int, line: str, stack: Sequence[Block], assigned: Mapping[str, int], url: str
) -> Line | None:
    """Return what the call, or the blocks that it stands in, take from the script's command line, which is empty."""
    none = "and the <node> gives the script no args"
    asking = next((block for block in stack if ARGUMENT.search(block[1])), None)
    if asking is not None:
        why = f"`{asking[1].strip()[:60]}` asks for an argument, {none}"
        return Line(asking[0], why, f"take line {number} out of the block that begins on line {asking[0]}")
    if taken := ARGUMENT.search(line):
        return Line(
            number, f"it takes {taken[0]}, {none}", f"on line {number}, write {url} in place of {taken[0]}"
        )
    for name, at in assigned.items():
        if re.search(rf"\$\{{?{name}\b", line):
            return Line(at, f"{name} is an argument, {none}", f"on line {at}, write {name}={url}")
    return None


def value_given(line: str, name: str) -> str:
    """Return the line of a shell with `$NAME` in place of what is not quite that; "" where nothing is."""
    # In this order: in single quotes, without the closing brace, without the `$`, and another name behind the `$`.
    slips = (
        rf"'\$\{{?{name}\}}?'",
        rf"\$\{{{name}(?!\}})",
        rf"(?<![\w$/{{-]){name}\b",
        rf"\$\{{?(?!{name}\b)[A-Za-z_]\w*\}}?",
    )
    values = (f'"${name}"', f"${{{name}}}", f"${name}", f"${name}")
    # In a replacement, a backslash would begin an escape.
    changed = (
        re.sub(slip, value.replace("\\", "\\\\"), line, count=1)
        for slip, value in zip(slips, values, strict=True)
    )
    return next((one for one in changed if one != line), "")
