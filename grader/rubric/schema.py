"""What a rubric can say: each check's parameters in a rubric author's words, and the JSON Schema for editors.

The schema is of draft 2020-12; each check offers its own parameters and docs.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import reduce
from operator import or_
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import Field, create_model
from pydantic.fields import FieldInfo

from grader.checks import HEADINGS, Check
from grader.checks.registry import Refers
from grader.model.record import Record, describe_fields, field_docstrings
from grader.rubric.consistency import MANUAL
from grader.rubric.fault_words import UNITS
from grader.rubric.model import Criterion, ManualParams, Rubric
from grader.rubric.own_checks import known_checks

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
    "package": "package of the lab",
    "node": "text",
    "cause": "condition",
    "heard": "topic of the scenario's",
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
    """Return the records that a record's fields consist of, at any depth, with their words (`a condition`)."""
    annotations = [field.annotation for field in record.model_fields.values()]
    kinds = dict.fromkeys(kind for one in annotations for kind in _records(one))
    return {
        kind: words if words.endswith("s") else f"a {words}" for kind in kinds for words in [_words_of(kind)]
    }


def about(record: type[Record]) -> str:
    """Return the record's own docstring on one line."""
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


WITHOUT_PLACES = ("Criterion", "Gate", "Group", "Late", "MadeUp", "Needs")
"""Records in which no made-up value stands."""
INSIDE = ("items", "additionalProperties")
PLACE = {
    "description": "A made-up value, or a text with one in it.",
    "anyOf": [
        {
            "type": "object",
            "properties": {
                "made_up": {"type": "string", "description": "Its name in the rubric's `made_up`."}
            },
            "required": ["made_up"],
            "additionalProperties": False,
        },
        {"type": "string", "pattern": r"\{made_up: ?[\w-]+\}"},
    ],
}
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def rubric_schema(checks: Mapping[str, Check] | None = None) -> dict[str, Any]:
    """Return the schema; criteria are a union told apart by `check`. `checks` are those of a rubric, its own among
    them."""
    known = known_checks(Path(), {}) if checks is None else checks
    members: Any = reduce(or_, [_manual(), *(_criterion(known[name]) for name in sorted(known))])
    member = Annotated[members, Field(discriminator="check")]
    criteria = Annotated[tuple[member, ...], Field(min_length=1)]
    model = create_model("Rubric", __base__=Rubric, __doc__=Rubric.__doc__, criteria=(criteria, ...))
    schema = model.model_json_schema(by_alias=True)
    # pydantic writes a pattern for the keys, and with it alone all other keys would pass.
    schema["properties"]["scenarios"]["additionalProperties"] = False
    describe_fields(model, schema)
    for record in inner_records(model):
        describe_fields(record, schema["$defs"].get(record.__name__, {}))
    for name, record_schema in schema["$defs"].items():
        # By prefix, since each check's criterion is a record of its own: `Criterion_rate`.
        if not name.startswith(WITHOUT_PLACES):
            keys = record_schema.get("properties", {})
            keys |= {key: _with_places(found) for key, found in keys.items()}
    schema["$defs"]["Place"] = PLACE
    return {"$schema": DIALECT, **schema, "title": "A rubric of grader"}


def _with_places(found: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a value in which a made-up one may stand for each number, text or choice."""
    about = {name: found[name] for name in ("title", "description", "default") if name in found}
    kinds = found.get("anyOf", [{name: one for name, one in found.items() if name not in about}])
    inner = [dict(kind) for kind in kinds]
    for kind in inner:
        kind |= {name: _with_places(kind[name]) for name in INSIDE if isinstance(kind.get(name), dict)}
        kind |= {name: [_with_places(one) for one in kind[name]] for name in kind.keys() & {"prefixItems"}}
    # Numbers, texts and choices; in lists and maps the values inside have their own.
    if any(kind.get("type", "array") not in {"array", "object", "null"} or "enum" in kind for kind in kinds):
        inner.append({"$ref": "#/$defs/Place"})
    return about | ({"anyOf": inner} if len(inner) > 1 else inner[0])


def _criterion(check: Check) -> type[Criterion]:
    """Return the criterion's record with this check, its parameters and its docs in place."""
    needs_parameters = any(f.is_required() for f in check.params.model_fields.values())
    parameters = Field(alias="with") if needs_parameters else Field(alias="with", default_factory=dict)
    fields: dict[str, Any] = {
        "check": (Literal[check.name], Field(description=check.title)),
        "parameters": (check.params, parameters),
    }
    if check.needs_run:
        fields["scenario"] = (Criterion.model_fields["scenario"].annotation, ...)
    name = "Criterion_" + check.name.replace("-", "_")
    return create_model(name, __base__=Criterion, __doc__=_docs(check), **fields)


def _manual() -> type[Criterion]:
    fields: dict[str, Any] = {
        "check": (Literal[MANUAL], ...),
        "parameters": (ManualParams, Field(alias="with", default_factory=ManualParams)),
    }
    docs = "A person gives the points."
    return create_model("Criterion_manual", __base__=Criterion, __doc__=docs, **fields)


def _docs(check: Check) -> str:
    parts = [f"{heading}: {check.sections[heading]}" for heading in HEADINGS if heading in check.sections]
    return "\n\n".join([check.title, *parts])
