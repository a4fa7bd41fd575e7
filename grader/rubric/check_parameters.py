"""What a rubric can set of a check: each parameter's type, unit, default and meaning, in a rubric author's words."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable, Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from grader.checks.registry import Refers
from grader.model.record import Record, field_docstrings

UNITS = {"hz": "Hz", "s": "seconds", "m": "metres", "deg": "degrees", "rad": "radians"}
"""By what a parameter's name ends in."""
WORDS: dict[object, str] = {
    str: "text", int: "whole number", float: "number", bool: "`true` or `false`", NoneType: "`null`"
}  # fmt: skip
REFERRED = {
    "process": "process of the scenario",
    "launch": "launch file",
    "program": "`package/program`",
    "message": "message type",
    "service": "service type",
    "field": "type of a field",
    "sent": "topic of a probe",
    "published": "topic of the student's",
    "set": "parameter that the scenario sets",
    "action": "action of the scenario's steps",
    "kept": "file that the scenario keeps",
    "served": "service that the scenario offers",
    "rostest": "`.test` file of the scenario",
    "watched_s": "number",
    "dependency": "text",
    "cause": "condition",
}
REQUIRED = "required"


class Parameter(NamedTuple):
    """One line of the table; `type` has the unit with it, `default` is YAML in code quotes, or `required`."""

    name: str
    type: str
    default: str
    meaning: str


def parameters(record: type[Record]) -> list[Parameter]:
    """Return the parameters in the order of the record."""
    meanings = field_docstrings(record)
    return [
        Parameter(
            name,
            _type(field.metadata, field.annotation) + _unit(name),
            _default(field),
            meanings.get(name, ""),
        )
        for name, field in record.model_fields.items()
    ]


def inner_records(record: type[Record]) -> dict[type[Record], str]:
    """Return the records that a record's fields consist of, at any depth, with their words (`condition`)."""
    annotations = [field.annotation for field in record.model_fields.values()]
    return {kind: _words_of(kind) for one in annotations for kind in _records(one)}


def about(record: type[Record]) -> str:
    """Return the record's own docstring in one line."""
    return " ".join((inspect.getdoc(record) or "").split())


def _records(annotation: object) -> Iterator[type[Record]]:
    if inspect.isclass(annotation) and issubclass(annotation, Record):
        yield annotation
        for field in annotation.model_fields.values():
            yield from _records(field.annotation)
    for member in get_args(annotation):
        yield from _records(member)


def _words_of(record: type[Record]) -> str:
    return "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in record.__name__).strip()


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return REQUIRED
    value = field.get_default(call_default_factory=True, validated_data={})
    plain = list(value) if isinstance(value, tuple) else value
    return f"`{json.dumps(plain)}`"


def _unit(name: str) -> str:
    return next((f", {unit}" for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


def _type(metadata: Iterable[object], annotation: Any) -> str:  # noqa: ANN401 - a type is any object
    """Return a type in a rubric author's words; what it refers to says more than its type."""
    referred = next((REFERRED[one.to] for one in metadata if isinstance(one, Refers)), None)
    if referred:
        return referred
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(inner[1:], inner[0])
    if origin in {Union, UnionType, Literal}:
        return " or ".join(f"`{one}`" if origin is Literal else _type((), one) for one in inner)
    if origin is tuple:
        return f"list of: {_type((), inner[0])}"
    if origin is dict:
        return "map"
    is_record = inspect.isclass(annotation) and issubclass(annotation, Record)
    return _words_of(annotation) if is_record else WORDS.get(annotation, "any value")
