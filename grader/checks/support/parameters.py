"""What is on the parameter server at a time, as one nested map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from grader.evidence.events import ParamEvent
from grader.evidence.run import Run

MISSING: Final = object()
"""What `at` gives for a name that is not there: None may be a value."""


def server(run: Run, until_ns: int) -> dict[str, Any]:
    """All that is set after every change up to `until_ns`."""
    held: dict[str, Any] = {}
    for at_ns, event in run.params:
        if at_ns <= until_ns:
            held = _changed(held, event)
    return held


def at(held: Mapping[str, Any], name: str) -> Any:  # noqa: ANN401 - whatever a parameter holds
    """The value or the map under a name, MISSING where there is none."""
    value: Any = held
    for key in _keys(name):
        if not isinstance(value, Mapping) or key not in value:
            return MISSING
        value = value[key]
    return value


def leaves(held: Mapping[str, Any], prefix: str = "") -> list[str]:
    """The names of all values, maps taken apart."""
    found: list[str] = []
    for key, value in held.items():
        name = f"{prefix}/{key}"
        found += leaves(value, name) if isinstance(value, Mapping) and value else [name]
    return found


def _keys(name: str) -> list[str]:
    return [key for key in name.split("/") if key]


def _changed(held: dict[str, Any], event: ParamEvent) -> dict[str, Any]:
    """As the master does it: a map takes the place of what was under its name, and a value that of a map."""
    keys = _keys(event.name)
    if not keys:
        whole = event.value if event.action == "set" and isinstance(event.value, Mapping) else {}
        return dict(whole)
    changed = dict(held)
    below = changed
    for key in keys[:-1]:
        inner = below.get(key)
        below[key] = dict(inner) if isinstance(inner, Mapping) else {}
        below = below[key]
    if event.action == "set":
        below[keys[-1]] = event.value
    else:
        below.pop(keys[-1], None)
    return changed
