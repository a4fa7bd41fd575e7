"""Make messages of any type from what a rubric says of them: stamps, numbers that change, long arrays.

Types come from the text of `.msg` files and of ROS Noetic's own. Nothing that ROS or a student generated is imported.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeGuard

from grader.evidence.decode import Decoder, Encoder, FindText, definition, full_definition
from grader.evidence.definitions import MAX_DEFINITION_BYTES, PRIMITIVES, Field, full_name, parse, sections_of
from grader.installable import noetic_messages
from grader.model.message_definitions import DIVIDER, NOT_FINITE
from grader.wording import did_you_mean, join_words

# `count` in a rubric is one word for any number of items.
ITEMS_MAX = 1_000_000
NS = 1_000_000_000
CLOCKS = ("time", "duration")
ENDS = ("from", "to")
ACTION_PARTS = {
    "Goal": "actionlib_msgs/GoalID goal_id",
    "Result": "actionlib_msgs/GoalStatus status",
    "Feedback": "actionlib_msgs/GoalStatus status",
}
"""Of an `.action` file in their order, each with what its message holds beside it."""
QUATERNION, ANGLES = "geometry_msgs/Quaternion", "rpy_deg"
"""Wherever a quaternion is asked for, `{rpy_deg: [roll, pitch, yaw]}` can stand."""
FORMS = frozenset({*ENDS, "each", "repeat", "count", "except"})
"""What stands in the place of a value, and is none itself."""
OTHER_TEXTS = {"tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"}
"""Of types that rosbags does not know, and that are needed where their packages are not installed too."""
NOW = re.compile(r"now(?:\s*([+-])\s*(\d+(?:\.\d+)?))?", re.ASCII)
_SPAN = re.compile(r"(\d{1,7})(?:-(\d{1,7}))?", re.ASCII)
_CONSTANT = re.compile(r"(\w+)\s+(\w+)\s*=(.*)", re.ASCII)
_FIELD = re.compile(r"([\w/]+)(\[\d*\])?\s+(\w+)", re.ASCII)


class Moment(NamedTuple):
    """The place of a message in its row, counted from 0; `total` is None for one without an end. Time is ROS's."""

    number: int
    total: int | None
    now_ns: int


FIRST = Moment(0, 1, 0)


class MessageType:
    """A message type with its definition and its MD5 sum. `find_text` returns the text of a `.msg` file, `full` is a
    definition with all its parts.

    Raises ValueError where the type is nowhere, or its text is not a definition.
    """

    def __init__(self, type: str, find_text: FindText = lambda _: None, *, full: str | None = None) -> None:  # noqa: A002 - ROS's own word
        self.type = type
        self.definition = _definition(type, find_text) if full is None else full
        self._types = parse(type, self.definition)  # its reasons are better than the next one's
        self._encoder = Encoder(type, self.definition)

    @property
    def md5sum(self) -> str:
        """As `rosmsg md5` gives it."""
        return md5_of(self.type, self.definition)

    def decode(self, data: bytes) -> Any:  # noqa: ANN401 - a message's value
        """Return the fields of a message; None where the bytes do not fit."""
        return Decoder(self.type, self.definition).decode(data)

    def encode(self, value: object, moment: Moment = FIRST) -> bytes:
        """Return the message's bytes. Raises ValueError where the value does not fit."""
        return self._encoder.encode(_Filling(self._types, moment, shown=False).fields(self.type, value))

    def misfit(self, value: object, moment: Moment = FIRST) -> str:
        """Return why the value does not fit; nothing where it does."""
        try:
            self.encode(value, moment)
        except ValueError as error:
            return str(error)
        return ""

    def shown(self, value: object, moment: Moment = FIRST) -> Any:  # noqa: ANN401 - a message's value
        """Return the value as the evidence has it: stamps and changing numbers filled in, arrays as they are written.

        Raises ValueError as `encode` does.
        """
        found = _Filling(self._types, moment, shown=True).fields(self.type, value)
        return found if _is_fields(value, found) else found["data"]


class ServiceTypes:
    """The request and the response of a service type, from the text of its `.srv` file (wiki.ros.org/srv).

    Raises ValueError for a text that is not a service definition, or needs a type that is nowhere.
    """

    def __init__(self, type: str, text: str, find_text: FindText = lambda _: None) -> None:  # noqa: A002 - ROS's own word
        parts = DIVIDER.split(text)
        if len(parts) != 2:
            raise ValueError(f"{type}: a service has a request and a response with one line --- between them")
        request, response = (full_definition(type, part, find_text) for part in parts)
        self.request = MessageType(f"{type}Request", full=request)
        self.response = MessageType(f"{type}Response", full=response)

    @property
    def md5sum(self) -> str:
        """As `rossrv md5` gives it."""
        parts = (self.request, self.response)
        # Of both texts one behind the other, as genmsg makes it: not of the two sums.
        texts = (_md5_text(p.type, dict(sections_of(p.type, p.definition)), {}) for p in parts)
        return hashlib.md5("".join(texts).encode(), usedforsecurity=False).hexdigest()


