"""The types of messages, services and actions whose definitions are known before a run, and what fits them.

Those of ROS are known, and those of the students' own whose text the rubric has. Where a criterion asks for some
fields of a type, there may be others: then only a name that is all but one of these is a slip.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any, NamedTuple, TypeGuard

from grader.checks.support.fields import PATH_PARTS, is_number
from grader.evidence.decode import full_definition
from grader.evidence.definitions import Field, Types, parse
from grader.evidence.message_values import ANGLES, CLOCKS, FORMS, NOW, MessageType
from grader.model.message_definitions import DIVIDER, NOT_FINITE, PARTS, integer_limits
from grader.ros_env import ros_packages
from grader.rubric.scenario import Publish
from grader.rubric.yaml_lines import KeyPath, WrittenRubric, as_list, as_map, items_in, parts_of, services_in
from grader.wording import closest, did_you_mean, is_one_edit, join_words

ALMOST = 0.87
"""How alike two names have to be for one to be a slip."""
SUFFIXES = {part: suffix for suffix, parts in PARTS.items() for part in parts}
"""The ending of the file in which a part is defined."""
KINDS = {"string": "a text", "bool": "true or false"}


def slip_of(name: str, there: Iterable[str]) -> str:
    """Return the name that is meant, where this one is all but it; "" for none."""
    names = [one for one in there if one != name]
    # Of names with three letters or fewer, one other letter makes another name.
    same = (one for one in names if one.lower() == name.lower() or (len(name) > 3 and is_one_edit(one, name)))
    return next(same, "") or closest(name, names, cutoff=ALMOST)


def instead_of(name: str, there: Iterable[str]) -> str:
    names = list(there)
    return did_you_mean(name, names) or (f": there is {join_words(names)}" if names else "")


def is_form(value: Any) -> TypeGuard[dict[str, Any]]:  # noqa: ANN401 - any part of a message
    """Return whether a value is made for each message, as `{from: 0, to: 1}` is."""
    return isinstance(value, dict) and bool(value) and {*FORMS, ANGLES}.issuperset(value)


def sent_in_turn(publish: Mapping[str, Any]) -> list[Any]:
    """Return the values that a probe or a step sends, one after the other; `{each: …}` has another item in each
    message."""
    listed = publish.get("values")
    values = listed if isinstance(listed, list) else [publish["value"]] if "value" in publish else []
    most = max((len(items) for _, items in each_in((), values)), default=1)
    if most == 1 or not values:
        return values
    total, rate_hz = publish.get("count"), publish.get("rate_hz", Publish.model_fields["rate_hz"].default)
    if is_number(duration_s := publish.get("duration_s")) and is_number(rate_hz):
        total = max(1, round(duration_s * rate_hz))
    elif total is None:
        total = math.inf if publish.get("background") is True else len(values)
    number = min(len(values) * most, total) if is_number(total) else 1
    return [_at_turn(values[turn % len(values)], turn) for turn in range(int(number))]


def each_in(path: KeyPath, value: object) -> Iterator[tuple[KeyPath, list[Any]]]:
    """Yield where in a value `{each: …}` is, and its items."""
    for key, inner in items_in(value):
        if key == "each" and isinstance(inner, list) and inner:
            yield (*path, key), inner
        yield from each_in((*path, key), inner)


def _at_turn(value: Any, turn: int) -> Any:  # noqa: ANN401 - any part of a message
    """Return a value as the message of this number has it, counted from 0."""
    if (
        isinstance(value, dict)
        and set(value) == {"each"}
        and isinstance(value["each"], list)
        and value["each"]
    ):
        return _at_turn(value["each"][turn % len(value["each"])], turn)
    if isinstance(value, dict):
        return {key: _at_turn(inner, turn) for key, inner in value.items()}
    return [_at_turn(inner, turn) for inner in value] if isinstance(value, list) else value


class TooShort(ValueError):
    """A list that is sent has no item of that number."""


def values_at(value: object, parts: Sequence[str]) -> list[Any] | None:
    """Return what a value that is sent has at a path; None where a form makes it another each time. Raises TooShort."""
    part = parts[0] if parts else ""
    if is_form(value):
        count, is_item = value.get("count"), part[:1] == "[" and part != "[*]"
        if is_item and isinstance(count, int) and int(part[1:-1]) >= count:
            raise TooShort(count)
        return None
    if not parts:
        return [NOT_FINITE.get(value, value) if isinstance(value, str) else value]
    if part[0] != "[":
        # Fields that are left out are zero.
        inside = value.get(part, {} if parts[1:] else 0) if isinstance(value, dict) else None
        return None if inside is None else values_at(inside, parts[1:])
    items = as_list(value)
    if part == "[*]":
        each = [values_at(item, parts[1:]) for item in items]
        return None if None in each else [one for found in each for one in found or ()]
    if int(part[1:-1]) >= len(items):
        raise TooShort(len(items))
    return values_at(items[int(part[1:-1])], parts[1:])


class Misfit(ValueError):
    """Why a path leads to no field, or a value is none of its type."""


class OwnText(NamedTuple):
    """The definition of a type of the students' own; `whole` is False where it may have more fields."""

    text: str
    whole: bool


