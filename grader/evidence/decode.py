"""Decode and encode messages and service calls as ROS 1 sends them, from their recorded definitions.

Nothing that ROS or a student generated is ever imported, and no code is made of a definition. The fields of a message
follow one another without a gap (wiki.ros.org/msg): numbers with their lowest byte first; before a text, and before an
array that can grow, its length in four bytes.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

from grader.evidence.definitions import (
    LETTERS,
    PRIMITIVES,
    Bound,
    DefinitionError,
    Field,
    Types,
    bound,
    full_name,
    parse,
)
from grader.evidence.run import DECODED_BYTES_MAX
from grader.installable import noetic_definitions
from grader.model.message_definitions import RULE

Value: TypeAlias = Any
"""What a message holds: numbers, text, bytes, lists and dicts of these."""
Read: TypeAlias = Callable[[bytes, int], tuple[Value, int]]
"""From a message's bytes and where a value begins in them to the value and where it ends."""

KEPT_LETTERS_MAX = 8_000
"""What reads messages of longer definitions takes much memory, and is not kept for later."""
FLOAT32_MAX = (2 - 2**-23) * 2.0**127
_LENGTH = struct.Struct("<I")


class Decoder:
    """Decodes the messages of one type. `definition` is the full text as the publisher sent it.

    A definition that cannot be followed makes every message None, and so do bytes that do not fit it exactly.
    """

    def __init__(self, type: str, definition: str) -> None:  # noqa: A002 - ROS's own word
        self._plan = _plan(type, definition)

    @property
    def usable(self) -> bool:
        """False where the definition itself could not be followed."""
        return self._plan is not None

    def decoded_bytes(self, message_bytes: int) -> int:
        """Return about how much memory a message of that size takes once decoded, at most."""
        return self._plan.bound.decoded(message_bytes) if self._plan is not None else 0

    def decode(self, data: bytes) -> Value:
        """Return a dict of the message's fields: numbers, bool, str, bytes for `uint8[]`, lists, dicts; or None.

        `time` and `duration` become `{"secs": …, "nsecs": …}`. None too for what would take more memory than
        a whole recording may.
        """
        plan = self._plan
        # Before anything is read: a few bytes can stand for millions of values.
        if plan is None or plan.bound.decoded(len(data)) > DECODED_BYTES_MAX:
            return None
        try:
            value, end = plan.read(data, 0)
        except (struct.error, ValueError):
            return None
        # Bytes that are left over show that the definition is not this message's.
        return value if end == len(data) else None


class Encoder:
    """Makes messages of one type from its full definition. Raises ValueError for one that cannot be followed."""

    def __init__(self, type: str, definition: str) -> None:  # noqa: A002 - ROS's own word
        plan = _plan(type, definition)
        if plan is None:
            raise ValueError(f"the definition of {type} cannot be followed")
        self._type, self._types = type, plan.types

    def encode(self, value: Mapping[str, Any]) -> bytes:
        """Return the message's bytes; fields left out are zero. Raises ValueError where the value does not fit."""
        try:
            return b"".join(self._fields(self._type, value))
        except (struct.error, OverflowError) as error:
            raise ValueError(f"{self._type} cannot hold {value!r}: {error}") from error

    def _fields(self, type_: str, value: Value) -> Iterator[bytes]:
        if not isinstance(value, Mapping):
            raise ValueError(f"{type_} is made of fields, not {value!r}")  # noqa: TRY004 - as every other misfit
        fields = self._types[type_]
        if unknown := value.keys() - {field.name for field in fields}:
            raise ValueError(f"{type_} has no field {', '.join(sorted(map(str, unknown)))}")
        for field in fields:
            if field.array:
                yield from self._array(field, value.get(field.name))
            elif field.primitive:
                item = value.get(field.name)
                yield _primitive_bytes(field.type, _zero(field.type) if item is None else item)
            else:
                yield from self._fields(field.type, value.get(field.name, {}))

    def _array(self, field: Field, value: Value) -> Iterator[bytes]:
        if value is None:
            value = [_zero(field.type) if field.primitive else {}] * (field.size or 0)
        if not isinstance(value, list | tuple | bytes):
            raise ValueError(f"a list is asked for, not {value!r}")  # noqa: TRY004 - as every other misfit
        if field.size is None:
            yield _LENGTH.pack(len(value))
        elif len(value) != field.size:
            raise ValueError(f"{field.name} holds {field.size}, not {len(value)}")
        if letter := LETTERS.get(field.type):
            yield struct.pack(f"<{len(value)}{letter}", *[_check_value(field.type, item) for item in value])
            return
        for item in value:
            if field.primitive:
                yield _primitive_bytes(field.type, item)
            else:
                yield from self._fields(field.type, item)


