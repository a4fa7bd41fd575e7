"""Fields of messages by their path, as one run's messages hold them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator

from grader.checks.support.nodes import plain_type
from grader.evidence.run import Channel
from grader.model.verdict import Verdict, inconclusive, unjudged
from grader.wording import plural, significant

ROUNDING = 1e-6
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
    """Return all values that the path names, several where it holds `[*]`. Raises NoField."""
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
        raise NoField(f"{done} is not a list")
    if part == "[*]":
        return list(value)
    index = int(part[1:-1])
    if index >= len(value):
        raise NoField(f"{done} has only {plural(len(value), 'item')}")
    return [value[index]]


class Reading(NamedTuple):
    """The field in one message. `fault` says why there is nothing to compare."""

    time_ns: int
    values: tuple[Any, ...]
    fault: str


def readings(channels: Iterable[Channel], path: str, *, numbers: bool = True) -> list[Reading]:
    """Return the field in each message by time; with `numbers`, any other value is a fault."""
    found = [
        _reading(time_ns, value, path, numbers=numbers)
        for channel in channels
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
    ]
    return sorted(found, key=lambda one: one.time_ns)


def _reading(time_ns: int, message: Any, path: str, *, numbers: bool) -> Reading:  # noqa: ANN401 - as above
    if message is None:
        return Reading(time_ns, (), "the message cannot be read")
    try:
        values = values_at(message, path)
    except NoField as error:
        return Reading(time_ns, (), str(error))
    if not values:
        return Reading(time_ns, (), f"{path.partition('[*]')[0]} is empty")
    if numbers and not all(isinstance(value, int | float) for value in values):
        return Reading(time_ns, (), f"{path} is not a number")
    return Reading(time_ns, tuple(values), "")


def no_field(missing: Reading, channels: Iterable[Channel]) -> Verdict:
    """Return the verdict where not one message has it: another type of message, most often."""
    channel = next(c for c in channels if c.messages)
    what = f"the messages on {channel.topic} ({plain_type(channel.type)})"
    if all(value is None for value in channel.values):
        return inconclusive(f"{what} cannot be read", hint="grade again")
    hint = f"rostopic echo {channel.topic} shows the fields"
    return unjudged(f"{what} do not fit: {missing.fault}", measured=missing.fault, hint=hint)


def bounds_text(low: float | None, high: float | None) -> str:
    """Return bounds in words; at least one of them is given."""
    if low is None:
        return f"at most {significant(high or 0)}"
    return f"at least {significant(low)}" if high is None else f"{significant(low)} to {significant(high)}"


def is_within(value: float, low: float | None, high: float | None) -> bool:
    """A bound counts as within, also where a 32-bit field cannot hold it exactly. NaN is outside."""
    above = low is None or value >= low - ROUNDING * max(1.0, abs(low))
    below = high is None or value <= high + ROUNDING * max(1.0, abs(high))
    return above and below and value == value  # noqa: PLR0124 - NaN is not itself