class Shape(NamedTuple):
    """A message, or one part of a service or an action. `what` is what a fault calls it; of the types in `partial` only
    some fields are known."""

    what: str
    types: Types
    partial: frozenset[str]

    @property
    def root(self) -> Field:
        return Field(name="", attribute="", type=next(iter(self.types)), array=False, size=None)

    def field_at(self, path: str) -> Field | None:
        """Return the field to which a path leads; None where that is not known. Raises Misfit."""
        field, done = self.root, ""
        first, _, rest = path.partition(".")
        names = {one.name for one in self.types[self.root.type]}
        # The name of a callback's argument in place of the message itself.
        if first in {"msg", "message"} and first not in names and re.split(r"\W", rest)[0] in names:
            raise Misfit(f"{self.what} has no field {first}: write {rest}")
        for part in PATH_PARTS.findall(path):
            found = self._item(field, part, done) if part[0] == "[" else self.inner(field, part, done)
            if found is None:
                return None
            field, done = found, done + (part if part[0] == "[" or not done else f".{part}")
        return field

    def inner(self, field: Field, name: str, done: str) -> Field | None:
        """Return a field of a field; None where that is not known. Raises Misfit."""
        there = {one.name: one for one in self.types.get(field.type, ())}
        if not re.fullmatch(r"\w+", name):
            between = f'no field is called "{name}": between a field and its value are a colon and a blank'
            raise Misfit(no_name(name) or between)
        if field.array and there:
            raise Misfit(f"{self.what}: {done} is a list: write {done}[0].{name}, or {done}[*].{name}")
        if name in there:
            return there[name]
        whole = f"{done} of {self.what}" if done else self.what
        if near := slip_of(name, there):
            raise Misfit(f'{whole} has no field {name} (did you mean "{near}"?)')
        if field.type in self.partial:
            return None
        raise Misfit(f"{whole} has no field {name}{instead_of(name, there)}")

    def _item(self, field: Field, part: str, done: str) -> Field:
        if not field.array:
            raise Misfit(f"{self.what}: {done} is not a list")
        if part != "[*]" and field.size is not None and int(part[1:-1]) >= field.size:
            raise Misfit(f"{self.what}: {done} has {field.size} items, counted from 0")
        return replace(field, array=False)

    def misfit(self, value: object) -> str:
        """Return why no message has these fields with these values; empty where one may have."""
        try:
            self.compare(self.root, value, "")
        except Misfit as error:
            return str(error)
        return ""

    def compare(self, field: Field, value: object, done: str) -> None:
        """Raise Misfit where the field can never have the value."""
        fields = {one.name for one in self.types.get(field.type, ())}
        if is_form(value) and fields.isdisjoint(value):
            return  # a value that changes: what is sent is looked at elsewhere
        if field.array:
            self._compare_items(field, value, done)
        elif isinstance(value, Mapping) and not field.primitive:
            for key, item in value.items():
                inner = self.inner(field, str(key), done)
                if inner is not None:
                    self.compare(inner, item, f"{done}.{key}" if done else str(key))
        elif fields and not field.primitive and done and value is not None:
            if field.type in CLOCKS and (is_number(value) or NOW.fullmatch(str(value))):
                return
            name = next(iter(one.name for one in self.types[field.type]))
            raise Misfit(
                f"{done} of {self.what} is {field.type}, not {value!r}: name one field of it, {done}.{name}"
            )
        elif field.primitive and (wrong := no_value(field.type, value)):
            raise Misfit(f"{done} of {self.what} {wrong}")

    def _compare_items(self, field: Field, value: object, done: str) -> None:
        if not isinstance(value, list | tuple):
            raise Misfit(
                f"{self.what}: {done} is a list: give all its values, or name {done}[0] or {done}[*]"
            )
        for number, item in enumerate(value):
            self.compare(replace(field, array=False), item, f"{done}[{number}]")


def no_name(name: str) -> str:
    """Return why no field is called like a path to a field within a field; empty where the name is no such path."""
    first, *rest = name.split(".")
    if not rest or not all(re.fullmatch(r"[A-Za-z]\w*", part) for part in (first, *rest)):
        return ""
    inside = ": {".join([first, *rest]) + ": …" + "}" * len(rest)
    return f'no field is called "{name}": write {inside}, one field within the other'