def _primitive_bytes(type_: str, value: Value) -> bytes:
    checked = _check_value(type_, value)
    if type_ == "string":
        text: bytes = checked.encode()
        return _LENGTH.pack(len(text)) + text
    return struct.pack("<" + LETTERS[type_], checked)


class _Plan(NamedTuple):
    """A definition as its types, with what their messages take once decoded, and what reads them."""

    types: Types
    bound: Bound
    read: Read


def _plan(type_: str, definition: str) -> _Plan | None:
    is_kept = len(definition) <= KEPT_LETTERS_MAX
    return (_make_plan if is_kept else _make_plan.__wrapped__)(type_, definition)


@lru_cache(maxsize=64)
def _make_plan(type_: str, definition: str) -> _Plan | None:
    try:
        types = parse(type_, definition)
    except DefinitionError:
        return None
    return _Plan(types, bound(types), _Readers(types).of(type_))


class _Readers:
    """Makes what reads values of these types: of each type once."""

    def __init__(self, types: Types) -> None:
        self._types = types
        self._known: dict[str, Read] = {}

    def of(self, type_: str) -> Read:
        """Return what reads a message of this type."""
        if type_ not in self._known:
            fields = self._types[type_]
            numbers = _as_struct(fields)
            self._known[type_] = (
                _fields([(field.name, self._field(field)) for field in fields])
                if numbers is None
                else _numbers([field.name for field in fields], numbers)
            )
        return self._known[type_]

    def _field(self, field: Field) -> Read:
        if field.type == "uint8" and field.array:
            return _sized(field.size, _raw)
        if field.type in LETTERS and field.array:
            return _sized(field.size, _list_of_numbers(LETTERS[field.type]))
        if field.type in LETTERS:
            return _number(struct.Struct("<" + LETTERS[field.type]))
        one = _text if field.type == "string" else self.of(field.type)
        return _sized(field.size, _list_of(one)) if field.array else one


def _as_struct(fields: Sequence[Field]) -> struct.Struct | None:
    """Return how numbers lie in a message that has nothing else; None for any other."""
    # One call of `struct` for all of a message of numbers alone: of these a run has most.
    letters = [LETTERS.get(field.type, "") for field in fields if not field.array]
    return (
        struct.Struct("<" + "".join(letters))
        if fields and all(letters) and len(letters) == len(fields)
        else None
    )


def _fields(readers: Sequence[tuple[str, Read]]) -> Read:
    def read(data: bytes, at: int) -> tuple[Value, int]:
        found: dict[str, Value] = {}
        for name, reader in readers:
            found[name], at = reader(data, at)
        return found, at

    return read


def _numbers(names: Sequence[str], numbers: struct.Struct) -> Read:
    return lambda data, at: (dict(zip(names, numbers.unpack_from(data, at), strict=True)), at + numbers.size)


def _number(number: struct.Struct) -> Read:
    return lambda data, at: (number.unpack_from(data, at)[0], at + number.size)


def _text(data: bytes, at: int) -> tuple[Value, int]:
    (size,) = _LENGTH.unpack_from(data, at)
    text, end = _raw(data, at + _LENGTH.size, size)
    return text.decode(), end


ReadMany: TypeAlias = Callable[[bytes, int, int], tuple[Value, int]]
"""As `Read`, of an array with so many values."""


def _sized(size: int | None, read: ReadMany) -> Read:
    if size is not None:
        return lambda data, at: read(data, at, size)
    return lambda data, at: read(data, at + _LENGTH.size, _LENGTH.unpack_from(data, at)[0])


