"""The JSON Schema (draft 2020-12) of a rubric, for editors: each check offers its own parameters and docs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from grader.checks import HEADINGS, Check
from grader.model.record import Record, field_docstrings
from grader.rubric.check_parameters import inner_records
from grader.rubric.consistency import MANUAL
from grader.rubric.model import Criterion, ManualParams, Rubric
from grader.rubric.own_checks import known_checks

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
    schema["properties"]["scenarios"]["additionalProperties"] = False
    _describe(model, schema)
    for record in inner_records(model):
        _describe(record, schema["$defs"].get(record.__name__, {}))
    for name, record_schema in schema["$defs"].items():
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
    if any(kind.get("type", "array") not in {"array", "object", "null"} or "enum" in kind for kind in kinds):
        inner.append({"$ref": "#/$defs/Place"})
    return about | ({"anyOf": inner} if len(inner) > 1 else inner[0])


def _describe(record: type[Record], schema: dict[str, Any]) -> None:
    """Write the docstrings of a record's fields beside their types."""
    texts = field_docstrings(record)
    for key, found in schema.get("properties", {}).items():
        if key in texts:
            found.setdefault("description", texts[key])


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