def no_value(kind: str, value: object) -> str:
    """Return why a field of a primitive type is never so."""
    if isinstance(value, list | tuple | Mapping):
        return f"is one value, not {value!r}"
    if value is None:
        return "is empty here: give it a value"
    wanted = KINDS.get(kind, "a number")
    got = "a text" if isinstance(value, str) else "true or false" if isinstance(value, bool) else "a number"
    if wanted != got and not (kind.startswith("float") and value in {".inf", "-.inf", "+.inf", ".nan"}):
        return f"is {wanted}, not {value!r}"
    low, high = integer_limits(kind) or (0, 0)
    if isinstance(value, float) and low < high and not value.is_integer():
        return f"is {kind}, a whole number, and never {value:g}"
    if isinstance(value, int | float) and low < high and not low <= value <= high:
        return f"is {kind}, {low} to {high}, and never {value:g}"
    return ""


class Definitions:
    """The definitions that are known before a run."""

    def __init__(self, rubric: WrittenRubric, files: Mapping[str, bytes]) -> None:
        paths = [PurePosixPath(path) for path in files if PurePosixPath(path).suffix in PARTS]
        self.of_course = {f"{path.parts[0]}/{path.stem}" for path in paths}
        self._own: dict[tuple[str, str], OwnText] = {
            (f"{path.parts[0]}/{path.stem}", path.suffix): OwnText(
                files[str(path)].decode(errors="replace"), whole=True
            )
            for path in paths
        }
        for _, type_, suffix, own in own_texts(rubric):
            known = self._own.get((type_, suffix))
            # A whole definition says more than some fields of it.
            if known is None or (own.whole and not known.whole):
                self._own[type_, suffix] = own
        self._shapes: dict[tuple[str, str], Shape | None] = {}

    def shape(self, type_: str, part: str = "") -> Shape | None:
        """Return a type's fields; of a service or an action, those of a part. None where they are not known."""
        if (type_, part) not in self._shapes:
            self._shapes[type_, part] = self._shape(type_, part)
        return self._shapes[type_, part]

    def text(self, type_: str, suffix: str) -> OwnText | None:
        """Return what the rubric says of the students' own type."""
        return self._own.get((type_, suffix))

    def messages_of(self, package: str) -> set[str]:
        """Return the names of a package's messages whose definitions the rubric has."""
        types = (type_.partition("/") for type_, suffix in self._own if suffix == ".msg")
        return {name for owner, _, name in types if owner == package}

    def _shape(self, type_: str, part: str) -> Shape | None:
        suffix = SUFFIXES[part]
        own = self._own.get((type_, suffix))
        text = own.text if own else None
        if part and text is None:
            text = ros_packages().text(type_, "srv" if suffix == ".srv" else "action")
            if text is None:
                return None
        try:
            full = (
                MessageType(type_).definition
                if text is None
                else full_definition(type_, DIVIDER.split(text)[PARTS[suffix].index(part)], self._find)
            )
            types = parse(type_, full)
        except (ValueError, IndexError):
            return None
        partial = {name for name in types if (found := self._own.get((name, ".msg"))) and not found.whole}
        partial |= {type_} if own and not own.whole else set()
        what = f"the {part} of {type_}" if part else type_
        return Shape(what, types, frozenset(partial))

    def _find(self, type_: str) -> str | None:
        own = self._own.get((type_, ".msg"))
        return own.text if own else None


def own_texts(rubric: WrittenRubric) -> Iterator[tuple[KeyPath, str, str, OwnText]]:
    """Yield each definition of a type that the rubric has: where, its type, the ending of its file."""
    for criterion in rubric.criteria:
        given = criterion.given
        if criterion.check == "topic-type" and isinstance(given.get("definition"), str):
            path: KeyPath = (*criterion.at, "definition")
            yield path, str(given.get("type")), ".msg", OwnText(given["definition"], whole=True)
        if criterion.check == "definition":
            file = PurePosixPath(str(given.get("file")))
            package = rubric.package_of(criterion.data)
            text = given.get("text")
            own = OwnText(text, whole=True) if isinstance(text, str) and text else _of_fields(file, given)
            if file.suffix in PARTS:
                path = (*criterion.at, "text" if own.whole else "fields")
                yield path, f"{package}/{file.stem}", file.suffix, own
    for name, scenario in rubric.scenarios.items():
        for at, _, one in services_in(scenario):
            if isinstance(one.get("definition"), str):
                path = ("scenarios", name, *at, "definition")
                yield path, str(one.get("type")), ".srv", OwnText(one["definition"], whole=True)
        for at, kind, one in parts_of(scenario):
            if kind == "publish" and isinstance(one.get("definition"), str):
                path = ("scenarios", name, *at, "definition")
                yield path, str(one.get("type")), ".msg", OwnText(one["definition"], whole=True)


def _of_fields(file: PurePosixPath, given: dict[str, Any]) -> OwnText:
    lines: dict[str, list[str]] = {part: [] for part in PARTS.get(file.suffix, ())}
    for name, kind in as_map(given.get("fields")).items():
        part, _, bare = str(name).rpartition(".")
        lines.get(part, []).append(f"{kind} {bare}")
    return OwnText("\n---\n".join("\n".join(part) for part in lines.values()), whole=False)