def _definition(type_: str, find_text: FindText) -> str:
    package, _, name = type_.partition("/")
    known = name in noetic_messages().get(package, ())
    text = None if known else find_text(type_) or OTHER_TEXTS.get(type_)
    if text is None:
        return definition(type_)
    if len(text) > MAX_DEFINITION_BYTES:
        raise ValueError(f"{type_}: its definition is too long")
    return full_definition(type_, text, find_text)


def action_texts(type_: str, text: str) -> dict[str, str]:
    """Return the texts of the messages that an action consists of, from that of its `.action` file, as genaction makes
    them (wiki.ros.org/actionlib). Raises ValueError for a text that is none.
    """
    parts = DIVIDER.split(text)
    if len(parts) != len(ACTION_PARTS):
        raise ValueError(f"{type_}: an action has a goal, a result and feedback with a line --- between them")
    name, found = type_.partition("/")[2], {}
    for (part, about), lines in zip(ACTION_PARTS.items(), parts, strict=True):
        found[f"{type_}{part}"] = lines + "\n"
        found[f"{type_}Action{part}"] = f"Header header\n{about}\n{name}{part} {part.lower()}\n"
    return found


class _Filling:
    """Follows a value along its type. `shown` leaves what JSON cannot hold, or would be long, as it is written."""

    def __init__(self, types: Mapping[str, tuple[Field, ...]], moment: Moment, *, shown: bool) -> None:
        self._types = types
        self._moment = moment
        self._shown = shown

    def fields(self, type_: str, value: object) -> dict[str, Any]:
        known = {field.name: field for field in self._types[type_]}
        if type_ == QUATERNION and isinstance(value, Mapping) and set(value) == {ANGLES}:
            value = self._quaternion(value[ANGLES])
        if not _is_fields(value, known):
            if list(known) != ["data"]:
                raise ValueError(f"{type_} is made of fields ({', '.join(known)}), not {value!r}")
            value = {"data": value}
        for name in value:
            if name not in known:
                others = f"; its fields are {join_words(known)}" if known else ""
                raise ValueError(f"{type_} has no field {name}{did_you_mean(str(name), known) or others}")
        return {name: self._field(known[name], item) for name, item in value.items()}

    def _quaternion(self, angles_deg: object) -> dict[str, float]:
        """Return x, y, z, w for roll, pitch and yaw, as tf's `quaternion_from_euler` does."""
        found = [self._one("float64", angle) for angle in angles_deg] if isinstance(angles_deg, list) else []
        if len(found) != len("rpy") or not all(isinstance(a, int | float) for a in found):
            raise ValueError(f"{ANGLES} are three numbers, roll, pitch and yaw, not {angles_deg!r}")
        half = [math.radians(angle) / 2 for angle in found]
        (cr, cp, cy), (sr, sp, sy) = map(math.cos, half), map(math.sin, half)
        return {
            "x": sr * cp * cy - cr * sp * sy,
            "y": cr * sp * cy + sr * cp * sy,
            "z": cr * cp * sy - sr * sp * cy,
            "w": cr * cp * cy + sr * sp * sy,
        }

    def _field(self, field: Field, value: object) -> Any:  # noqa: ANN401 - a message's value
        if not field.array:
            return self._one(field.type, value)
        value = self._in_turn(value)
        if self._shown and isinstance(value, Mapping):
            return dict(value)
        items = _items(field, value)
        return [self._one(field.type, item) for item in items]

    def _in_turn(self, value: object) -> object:
        turns = _turns(value, ())
        return value if turns is None else turns[self._moment.number % len(turns)]

    def _one(self, type_: str, value: object) -> Any:  # noqa: ANN401 - as above
        if type_ not in PRIMITIVES:
            inner = (
                value if _turns(value, [f.name for f in self._types[type_]]) is None else self._in_turn(value)
            )
            return self._clock(type_, inner) if type_ in CLOCKS else self.fields(type_, inner)
        value = self._in_turn(value)
        if type_ in {"string", "bool"}:
            return value
        if isinstance(value, Mapping):
            value = self._between(value)
            value = value if type_.startswith("float") else round(value)
        if type_.startswith("float") and isinstance(value, str) and value in NOT_FINITE:
            return value if self._shown else NOT_FINITE[value]
        return value

    def _between(self, value: Mapping[str, Any]) -> float:
        first, last = value.get("from"), value.get("to")
        if len(value) != len(ENDS) or not isinstance(first, int | float) or not isinstance(last, int | float):
            form = "{from: 0, to: 1} or {each: […]}"
            raise ValueError(f"a number that changes is written {form}, not {dict(value)!r}")
        if self._moment.total is None:
            raise ValueError("from and to need a last message: give count or duration_s")
        # A single message has the first value.
        return first + (last - first) * self._moment.number / max(1, self._moment.total - 1)

    def _clock(self, type_: str, value: object) -> dict[str, Any]:
        """Return `secs` and `nsecs` for `now`, a number of seconds, or just these two."""
        if isinstance(value, str) and type_ == "time" and (match := NOW.fullmatch(value.strip())):
            ns = self._moment.now_ns + round(float((match[1] or "") + (match[2] or "0")) * NS)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            ns = round(value * NS)
        elif isinstance(value, Mapping):
            return self.fields(type_, value)
        else:
            meant = "now, now-2, now+0.5 or a number of seconds" if type_ == "time" else "a number of seconds"
            raise ValueError(f"{value!r} is no {type_}: write {meant}")
        # A time of ROS's is never before 0.
        secs, nsecs = divmod(ns if type_ == "duration" else max(0, ns), NS)
        return {"secs": secs, "nsecs": nsecs}


