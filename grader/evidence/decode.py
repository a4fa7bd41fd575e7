"""Decode and encode messages and service calls with rosbags, from their recorded definitions.

Nothing that ROS or a student generated is ever imported.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

from grader.evidence.definitions import (
    PACKAGE,
    PRIMITIVES,
    DefinitionError,
    Field,
    Types,
    alias,
    bound,
    canonical,
    parse,
)
from grader.evidence.run import DECODED_BYTES_MAX
from grader.installable import noetic_definitions
from grader.model.message_definitions import RULE

Value: TypeAlias = Any
"""What a message holds: numbers, text, bytes, lists and dicts of these."""

KEPT_LETTERS_MAX = 8_000
"""Longer definitions make much code, which is not kept for later."""
_LETTERS = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q",
    "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""What `struct` calls ROS's numbers."""


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
        if self._plan is None or self.decoded_bytes(len(data)) > DECODED_BYTES_MAX:
            return None
        try:
            return self._plan.decode(data)
        except (SerdeError, struct.error, ValueError, IndexError, OverflowError):
            return None

    def from_cdr(self, data: bytes) -> bytes:
        """Return a message of ROS 2 (little-endian CDR) as ROS 1's bytes; none where it does not fit the definition."""
        if self._plan is None or self.decoded_bytes(len(data)) > DECODED_BYTES_MAX:
            return b""
        try:
            return self._plan.from_cdr(data)
        except (SerdeError, struct.error, ValueError, IndexError, OverflowError, AssertionError):
            return b""


class Encoder:
    """Makes messages of one type from its full definition. Raises ValueError for one that cannot be followed."""

    def __init__(self, type: str, definition: str) -> None:  # noqa: A002 - ROS's own word
        plan = _plan(type, definition)
        if plan is None:
            raise ValueError(f"the definition of {type} cannot be followed")
        self._plan = plan

    def encode(self, value: Mapping[str, Any]) -> bytes:
        """Return the message's bytes; fields that `value` leaves out are zero. Raises ValueError where it does
        not fit."""
        return self._plan.encode(value)


class _Plan:
    def __init__(self, type_: str, definition: str) -> None:
        self._types: Types = parse(type_, definition)
        self.bound = bound(self._types)
        self._type = type_
        self._store = get_typestore(Stores.EMPTY)
        self._store.register(get_types_from_msg(canonical(self._types), f"{PACKAGE}/{alias(type_)}"))
        self._name = f"{PACKAGE}/msg/{alias(type_)}"
        self._store.get_msgdef(self._name)
        self._numbers = _as_struct(self._types[type_])
        self._names = [field.name for field in self._types[type_]]

    def decode(self, data: bytes) -> dict[str, Any]:
        if self._numbers is not None:  # as rosbags would, in half of the time
            return dict(zip(self._names, self._numbers.unpack(data), strict=True))
        if not self._types[self._type] and not data:
            return {}
        return self._plain(self._type, self._store.deserialize_ros1(data, self._name))

    def from_cdr(self, data: bytes) -> bytes:
        """Return nothing for a message without fields, of which CDR makes a byte."""
        return bytes(self._store.cdr_to_ros1(data, self._name)) if self._types[self._type] else b""

    def encode(self, value: Mapping[str, Any]) -> bytes:
        if not self._types[self._type]:
            return _nothing(self._type, value)
        message = _message(self._store, self._name, self._rename_fields(self._type, value))
        try:
            return bytes(self._store.serialize_ros1(message, self._name))
        except (struct.error, OverflowError, SerdeError, AttributeError, TypeError) as error:
            raise ValueError(f"{self._type} cannot hold {value!r}: {error}") from error

    def _rename_fields(self, type_: str, value: Value) -> Value:
        """Return the fields by the names that they have in generated code."""
        if not isinstance(value, Mapping):
            raise ValueError(f"{type_} is made of fields, not {value!r}")  # noqa: TRY004 - as every other misfit
        fields = {f.name: f for f in self._types[type_]}
        if unknown := value.keys() - fields.keys():
            raise ValueError(f"{type_} has no field {', '.join(sorted(map(str, unknown)))}")
        return {fields[name].attribute: self._inner(fields[name], item) for name, item in value.items()}

    def _inner(self, field: Field, value: Value) -> Value:
        if field.primitive:
            return value
        if field.array:
            return [self._rename_fields(field.type, item) for item in value]
        return self._rename_fields(field.type, value)

    def _plain(self, type_: str, message: object) -> dict[str, Any]:
        return {f.name: self._value(f, getattr(message, f.attribute)) for f in self._types[type_]}

    def _value(self, field: Field, value: Value) -> Value:
        if not field.primitive:
            if field.array:
                return [self._plain(field.type, item) for item in value]
            return self._plain(field.type, value)
        if not field.array:
            return value
        if field.type == "uint8":
            return value.tobytes()
        return value if field.type == "string" else value.tolist()


