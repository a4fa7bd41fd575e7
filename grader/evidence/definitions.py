"""Reads a recorded ROS 1 message definition into a form that is safe to follow, and to hand to a code generator.

A student's node sends the definition, so what would unroll or nest without end is refused. For messages of ROS 2
(`ros2.py`) rosbags turns definitions into Python code: nothing is passed on to it but their structure, and every type
and field gets a name of ours.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

# Far more than any type of ROS's own has.
MAX_DEFINITION_BYTES = 64 * 1024
MAX_FIELDS = 2_000
MAX_DEPTH = 24
MAX_UNROLLED = 2_000
MAX_ARRAY = 1 << 24
MAX_STEPS = 20_000
STEPS_PER_BYTE = 64
OBJECT_BYTES = 400
"""An object with its fields and the map that is made of it; the next three are what comes on top, about."""
FIELD_BYTES = 8
NUMBER_BYTES = 32
TEXT_BYTES = 60
TEXT_GROWTH = 2

PACKAGE = "recorded"
LETTERS = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q",
    "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""What `struct` calls ROS's numbers."""
PRIMITIVES = {**{name: struct.calcsize(f"<{letter}") for name, letter in LETTERS.items()}, "string": 4}
"""The least bytes of each."""
_SYNONYMS = {"byte": "int8", "char": "uint8"}
_CLOCKS = {"time": ("uint32 secs", "uint32 nsecs"), "duration": ("int32 secs", "int32 nsecs")}
_FIELD = re.compile(
    r"(?P<type>[A-Za-z]\w*(?:/[A-Za-z]\w*)?)\s*(?P<array>\[(?P<size>\d{0,9})\])?\s+(?P<name>[A-Za-z]\w*)",
    re.ASCII,
)
_NAME = re.compile(r"[A-Za-z]\w*/[A-Za-z]\w*", re.ASCII)


class DefinitionError(ValueError):
    """The definition is no ROS 1 message definition, or not one that is safe to follow."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """`attribute` is its name in generated code. `size` is a fixed array's, None for one that grows."""

    name: str
    attribute: str
    type: str
    array: bool
    size: int | None

    @property
    def primitive(self) -> bool:
        return self.type in PRIMITIVES

    @property
    def line(self) -> str:
        kind = self.type if self.primitive else alias(self.type)
        brackets = "" if not self.array else f"[{'' if self.size is None else self.size}]"
        return f"{kind}{brackets} {self.attribute}"


Types = dict[str, tuple[Field, ...]]


def parse(type_: str, definition: str) -> Types:
    """Return the fields of each type that `definition` (full text with `MSG:` parts) needs, the message's own first.

    Raises DefinitionError for everything that is not plainly a sound definition.
    """
    if len(definition.encode(errors="replace")) > MAX_DEFINITION_BYTES:
        raise DefinitionError("the definition is too long")
    if not _NAME.fullmatch(type_):
        raise DefinitionError(f"no message type: {type_!r}")
    sections: dict[str, tuple[str, ...]] = {}
    for name, lines in _sections(type_, definition):
        if sections.setdefault(name, lines) != lines:
            raise DefinitionError(f"{name} is defined twice")
    sections.update(_CLOCKS)
    types = {name: tuple(_fields(name, lines)) for name, lines in sections.items()}
    bounds = _Bounds(types)
    bounds.check(type_, depth=0)
    # A dict keeps the place of a key that comes again: the message's own type stays the first.
    return {type_: types[type_]} | {name: types[name] for name in bounds.known}


def alias(type_: str) -> str:
    """Return a name that says nothing but is the same for the same type: letters and digits only."""
    return "T" + type_.encode().hex()


def canonical(types: Types) -> str:
    """Return the same definitions in names of ours, the message's own first and without its `MSG:` line."""
    parts = ["".join(f"{field.line}\n" for field in fields) for fields in types.values()]
    headings = [f"MSG: {PACKAGE}/{alias(name)}\n" for name in types]
    separator = "=" * 80 + "\n"
    return parts[0] + "".join(f"{separator}{h}{p}" for h, p in zip(headings[1:], parts[1:], strict=True))