def _raw(data: bytes, at: int, count: int) -> tuple[Value, int]:
    end = at + count
    if end > len(data):
        raise ValueError("more bytes are told than there are")
    return data[at:end], end


def _list_of_numbers(letter: str) -> ReadMany:
    size = struct.calcsize("<" + letter)

    def read(data: bytes, at: int, count: int) -> tuple[Value, int]:
        part, end = _raw(data, at, count * size)
        return list(struct.unpack(f"<{count}{letter}", part)), end

    return read


def _list_of(one: Read) -> ReadMany:
    def read(data: bytes, at: int, count: int) -> tuple[Value, int]:
        items = []
        for _ in range(count):
            item, at = one(data, at)
            items.append(item)
        return items, at

    return read


def encode(type: str, value: Mapping[str, Any]) -> bytes:  # noqa: A002 - ROS's own word
    """Return the bytes of a message of one of ROS Noetic's own types; fields that `value` leaves out are zero.

    Raises ValueError for a type or field that does not exist and for a value that does not fit.
    """
    return Encoder(type, definition(type)).encode(value)


def definition(type: str) -> str:  # noqa: A002 - ROS's own word
    """Return the full definition of one of ROS Noetic's own types. Raises ValueError for any other."""
    return _of_noetic(type)[0]


def md5sum(type: str) -> str:  # noqa: A002 - ROS's own word
    """Return the type's MD5 sum as ROS computes it. Raises ValueError for a type that is not ROS Noetic's own."""
    return _of_noetic(type)[1]


def _of_noetic(type_: str) -> tuple[str, str]:
    if type_ not in noetic_definitions():
        raise ValueError(f"ROS Noetic has no message type {type_}")
    return noetic_definitions()[type_]


def _zero(base: str) -> Value:
    return "" if base == "string" else False if base == "bool" else 0


def _check_value(base: str, value: Value) -> Value:
    wanted = {"string": str, "bool": bool}.get(base, (int, float) if base.startswith("float") else int)
    if not isinstance(value, wanted) or (isinstance(value, bool) and base != "bool"):
        raise ValueError(f"{value!r} is no {base}")
    if isinstance(value, int) and wanted is int:
        bits = 8 * PRIMITIVES[base]
        low = 0 if base.startswith("u") else -(1 << bits - 1)
        if not low <= value < low + (1 << bits):
            raise ValueError(f"{value} is out of range for {base}")
    if base == "float32" and FLOAT32_MAX < abs(value) < float("inf"):
        raise ValueError(f"{value} is out of range for {base}")
    return value


FindText = Callable[[str], str | None]
"""From a message type to the text of its `.msg` file, None where there is none."""

_TYPE = re.compile(r"^\s*([A-Za-z][\w/]*)\s*(?:\[\d*\])?\s+[A-Za-z]\w*\s*$", re.ASCII)
_BUILT_IN = {*PRIMITIVES, "byte", "char", "time", "duration"}
# Far more than any type of ROS's own needs.
_PARTS_MAX = 100


def full_definition(type_: str, text: str, find_text: FindText) -> str:
    """Return a type's text with a `MSG:` part for each type that it needs. Raises ValueError where one is nowhere."""
    package = type_.partition("/")[0]
    parts: dict[str, str] = {}
    waiting = _needed_types(text, package)
    while waiting:
        name = waiting.pop()
        if name in parts:
            continue
        if len(parts) > _PARTS_MAX:
            raise ValueError(f"{type_} needs more than {_PARTS_MAX} other types")
        parts[name] = _text_of(name, find_text)
        waiting += _needed_types(parts[name], name.partition("/")[0])
    return f"\n{RULE}\n".join([text, *(f"MSG: {name}\n{part}" for name, part in parts.items())])


def _text_of(name: str, find_text: FindText) -> str:
    """Return the type's own text, without the parts that come behind it in a full definition."""
    found = find_text(name)
    return found if found is not None else definition(name).partition(RULE)[0]


def _needed_types(text: str, package: str) -> list[str]:
    types = (match[1] for line in text.splitlines() if (match := _TYPE.match(line.partition("#")[0])))
    return [full_name(name, package) for name in types if name not in _BUILT_IN]
