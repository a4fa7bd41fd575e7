"""Fields of messages by their path, as a rubric writes it: `linear.x`, `ranges[0]`, `ranges[*]`, `poses[*].x`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator

_STEP = r"[A-Za-z]\w*(?:\[(?:\d+|\*)\])*"
_PARTS = re.compile(r"[A-Za-z]\w*|\[(?:\d+|\*)\]")


def _sound(path: str) -> str:
    if not re.fullmatch(rf"{_STEP}(?:\.{_STEP})*", path):
        raise ValueError(f'must be a field like linear.x, ranges[0] or ranges[*], not "{path}"')
    return path


FieldPath = Annotated[str, AfterValidator(_sound)]


class NoField(LookupError):
    """What of the path is not there, and what is there instead."""


def values_at(message: Any, path: str) -> list[Any]:  # noqa: ANN401 - decoded messages hold anything
    """All values that the path names, several where it holds `[*]`. Raises NoField."""
    found, done = [message], ""
    for part in _PARTS.findall(path):
        found = [item for one in found for item in _step(one, part, done)]
        done += part if part.startswith("[") else f".{part}" if done else part
    return found


def _step(value: Any, part: str, done: str) -> list[Any]:  # noqa: ANN401 - as above
    if not part.startswith("["):
        if isinstance(value, Mapping) and part in value:
            return [value[part]]
        there = ", ".join(value) if isinstance(value, Mapping) else ""
        raise NoField(f"{done or 'the message'} has no field {part}" + (f", but {there}" if there else ""))
    if not isinstance(value, list | tuple | bytes):
        raise NoField(f"{done} is no list")
    if part == "[*]":
        return list(value)
    index = int(part[1:-1])
    if index >= len(value):
        raise NoField(f"{done} has {len(value)} items only")
    return [value[index]]
