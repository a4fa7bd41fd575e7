"""Values of messages, services and parameters as text, and where two of them differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from grader.checks.support.text import shown

FLOAT32 = 1e-6


class Difference(NamedTuple):
    """`path` is the field as one writes it (`pose.x`, `names[2]`), empty for the whole."""

    path: str
    why: str

    def __str__(self) -> str:
        return f"{self.path}: {self.why}" if self.path else self.why


def differences(got: object, wanted: object, tolerance: float, path: str = "") -> Iterator[Difference]:
    """Each place in which `got` is not as `wanted`; fields that `wanted` leaves out do not matter."""
    if isinstance(wanted, Mapping):
        yield from _in_fields(got, wanted, tolerance, path)
    elif isinstance(wanted, list | tuple):
        yield from _in_items(list(got) if isinstance(got, bytes) else got, wanted, tolerance, path)
    elif not _equal(got, wanted, tolerance):
        yield Difference(path, f"{value_text(got)}, not {value_text(wanted)}{_kinds(got, wanted)}")


def _in_fields(
    got: object, wanted: Mapping[str, object], tolerance: float, path: str
) -> Iterator[Difference]:
    if not isinstance(got, Mapping):
        yield Difference(path, f"{value_text(got)}, not {value_text(wanted)}")
        return
    for name, value in wanted.items():
        inner = f"{path}.{name}" if path else str(name)
        if name in got:
            yield from differences(got[name], value, tolerance, inner)
        else:
            there = ", ".join(map(str, got)) or "nothing"
            yield Difference(inner, f"not there (there is {there})")


def _in_items(
    got: object, wanted: list[object] | tuple[object, ...], tolerance: float, path: str
) -> Iterator[Difference]:
    if not isinstance(got, list | tuple) or len(got) != len(wanted):
        yield Difference(path, f"{value_text(got)}, not {value_text(wanted)}")
        return
    for index, (one, value) in enumerate(zip(got, wanted, strict=True)):
        yield from differences(one, value, tolerance, f"{path}[{index}]")


def _equal(got: object, wanted: object, tolerance: float) -> bool:
    if not _is_number(got) or not _is_number(wanted):
        return type(got) is type(wanted) and got == wanted
    assert isinstance(got, int | float)  # noqa: S101 - for the type checker
    assert isinstance(wanted, int | float)  # noqa: S101 - as above
    exact = isinstance(got, int) and isinstance(wanted, int)
    return abs(got - wanted) <= tolerance if exact else _close(got, wanted, tolerance)


def _close(got: float, wanted: float, tolerance: float) -> bool:
    """A 32-bit field cannot hold every number exactly."""
    both_nan = math.isnan(got) and math.isnan(wanted)
    return both_nan or math.isclose(got, wanted, rel_tol=FLOAT32, abs_tol=tolerance)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _kinds(got: object, wanted: object) -> str:
    """Return what `'3', not 3` means."""
    kinds = {str: "text", bool: "true or false", int: "a number", float: "a number"}
    first, second = kinds.get(type(got), ""), kinds.get(type(wanted), "")
    return f" ({first}, not {second})" if first and second and first != second else ""


def fields_text(value: Mapping[str, Any]) -> str:
    """A request's or an answer's fields in one line."""
    return shown(", ".join(f"{name}: {value_text(one)}" for name, one in value.items())) or "nothing"


def value_text(value: object) -> str:
    """Return a value as `rosservice` and YAML show it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {value_text(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(value_text, value)) + "]"
    return f"{value:.7g}" if isinstance(value, float) else str(value)
