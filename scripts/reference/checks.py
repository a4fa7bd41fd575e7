"""`docs/reference/checks.md`, made from the checks' own docstrings."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable
from types import NoneType, UnionType
from typing import Annotated, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from grader.checks import CHECKS, HEADINGS, Check, Refers
from grader.rubric.faults import UNITS

WORDS: dict[object, str] = {
    str: "text", int: "whole number", float: "number", bool: "`true` or `false`", NoneType: "`null`"
}  # fmt: skip
REFERRED = {
    "process": "process of the scenario",
    "launch": "launch file",
    "program": "`package/program`",
    "message": "message type",
    "service": "service type",
    "sent": "topic of a probe",
    "published": "topic of the student's",
    "set": "parameter that the scenario sets",
    "watched_s": "number",
}

INTRODUCTION = """# Checks

What each check of a rubric looks at, why, how it measures, and how to put right what it finds.
`grader explain NAME` shows the same. This page is made from the checks' docstrings
(`make reference`).
"""


def checks_page() -> str:
    """The whole page as Markdown, checks in the order of their names."""
    contents = "\n".join(f"- [`{c.name}`](#{c.name}): {c.title.rstrip('.')}" for c in _checks())
    return "\n".join([INTRODUCTION, contents, "", *(check_section(c) for c in _checks())]).rstrip() + "\n"


def check_section(check: Check) -> str:
    """One check as Markdown: title, the four headings, its parameters."""
    lines = [f"## {check.name}", "", check.title, ""]
    for heading in HEADINGS:
        lines += [f"**{heading}.** {check.sections.get(heading, '')}", ""]
    if check.params.model_fields:
        about = " ".join((inspect.getdoc(check.params) or "").split())
        lines += [about, "", "| parameter | type | default |", "|---|---|---|", *_parameter_rows(check), ""]
    return "\n".join(lines)


def _parameter_rows(check: Check) -> list[str]:
    return [
        f"| `{name}` | {_type(field.metadata, field.annotation)}{_unit(name)} | {_default(field)} |"
        for name, field in check.params.model_fields.items()
    ]


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True, validated_data={})
    plain = list(value) if isinstance(value, tuple) else value
    return f"`{json.dumps(plain)}`"


def _unit(name: str) -> str:
    return next((f", {unit}" for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


def _type(metadata: Iterable[object], annotation: object) -> str:
    """Return a type in a rubric author's words; what it refers to says more than its type."""
    referred = next((REFERRED[one.to] for one in metadata if isinstance(one, Refers)), None)
    if referred:
        return referred
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type(inner[1:], inner[0])
    if origin in {Union, UnionType}:
        return " or ".join(_type((), member) for member in inner)
    if origin is Literal:
        return " or ".join(f"`{value}`" for value in inner)
    if origin is tuple:
        return f"list of: {_type((), inner[0])}"
    return "map" if origin is dict else WORDS.get(annotation, "any value")


def _checks() -> list[Check]:
    return [CHECKS[name] for name in sorted(CHECKS)]
