"""The JSON Schema (draft 2020-12) of a rubric, for editors: each check offers its own parameters and docs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from grader.checks import HEADINGS, Check
from grader.checks.parameter_docs import inner_records
from grader.checks.registry import NoParams
from grader.model.record import Record, field_docstrings
from grader.rubric.consistency import MANUAL
from grader.rubric.instructor import known_checks
from grader.rubric.model import Criterion, Rubric

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def rubric_schema(checks: Mapping[str, Check] | None = None) -> dict[str, Any]:
    """The schema; criteria are a union told apart by `check`. `checks` are those of a rubric, its own among them."""
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
    return {"$schema": DIALECT, **schema, "title": "A rubric of grader"}


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
        "parameters": (NoParams, Field(alias="with", default_factory=NoParams)),
    }
    docs = "A person gives the points."
    return create_model("Criterion_manual", __base__=Criterion, __doc__=docs, **fields)


def _docs(check: Check) -> str:
    parts = [f"{heading}: {check.sections[heading]}" for heading in HEADINGS if heading in check.sections]
    return "\n\n".join([check.title, *parts])