def _sections(type_: str, definition: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    for name, lines in sections_of(type_, definition):
        bare = (line.partition("#")[0].strip() for line in lines)
        # a line with = is a constant, and constants are not sent
        yield name, tuple(line for line in bare if line and "=" not in line)


def sections_of(type_: str, definition: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each type of a full definition with its lines, constants and comments too. Raises DefinitionError."""
    name: str | None = type_
    lines: list[str] = []
    for raw in definition.split("\n"):
        line = raw.partition("#")[0].strip()
        if line and set(line) == {"="}:
            yield _check_name(name), tuple(lines)
            name, lines = None, []
        elif name is None and line:
            if not line.startswith("MSG: "):
                raise DefinitionError("a part of the definition has no `MSG:` line")
            name = line.removeprefix("MSG: ").strip()
        elif line:
            lines.append(raw.strip())
    yield _check_name(name), tuple(lines)


def _check_name(name: str | None) -> str:
    if name is None or not _NAME.fullmatch(name):
        raise DefinitionError(f"no message type: {name!r}")
    return name


def _fields(owner: str, lines: tuple[str, ...]) -> Iterator[Field]:
    if len(lines) > MAX_FIELDS:
        raise DefinitionError(f"{owner} has too many fields")
    names: set[str] = set()
    for number, line in enumerate(lines):
        match = _FIELD.fullmatch(line)
        if match is None or match["name"] in names:
            raise DefinitionError(f"not a field: {line!r}")
        names.add(match["name"])
        yield Field(
            name=match["name"],
            attribute=f"f{number}",
            type=_full_type(owner, match["type"]),
            array=match["array"] is not None,
            size=int(match["size"]) if match["size"] else None,
        )


def _full_type(owner: str, type_: str) -> str:
    if type_ in PRIMITIVES or type_ in _CLOCKS:
        return type_
    return _SYNONYMS.get(type_) or full_name(type_, owner.partition("/")[0])


def full_name(name: str, package: str) -> str:
    """Return the whole name of a type that a definition of `package` names."""
    if "/" in name:
        return name
    return "std_msgs/Header" if name == "Header" else f"{package}/{name}"


class Bound(NamedTuple):
    """What decoding one value takes: at least so many bytes, steps, and levels of nesting; in memory at most
    `decoded_bytes`, and `growth` more for every byte of its arrays and texts."""

    size: int
    steps: int
    levels: int
    decoded_bytes: int
    growth: int

    def decoded(self, message_bytes: int) -> int:
        """Return what a message of so many bytes takes in memory, at most."""
        return self.decoded_bytes + self.growth * message_bytes


def bound(types: Types) -> Bound:
    """Return the bound of the first of the types, as `parse` gives them."""
    return _Bounds(types).check(next(iter(types)), depth=0)


class _Bounds:
    """Follows every type once. Steps stay in proportion to bytes: few bytes cannot cost much time."""

    def __init__(self, types: Types) -> None:
        self._types = types
        self.known: dict[str, Bound] = {}

    def check(self, type_: str, *, depth: int) -> Bound:
        """Raise DefinitionError for loops, missing types and what grows out of proportion."""
        if type_ in self.known:
            return self.known[type_]
        if depth > MAX_DEPTH or type_ not in self._types:
            raise DefinitionError(f"{type_} nests too deeply or is not defined")
        fields = self._types[type_]
        inner = [self._field(field, depth) for field in fields]
        found = Bound(
            size=sum(b.size for b in inner),
            steps=1 + sum(b.steps for b in inner),
            levels=1 + max((b.levels for b in inner), default=0),
            decoded_bytes=OBJECT_BYTES + sum(FIELD_BYTES + b.decoded_bytes for b in inner),
            growth=max((b.growth for b in inner), default=0),
        )
        unrolled = sum(f.size or 1 for f in fields if f.type not in PRIMITIVES or f.type == "string")
        if found.levels > MAX_DEPTH or unrolled > MAX_UNROLLED:
            raise DefinitionError(f"{type_} nests too deeply or has too long arrays")
        if found.steps > min(MAX_STEPS, STEPS_PER_BYTE * (1 + found.size)):
            raise DefinitionError(f"{type_} grows out of proportion")
        self.known[type_] = found
        return found

    def _field(self, field: Field, depth: int) -> Bound:
        one = _primitive(field.type) if field.primitive else self.check(field.type, depth=depth + 1)
        if not field.array:
            return one
        # Items without bytes: four bytes of length could stand for four billion of them.
        if one.size == 0 or (field.size or 0) > MAX_ARRAY:
            raise DefinitionError(f"{field.name} is an array without end")
        # Bytes become one object, and Python has its own objects for small numbers.
        light = {"uint8": 2, "int8": FIELD_BYTES, "bool": FIELD_BYTES}
        each = light.get(field.type, one.decoded_bytes + FIELD_BYTES)
        if field.size is None:
            # `-(-a // b)` rounds up: what an item takes for each byte of it.
            return Bound(4, 1, one.levels, OBJECT_BYTES, max(one.growth, -(-each // one.size)))
        at_once = field.primitive and field.type != "string"
        steps = 1 if at_once else 1 + field.size * one.steps
        return Bound(field.size * one.size, steps, one.levels, OBJECT_BYTES + field.size * each, one.growth)


def _primitive(type_: str) -> Bound:
    text = type_ == "string"
    return Bound(PRIMITIVES[type_], 1, 0, TEXT_BYTES if text else NUMBER_BYTES, TEXT_GROWTH if text else 0)
