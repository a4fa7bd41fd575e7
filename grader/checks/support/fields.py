"""Fields of messages by their path, and values of messages, services and parameters: as text, and where two differ.

`values_at` gives what a decoded message has at a path (`pose.position.x`), and `readings` the same of all messages of
channels, with their times; `no_field` gives the verdict where there is no such field. `differences` compares what came
with what was wanted; `fields_text` and `value_text` write values as reports show them.
"""

from __future__ import annotations

import math
import re
from bisect import bisect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, permutations
from typing import Annotated, Any, NamedTuple, Protocol, TypeGuard

from pydantic import AfterValidator

from grader.checks.support.processes import plain_type
from grader.checks.support.text import near_names, shown
from grader.evidence.run import Channel
from grader.model.message_definitions import NOT_FINITE
from grader.model.verdict import Verdict, failed_or_blocked, grade_again
from grader.wording import join_words, plural, significant

ROUNDING = 1e-6
_STEP = r"[A-Za-z]\w*(?:\[(?:\d+|\*)\])*"
PATH_PARTS = re.compile(r"[A-Za-z]\w*|\[(?:\d+|\*)\]")
"""The parts of a field's path: names, and items of lists."""


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
    for part in PATH_PARTS.findall(path):
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
        reading_of(time_ns, value, path, numbers=numbers)
        for channel in channels
        for time_ns, value in zip(channel.times_ns, channel.values, strict=True)
    ]
    return sorted(found, key=lambda one: one.time_ns)


def reading_of(time_ns: int, message: Any, path: str, *, numbers: bool) -> Reading:  # noqa: ANN401 - as above
    """Return the field in one message."""
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


def join_items(found: Iterable[Reading], wanted: Sequence[object]) -> list[Reading]:
    """Return the readings, those of `[*]` as one list where lists are wanted and the items are none: one value each."""
    are_lists = any(isinstance(one, list | tuple) for one in wanted)
    return [
        one._replace(values=(list(one.values),))
        if are_lists and one.values and not isinstance(one.values[0], list | tuple | bytes)
        else one
        for one in found
    ]


def set_beside(channels: Iterable[Channel], time_ns: int, path: str, wanted: object, tolerance: float) -> str:
    """Return the one other field of a message that has the value which is wanted of this one; "" for none or several,
    and for the values that every field begins with."""
    if not wanted or isinstance(wanted, bool | list | Mapping):
        return ""
    each = (m for c in channels for t, m in zip(c.times_ns, c.values, strict=True) if t == time_ns)
    leaves = [leaf for message in each for leaf in _leaves(message)]
    # rospy counts the messages in `header.seq` itself
    own = [(name, value) for name, value in leaves if name not in {path, "header.seq"}]
    found = [name for name, value in own if _equal(value, wanted, tolerance)]
    return found[0] if len(found) == 1 else ""


def changing_beside(channels: Iterable[Channel], path: str) -> str:
    """Return the one other field of the messages whose values are not all the same; "" for none or several."""
    seen: dict[str, set[str]] = {}
    for message in (one for channel in channels for one in channel.values):
        for name, value in _leaves(message):
            seen.setdefault(name, set()).add(value_text(value))
    found = [name for name, values in seen.items() if name not in {path, "header.seq"} and len(values) > 1]
    return found[0] if len(found) == 1 else ""


