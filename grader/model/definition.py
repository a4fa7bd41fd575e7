"""The text of message and service definitions (wiki.ros.org/msg, wiki.ros.org/srv): how one differs from another."""

from __future__ import annotations

import re

DIVIDER = re.compile(r"^---\s*$", re.MULTILINE)
RULE = "=" * 80
"""Before the types that a full definition brings along, behind its own."""
FULL_NAMES = {"byte": "int8", "char": "uint8", "Header": "std_msgs/Header"}
_FIELD = re.compile(r"([\w/]+)(\[\d*\])?\s+(\w+)\s*", re.ASCII)


def other_fields(type_: str, found: str, wanted: str) -> str:
    """Return how the fields of a `.msg` or `.srv` text differ from those that are wanted: names, types, order.

    Nothing where they are the same; constants and comments do not count.
    """
    there, asked = (
        [_own_fields(type_, part) for part in DIVIDER.split(text.partition(RULE)[0])]
        for text in (found, wanted)
    )
    if len(there) != len(asked):
        return f"it has {len(there)} parts with a line --- between them, not {len(asked)}"
    names = ("its request", "its response") if len(asked) > 1 else ("it",)
    for name, own, other in zip(names, there, asked, strict=False):
        if own != other:
            has, asks = (", ".join(fields) or "no fields" for fields in (own, other))
            return f"{name} has {has}; the handout asks for {asks}"
    return ""


def _own_fields(type_: str, text: str) -> list[str]:
    """Return `type name` of each field, types in full."""
    package, found = type_.partition("/")[0], []
    for line in text.splitlines():
        match = _FIELD.fullmatch(line.partition("#")[0].strip())
        if match is not None:  # a constant is none: it has a value
            kind, array, name = match.groups()
            found.append(f"{FULL_NAMES.get(kind, kind.removeprefix(f'{package}/'))}{array or ''} {name}")
    return found