def _is_fields(value: object, known: Iterable[str]) -> TypeGuard[Mapping[str, Any]]:
    """Return whether it is a message by its fields, and not the field `data` alone."""
    bare = list(known) == ["data"] and isinstance(value, Mapping) and value and FORMS.issuperset(value)
    return isinstance(value, Mapping) and not bare


def _turns(value: object, fields: object) -> list[Any] | None:
    """Return the items of `{each: […]}`; None for all else, also where the type has a field of that name."""
    if not isinstance(value, Mapping) or set(value) != {"each"} or "each" in fields:  # type: ignore[operator]
        return None
    items = value["each"]
    if not isinstance(items, list) or not items:
        raise ValueError("each needs a list of values that take turns")
    return items


def _items(field: Field, value: object) -> list[Any]:
    if isinstance(value, Mapping):
        value = _repeat(field, value)
    if not isinstance(value, list):
        wrong = f"{field.name} is an array: write a list, or {{repeat: …, count: …}}, not {value!r}"
        raise ValueError(wrong)  # noqa: TRY004 - as every other misfit
    if field.size is not None and len(value) != field.size:
        raise ValueError(f"{field.name} holds {field.size}, not {len(value)}")
    return value


def _repeat(field: Field, value: Mapping[str, Any]) -> list[Any]:
    """Return the items of `{repeat: .inf, count: 360, except: {"150-210": 0.3}}`; both ends of a span belong to it."""
    if "repeat" not in value or not set(value) <= {"repeat", "count", "except"}:
        message = f'{field.name} is an array: write a list, or {{repeat: 0, count: 3, except: {{"1": 5}}}}'
        raise ValueError(message)
    count = value.get("count", field.size)
    if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= ITEMS_MAX:
        raise ValueError(f"count must be a whole number of 0 to {ITEMS_MAX}, not {count!r}")
    items = [value["repeat"]] * count
    others = value.get("except", {})
    if not isinstance(others, Mapping):
        wrong = f'except is a map from places to values, {{"150-210": 0.3}}, not {others!r}'
        raise ValueError(wrong)  # noqa: TRY004 - as every other misfit
    for span, item in others.items():
        match = _SPAN.fullmatch(str(span).replace(" ", ""))
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, -1)
        if not first <= last < count:
            raise ValueError(f'"{span}" is no span of 0 to {count - 1}: write "150" or "150-210"')
        items[first : last + 1] = [item] * (last - first + 1)
    return items


def md5_of(type_: str, full: str) -> str:
    """Return the MD5 sum of a message type from its full definition, as `rosmsg md5` does.

    Raises ValueError for what is not a definition.
    """
    parts = dict(sections_of(type_, full))
    parse(type_, full)  # no loops, and all parts are there
    return _md5(type_, parts, {})


def _md5(type_: str, parts: Mapping[str, tuple[str, ...]], known: dict[str, str]) -> str:
    if type_ not in known:
        known[type_] = hashlib.md5(_md5_text(type_, parts, known).encode(), usedforsecurity=False).hexdigest()
    return known[type_]


def _md5_text(type_: str, parts: Mapping[str, tuple[str, ...]], known: dict[str, str]) -> str:
    constants, fields = [], []
    for line in parts[type_]:
        if (match := _CONSTANT.match(line)) is not None:
            value = match[3] if match[1] == "string" else match[3].partition("#")[0]
            constants.append(f"{match[1]} {match[2]}={value.strip()}")
        elif (match := _FIELD.match(line)) is not None:
            fields.append(_md5_line(type_, match, parts, known))
    # Constants first, whatever their order in the file, as genmsg does.
    return "\n".join([*constants, *fields])


def _md5_line(
    owner: str, match: re.Match[str], parts: Mapping[str, tuple[str, ...]], known: dict[str, str]
) -> str:
    kind, brackets, name = match[1], match[2] or "", match[3]
    if kind in PRIMITIVES or kind in CLOCKS or kind in {"byte", "char"}:
        return f"{kind}{brackets} {name}"
    # In place of a type's name its own sum stands, without brackets, as genmsg has it.
    return f"{_md5(full_name(kind, owner.partition('/')[0]), parts, known)} {name}"
