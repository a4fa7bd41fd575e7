"""`rubric.md`, made from the records that a rubric is read into."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Iterator
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from grader.model.record import Record, field_docstrings
from grader.rubric.model import Rubric
from scripts.reference.table import MADE, code, table

RUBRIC = f"""# The rubric's keys

Every key of a rubric's YAML file. [Writing a rubric](../how-to/writing-a-rubric.md) shows them at work,
[labs](labs.md) has those that come with the grader, and `grader rubric schema` gives the same to editors as a JSON
Schema. {MADE}
"""


def rubric_page() -> str:
    """The rubric, record by record."""
    lines = [RUBRIC]
    for record in _reachable(Rubric):
        lines += [f"## {record.__name__}", "", *_body(record)]
    return "\n".join(lines).rstrip() + "\n"


def _body(record: type[Record]) -> Iterator[str]:
    """Its docstring and its keys."""
    if record.__doc__:
        yield from (inspect.cleandoc(record.__doc__), "")
    hints, meanings = typing.get_type_hints(record), field_docstrings(record)
    rows = [
        (code(key := field.alias or name), _type(hints[name]), _default(field), meanings.get(key, ""))
        for name, field in record.model_fields.items()
    ]
    yield from table(("key", "type", "default", "meaning"), rows)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=False)
    if field.default_factory is not None or value in ((), {}, "", None):
        return "nothing"
    return code(str(value).lower() if isinstance(value, bool) else str(value))


def _type(hint: Any) -> str:  # noqa: ANN401 - a type is any object
    """A type in a reader's words, records as links to their sections."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Literal:
        return " or ".join(code(str(value)) for value in inner)
    if origin in {Union, types.UnionType}:
        return " or ".join(_type(member) for member in inner if member is not type(None))
    if origin is tuple:
        return f"list of {_type(inner[0])}"
    if origin is dict:
        return f"map of {_type(inner[0])} to {_type(inner[1])}"
    if inspect.isclass(hint) and issubclass(hint, Record):
        return f"[{hint.__name__}](#{hint.__name__.lower()})"
    words = {str: "text", int: "whole number", float: "number", bool: "`true` or `false`", Any: "anything"}
    return words.get(hint, "time with its time zone" if "datetime" in str(hint).lower() else str(hint))


def _reachable(root: type[Record]) -> list[type[Record]]:
    """The record, and those that its keys hold, each once."""
    found: dict[type[Record], None] = {}
    todo = [root]
    while todo:
        record = todo.pop(0)
        if record not in found:
            found[record] = None
            todo += [each for hint in typing.get_type_hints(record).values() for each in _records_in(hint)]
    return list(found)


def _records_in(hint: Any) -> Iterator[type[Record]]:  # noqa: ANN401 - as above
    if inspect.isclass(hint) and get_origin(hint) is None and issubclass(hint, Record):
        yield hint
    for member in get_args(hint):
        yield from _records_in(member)