def _as_struct(fields: Sequence[Field]) -> struct.Struct | None:
    """Return how numbers lie in a message that has nothing else; None for any other."""
    letters = [_LETTERS.get(field.type, "") for field in fields if not field.array]
    return (
        struct.Struct("<" + "".join(letters))
        if fields and all(letters) and len(letters) == len(fields)
        else None
    )


def _plan(type_: str, definition: str) -> _Plan | None:
    return (
        _cached_plan(type_, definition)
        if len(definition) <= KEPT_LETTERS_MAX
        else _make_plan(type_, definition)
    )


@lru_cache(maxsize=64)
def _cached_plan(type_: str, definition: str) -> _Plan | None:
    return _make_plan(type_, definition)


def _make_plan(type_: str, definition: str) -> _Plan | None:
    try:
        return _Plan(type_, definition)
    except (DefinitionError, TypesysError, SyntaxError, RecursionError):
        return None


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


def _message(store: Typestore, name: str, value: Mapping[str, Any]) -> object:
    fields = store.fielddefs[name][1]
    if unknown := value.keys() - {n for n, _ in fields}:
        raise ValueError(f"{name} has no field {', '.join(sorted(unknown))}")
    kept = [(n, desc) for n, desc in fields if n != "structure_needs_at_least_one_member"]
    return store.types[name](*[_field(store, desc, value.get(n)) for n, desc in kept])


def _field(store: Typestore, desc: Value, value: Value) -> Value:
    kind, detail = desc
    if kind == Nodetype.BASE:
        return _zero(detail[0]) if value is None else _check_value(detail[0], value)
    if kind == Nodetype.NAME:
        if value is not None and not isinstance(value, Mapping):
            raise ValueError(f"a map of fields is asked for, not {value!r}")
        return _message(store, detail, value or {})
    inner, size = detail
    if value is not None and not isinstance(value, list | tuple | bytes):
        raise ValueError(f"a list is asked for, not {value!r}")
    items = list(value) if value is not None else [None] * (size if kind == Nodetype.ARRAY else 0)
    converted = [_field(store, inner, item) for item in items]
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.array(converted, dtype=_dtype(inner[1][0]))
    return converted


def _nothing(type_: str, value: Mapping[str, Any]) -> bytes:
    if value:
        raise ValueError(f"{type_} has no field {', '.join(sorted(value))}")
    return b""


def _dtype(base: str) -> str:
    return {"byte": "int8", "char": "uint8"}.get(base, base)


def _zero(base: str) -> Value:
    return "" if base == "string" else False if base == "bool" else 0


FLOAT32_MAX = float(np.finfo(np.float32).max)


def _check_value(base: str, value: Value) -> Value:
    wanted = {"string": str, "bool": bool}.get(base, (int, float) if base.startswith("float") else int)
    if not isinstance(value, wanted) or (isinstance(value, bool) and base != "bool"):
        raise ValueError(f"{value!r} is no {base}")
    if isinstance(value, int) and wanted is int:
        bits = 8 * PRIMITIVES[_dtype(base)]
        low = 0 if _dtype(base).startswith("u") else -(1 << bits - 1)
        if not low <= value < low + (1 << bits):
            raise ValueError(f"{value} is out of range for {base}")
    if base == "float32" and FLOAT32_MAX < abs(value) < float("inf"):
        raise ValueError(f"{value} is out of range for {base}")
    return value


FindText = Callable[[str], str | None]
"""From a message type to the text of its `.msg` file, None where there is none."""

_TYPE = re.compile(r"^\s*([A-Za-z][\w/]*)\s*(?:\[\d*\])?\s+[A-Za-z]\w*\s*$", re.ASCII)
_BUILT_IN = {*PRIMITIVES, "byte", "char", "time", "duration"}
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
    sections = [text, *(f"MSG: {name}\n{part}" for name, part in parts.items())]
    return f"\n{RULE}\n".join(sections)


def _text_of(name: str, find_text: FindText) -> str:
    """Return the type's own text, without the parts that come behind it in a full definition."""
    found = find_text(name)
    return found if found is not None else definition(name).partition(RULE)[0]


def _needed_types(text: str, package: str) -> list[str]:
    types = (match[1] for line in text.splitlines() if (match := _TYPE.match(line.partition("#")[0])))
    return [full_name(name, package) for name in types if name not in _BUILT_IN]


def full_name(name: str, package: str) -> str:
    """Return the whole name of a type that a definition of `package` names."""
    if "/" in name:
        return name
    return "std_msgs/Header" if name == "Header" else f"{package}/{name}"