def _leaves(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _leaves(inner, f"{path}.{name}" if path else str(name))
    elif not isinstance(value, list | tuple):
        yield path, value


def no_field(missing: Reading, channels: Iterable[Channel]) -> Verdict:
    """Return the verdict where not one message has it: another type of message, most often."""
    channel = next(c for c in channels if c.messages)
    what = f"the messages on {channel.topic} ({plain_type(channel.type)})"
    if all(value is None for value in channel.values):
        return grade_again(f"{what} cannot be read")
    hint = f"rostopic echo {channel.topic} shows the fields"
    verdict = failed_or_blocked(f"{what} do not fit: {missing.fault}", measured=missing.fault, hint=hint)
    return verdict.based_on(misfit=True)


def bounds_text(low: float | None, high: float | None) -> str:
    """Return bounds in words; at least one of them is given."""
    if low is None:
        return f"at most {significant(high or 0)}"
    return (
        f"at least {significant(low)}" if high is None else f"from {significant(low)} to {significant(high)}"
    )


def refuse_disorder(low: float | None, high: float | None) -> None:
    """Raise ValueError for bounds between which no value lies."""
    if low is not None and high is not None and low > high:
        raise ValueError(f"min, {low:g}, is more than max, {high:g}")


def is_within(value: float, low: float | None, high: float | None) -> bool:
    """Return whether the value is within. Bounds count, also where 32 bits cannot hold them exactly; NaN does not."""
    above = low is None or value >= low - ROUNDING * max(1.0, abs(low))
    below = high is None or value <= high + ROUNDING * max(1.0, abs(high))
    return above and below and value == value  # noqa: PLR0124 - NaN is not itself


FLOAT32 = 1e-6
MOVED_MIN = 3
"""Of a list of two numbers, both are told."""
SQUARED_MIN = 2
"""The square of smaller numbers is too near to twice or half of them, or to themselves."""
SLIP = 5e-3
"""By what share a number in another unit may differ from the one that is meant."""
UNITS = (
    (math.degrees(1), "degrees", "radians"),
    (60, "minutes", "hours"),
    (3600, "seconds", "hours"),
    (3.6, "km/h", "m/s"),
    (100, "centimetres", "metres"),
    (1000, "millimetres", "metres"),
)
"""Pairs of units that are mixed up: how many of the smaller one make the larger one."""


class Difference(NamedTuple):
    """`path` is the field as one writes it (`pose.x`, `names[2]`), empty for the whole. `nan`: one of both is NaN."""

    path: str
    why: str
    nan: bool = False

    def __str__(self) -> str:
        return f"{self.path}: {self.why}" if self.path else self.why


def differences(got: object, wanted: object, tolerance: float, path: str = "") -> Iterator[Difference]:
    """Yield each place in which `got` is not as `wanted`; fields that `wanted` leaves out do not matter."""
    if isinstance(got, float) and isinstance(wanted, str):
        # A rubric may give NaN and infinity as text.
        wanted = NOT_FINITE.get(wanted, wanted)
    if isinstance(wanted, Mapping):
        yield from _in_fields(got, wanted, tolerance, path)
    elif isinstance(wanted, list | tuple):
        # A list of uint8 is decoded as bytes.
        yield from _in_items(list(got) if isinstance(got, bytes) else got, wanted, tolerance, path)
    elif not _equal(got, wanted, tolerance):
        why = f"{value_text(got)}, not {value_text(wanted)}{_kinds(got, wanted)}"
        nan = any(isinstance(one, float) and math.isnan(one) for one in (got, wanted))
        yield Difference(path, f"{why}{unit_slip(got, wanted)}", nan)


def near_texts(values: Iterable[object], wanted: object) -> tuple[str, ...]:
    """Return the texts among the values that look like a slip of the text that is wanted."""
    texts = [one for one in values if isinstance(one, str) and one]
    return near_names(wanted, texts) if isinstance(wanted, str) else ()


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
        came = len(got) if isinstance(got, list | tuple) and len(wanted) >= MOVED_MIN else None
        count = "" if came is None else f" ({plural(came, 'value')}, not {len(wanted)})"
        yield Difference(path, f"{value_text(got)}, not {value_text(wanted)}{count}")
        return
    each = (
        differences(one, value, tolerance, f"{path}[{index}]")
        for index, (one, value) in enumerate(zip(got, wanted, strict=True))
    )
    first = next(found := chain.from_iterable(each), None)
    if first is None:
        return
    if moved := _moved(got, wanted):
        yield Difference(path, moved)
    else:
        yield first
        yield from found


MOVED = "in another order"


def _moved(got: Sequence[object], wanted: Sequence[object]) -> str:
    """Return where the rarest of a list's numbers is, and where it should be, if each number is there as often as it
    should be; "" for any other list."""
    if len(got) < MOVED_MIN or not all(map(is_number, (*got, *wanted))) or Counter(got) != Counter(wanted):
        return ""
    for number, _ in reversed(Counter(wanted).most_common()):
        here, there = (
            join_words(f"[{index}]" for index, one in enumerate(values) if one == number)
            for values in (got, wanted)
        )
        if here != there:
            by_columns = [n for n in range(2, len(wanted)) if _is_by_columns(got, wanted, n)]
            how = f"{MOVED}: {value_text(number)} is at {here}, not at {there}"
            if len(by_columns) == 1:
                how += f", column by column: a cell's index is `row * {by_columns[0]} + column`"
            return how
    return ""


def was_right(found: Sequence[Reading], why: str, wanted: object, tolerance: float) -> int:
    """Return the number of an earlier message that was right where a list is wrong now, as `why` says; 0 where none
    was."""
    place = why.partition(": ")[0]
    if not place.startswith("["):
        return 0
    for number, one in enumerate(found[:-1], 1):
        places = [d.path for value in one.values for d in differences(value, wanted, tolerance)]
        if places and place not in places and "" not in places:
            return number
    return 0


class _Wanted(Protocol):
    @property
    def topic(self) -> str: ...
    @property
    def field(self) -> str: ...
    def fits(self, reading: Reading) -> bool: ...


KEEP = (
    "keep what was there before from callback to callback: `self.… = 0` in `__init__`, `+=` in the callback"
)


def made_of(found: Sequence[Reading], channels: Iterable[Channel], wanted: _Wanted) -> tuple[str, str] | None:
    """Return how the last value follows from what the grader sent, and what to do: it is the last one of that, but for
    its sign, a sum that takes off what is negative, or a count. None where it does not."""
    came = [abs(value) for one in found for value in one.values if is_number(value)]
    for channel in channels:
        values = (v for one in readings([channel], wanted.field, numbers=False) for v in one.values)
        sent = [value for value in values if is_number(value)]
        sizes, topic = [*map(abs, sent)], channel.topic
        if not channel.by_grader or topic == wanted.topic or len(set(sizes)) <= 1 or not came:
            continue
        if sizes == came:
            return f"each value is the one that came on {topic}", KEEP
        ends = found[-1].values
        if math.isclose(came[-1], abs(sum(sent))) and wanted.fits(found[-1]._replace(values=(sum(sizes),))):
            if is_number(ends[-1]) and ends[-1] and math.isclose(ends[-1], -sum(sent)):
                other = f"it is the sum of what came on {topic}, with the other sign"
                return other, "add `abs(…)` of each value, and take none off"
            return (
                f"it is the sum of what came on {topic}, less what is negative",
                "add `abs(…)` of each value",
            )
        is_sum = any(wanted.fits(found[-1]._replace(values=(sum(each),))) for each in (sent, sizes))
        if ends == (len(sent),) and is_sum and len(sent) not in sizes:
            return f"so many messages came on {topic}", "add what is in each message, and not 1"
    return None


def taken_from(
    got: Reading, wanted: object, channels: Iterable[Channel], topic: str
) -> tuple[str, str, str] | None:
    """Return the topic, the part and the other one of what the grader sent, where a number is to the other part as the
    wanted number is to that part, and no two others are: `linear.x` of `axes[3]` in place of `axes[1]`. Else None."""
    came = got.values[0] if len(got.values) == 1 else None
    if not is_number(came) or not is_number(wanted) or not came or not wanted or abs(came) == abs(wanted):
        return None
    found = set[tuple[str, str, str]]()
    for channel in channels:
        before = bisect(channel.times_ns, got.time_ns)
        if not channel.by_grader or channel.topic == topic or not before or channel.topic in UNREAD:
            continue
        parts = [(name, n) for name, n in _items(channel.values[before - 1]) if is_number(n) and n]
        for (wrong, one), (right, other) in permutations(parts[:ITEMS_MAX], 2):
            if not _is_usual(came, wanted, (one, other)) and math.isclose(
                came / wanted, one / other, rel_tol=ITEM_ROUNDING
            ):
                found.add((channel.topic, right, wrong))
    return found.pop() if len(found) == 1 else None


def _is_usual(came: float, wanted: float, parts: tuple[float, float]) -> bool:
    """Return whether numbers are as they are by chance: alike, one a round part of the other, or small whole ones."""
    ratio = came / wanted
    is_round = any(abs(one - round(one)) < ITEM_ROUNDING for one in (HALVES * ratio, HALVES / ratio))
    are_same = all(map(partial(math.isclose, rel_tol=ITEM_ROUNDING), parts, (came, wanted)))
    is_itself = are_same and not all(abs(one) < SMALL and one == int(one) for one in parts)
    return abs(parts[0]) == abs(parts[1]) or (is_round and not is_itself)


HALVES, SMALL = 2, 20
UNREAD = frozenset({"/clock", "/tf", "/tf_static"})
ITEMS_MAX = 12
ITEM_ROUNDING = 1e-5


def _items(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Yield all parts of a message that are no lists and maps, those of short lists too."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            if name != "header":
                yield from _items(inner, f"{path}.{name}" if path else str(name))
    elif isinstance(value, list | tuple):
        for n, inner in enumerate(value[:ITEMS_MAX]):
            yield from _items(inner, f"{path}[{n}]")
    else:
        yield path, value


def _are_the_same(got: Sequence[object], wanted: Sequence[object]) -> bool:
    """Return whether two lists have the same different numbers, a float's rounding aside."""
    ours, theirs = (sorted(one for one in each if is_number(one)) for each in (got, wanted))
    is_whole = len(ours) == len(got) == len(theirs) > 1 and theirs[0] != theirs[-1]
    return is_whole and all(math.isclose(a, b, rel_tol=ROUNDING) for a, b in zip(ours, theirs, strict=True))


def one_for_another(values: Sequence[object], wanted: object) -> str:
    """Return what to write where a list is empty, or all its wrong items have one number in place of another one; ""
    elsewhere."""
    got = values[0] if len(values) == 1 else None
    if got in ((), []) and isinstance(wanted, list | tuple):
        return "fill the list above the line that publishes it: it is still empty there"
    if not isinstance(got, list | tuple) or not isinstance(wanted, list | tuple) or len(got) != len(wanted):
        return ""
    if _are_the_same(got, wanted):
        return f"the values are right and in another order: it has to be {value_text(wanted)}"
    pairs = {(a, b) for a, b in zip(got, wanted, strict=True) if a != b and is_number(a) and is_number(b)}
    if len(pairs) != 1 or sorted(map(str, got)) == sorted(map(str, wanted)):
        return ""
    ((other, right),) = pairs
    still = value_text(other) in map(value_text, wanted)
    return "" if still else f"where the list has {value_text(other)}, it has to have {value_text(right)}"


def turned_wrong(found: Sequence[Reading], wanted: object) -> int:
    """Return when an item of a list first got a wrong value that it still has in the last message (ns); 0 where none
    did, and was left wrong alone."""
    lists = [one.values[0] for one in found if one.values and isinstance(one.values[0], list | tuple)]
    if len(lists) != len(found) or not isinstance(wanted, list | tuple):
        return 0
    for one, now in zip(found, lists, strict=True):
        items = zip(now, lists[0], lists[-1], wanted, strict=False)
        if any(item == end not in (first, right) for item, first, end, right in items):
            return one.time_ns
    return 0


def _is_by_columns(got: Sequence[object], wanted: Sequence[object], width: int) -> bool:
    """Whether the columns of `wanted`, in rows of `width`, follow each other in `got`."""
    columns = chain.from_iterable(wanted[start::width] for start in range(width))
    return len(wanted) % width == 0 and list(columns) == list(got)


def _equal(got: object, wanted: object, tolerance: float) -> bool:
    if not is_number(got) or not is_number(wanted):
        # In Python, 1 equals true.
        return type(got) is type(wanted) and got == wanted
    assert isinstance(got, int | float)  # noqa: S101 - for the type checker
    assert isinstance(wanted, int | float)  # noqa: S101 - as above
    # By the relative tolerance of `_close`, large whole numbers could differ.
    exact = isinstance(got, int) and isinstance(wanted, int)
    return abs(got - wanted) <= tolerance if exact else _close(got, wanted, tolerance)


def _close(got: float, wanted: float, tolerance: float) -> bool:
    """A 32-bit field cannot hold every number exactly."""
    both_nan = math.isnan(got) and math.isnan(wanted)
    return both_nan or math.isclose(got, wanted, rel_tol=FLOAT32, abs_tol=tolerance)


def unit_slip(got: object, wanted: object) -> str:
    """Return in brackets what is odd about a number that is right but for its unit or its sign; "" for any other."""
    if not (is_number(got) and is_number(wanted) and got and wanted):
        return ""
    if isinstance(got, int) and isinstance(wanted, int):  # numbers of things
        return ""
    others = {-wanted: "the sign is wrong"}
    if wanted > SQUARED_MIN:
        others[wanted**2] = "the square of that, as without a square root"
    for factor, small, large in UNITS:
        if math.isclose(got, wanted * factor, rel_tol=SLIP):
            return f" ({significant(factor)} times too large, as {small} in place of {large} are)"
        if math.isclose(got * factor, wanted, rel_tol=SLIP):
            return f" ({significant(factor)} times too small, as {large} in place of {small} are)"
    return next((f" ({what})" for n, what in others.items() if math.isclose(got, n, rel_tol=SLIP)), "")


def has_hole(value: object) -> bool:
    """Return whether a list or map has a key or an item without anything."""
    inside = (
        value.values() if isinstance(value, Mapping) else value if isinstance(value, list | tuple) else ()
    )
    return any(one is None or has_hole(one) for one in inside)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether it is a number, and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _kinds(got: object, wanted: object) -> str:
    """Return what `'3', not 3` means."""
    kinds = {str: "text", bool: "true or false", int: "a number", float: "a number"}
    first, second = kinds.get(type(got), ""), kinds.get(type(wanted), "")
    return f" ({first}, not {second})" if first and second and first != second else ""


def fields_text(value: Mapping[str, Any]) -> str:
    """Return a request's or an answer's fields on one line."""
    return shown(", ".join(f"{name}: {value_text(one)}" for name, one in value.items())) or "nothing"


def as_numbers(found: Sequence[Reading], values: Sequence[object]) -> Sequence[Reading]:
    """Return the readings with numbers in place of texts where numbers are asked for, and each text is one: that the
    type is another one says another criterion. Otherwise they are returned as they are."""
    texts = [one for reading in found for one in reading.values]
    asked = all(isinstance(one, int | float) and not isinstance(one, bool) for one in values)
    if not asked or not all(isinstance(one, str) and _PLAIN_NUMBER.fullmatch(one.strip()) for one in texts):
        return found
    return [one._replace(values=tuple(map(float, one.values))) for one in found]


_PLAIN_NUMBER = re.compile(r"[+-]?\d{1,15}(?:\.\d{0,9})?")


def begins_later(
    found: Sequence[Reading], values: Sequence[object], is_at: Callable[[Reading, object], bool]
) -> str:
    """Return how a topic begins, where all of these values come in order but the first; "" where they do not. The first
    may come at the end, where the same values begin again."""
    rest = iter(found)
    if len(values) < 3 or not all(any(is_at(one, value) for one in rest) for value in values[1:]):
        return ""
    begins = value_text(found[0].values[0])
    return f"is not {value_text(values[0])} before {value_text(values[1])}: it begins with {begins}"


def value_text(value: object) -> str:
    """Return a value as `rosservice` and YAML show it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return str(NOT_FINITE.get(value, f"'{value}'"))
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {value_text(one)}" for name, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(value_text, value)) + "]"
    return f"{value:.7g}" if isinstance(value, float) else str(value)
