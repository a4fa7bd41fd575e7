"""Service types: requests to bytes and responses back, from the text of a `.srv` file (wiki.ros.org/srv)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from grader.evidence.decode import Decoder, Encoder, Value, definition
from grader.evidence.definitions import PRIMITIVES

FindText = Callable[[str], str | None]
"""From a message type to the text of its `.msg` file, None where there is none."""

_DIVIDER = re.compile(r"^---\s*$", re.MULTILINE)
_TYPE = re.compile(r"^\s*([A-Za-z][\w/]*)\s*(?:\[\d*\])?\s+[A-Za-z]\w*\s*$", re.ASCII)
_BUILT_IN = {*PRIMITIVES, "byte", "char", "time", "duration"}
_RULE = "=" * 80
_PARTS_MAX = 100


class ServiceType:
    """One service type. `find_text` gives messages that ROS Noetic's own packages do not have.

    Raises ValueError for a text that is no service definition.
    """

    def __init__(self, type: str, text: str, find_text: FindText = lambda _: None) -> None:  # noqa: A002 - ROS's own word
        parts = _DIVIDER.split(text)
        if len(parts) != 2:
            raise ValueError(f"{type}: a service has a request and a response with one line --- between them")
        request, response = (_with_parts(type, part, find_text) for part in parts)
        self._request = Encoder(f"{type}Request", request)
        self._response = Decoder(f"{type}Response", response)

    def encode_request(self, value: Mapping[str, Any]) -> bytes:
        """The request's bytes; fields that `value` leaves out are zero. Raises ValueError where it does not fit."""
        return self._request.encode(value)

    def decode_response(self, data: bytes) -> Value:
        """The response's fields, None where the bytes do not fit."""
        return self._response.decode(data)


def _with_parts(type_: str, text: str, find_text: FindText) -> str:
    """The text with a `MSG:` part for each type that it needs."""
    package = type_.partition("/")[0]
    parts: dict[str, str] = {}
    waiting = _needed(text, package)
    while waiting:
        name = waiting.pop()
        if name in parts:
            continue
        if len(parts) > _PARTS_MAX:
            raise ValueError(f"{type_} needs more than {_PARTS_MAX} other types")
        parts[name] = _text_of(name, find_text)
        waiting += _needed(parts[name], name.partition("/")[0])
    sections = [text, *(f"MSG: {name}\n{part}" for name, part in parts.items())]
    return f"\n{_RULE}\n".join(sections)


def _text_of(name: str, find_text: FindText) -> str:
    """The type's own text, without the parts that come behind it in a full definition."""
    found = find_text(name)
    return found if found is not None else definition(name).partition(_RULE)[0]


def _needed(text: str, package: str) -> list[str]:
    types = (match[1] for line in text.splitlines() if (match := _TYPE.match(line.partition("#")[0])))
    return [_full(name, package) for name in types if name not in _BUILT_IN]


def _full(name: str, package: str) -> str:
    if "/" in name:
        return name
    return "std_msgs/Header" if name == "Header" else f"{package}/{name}"
