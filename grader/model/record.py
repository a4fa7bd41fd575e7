"""The base of all records: frozen, typed, created by keyword, without unknown keys."""

from __future__ import annotations

import ast
import inspect
import json
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError
from typing_extensions import Self

T = TypeVar("T")


class Record(BaseModel):
    """An immutable record that can be written as JSON and read back to an equal one."""

    # `defer_build`: a command that uses few records does not wait at its start until all are built.
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with some fields changed. Raises TypeError for a field that the record does not have,
        which pydantic would take without a word; values are not checked."""
        if unknown := set(update or {}) - set(type(self).model_fields):
            raise TypeError(f"{type(self).__name__} has no field {', '.join(sorted(unknown))}")
        return super().model_copy(update=update, deep=deep)

    @classmethod
    def read_json(cls, data: bytes | str) -> Self:
        """Read what a grader wrote. Keys that only a later grader knows are ignored: without a new version of the
        format, no status and no points depend on them (docs/reference/formats.md). Raises ValidationError."""
        return cls.model_validate_json(data, extra="ignore")

    @classmethod
    def from_data(cls, data: object) -> Self:
        """Return the record that is written in a YAML file, whose data these are. Raises ValidationError.

        As JSON and strictly: text is no number then, and a list may still be a tuple, and a text a date."""
        return cls.model_validate_json(json.dumps(data), strict=True)

    @classmethod
    def read_all(cls, datas: Sequence[bytes]) -> list[Self]:
        """Read many in one go, in little over half the time. Raises ValidationError for the first that is none."""
        if not datas:
            return []
        with suppress(ValidationError):
            found = _list_of(cls).validate_json(b"[%b]" % b",".join(datas), extra="ignore")
            # One line may hold `{…}, {…}`, which is two records in a list and none by itself.
            if len(found) == len(datas):
                return found
        return [cls.read_json(data) for data in datas]


@cache
def _list_of(kind: type[T]) -> TypeAdapter[list[T]]:
    return TypeAdapter(list[kind])  # type: ignore[valid-type]


def build_records() -> None:
    """Build now what reads and writes each record that is imported: else its first use does."""
    waiting = [Record]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        # One that names what is not imported yet is built when it is first used.
        kind.model_rebuild(raise_errors=False)


def field_docstrings(record: type) -> dict[str, str]:
    """Return the docstrings of a class's fields by their keys; none where there is no source to read.

    pydantic's `use_attribute_docstrings` gives the same, but reads all the sources whenever the grader starts.
    """
    texts: dict[str, str] = {}
    fields = record.model_fields if issubclass(record, Record) else {}
    # The class itself comes last, so that its words take the place of its base's.
    for kind in reversed(record.__mro__):
        if kind in {Record, BaseModel, tuple, object}:
            continue
        for node, text in pairwise(_classes(kind.__module__).get(kind.__name__, [])):
            match node, text:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                    # A field with the name of a keyword, or of something in pydantic, has a `_` behind it.
                    key = (fields[name].serialization_alias if name in fields else "") or name.removesuffix(
                        "_"
                    )
                    texts[key] = inspect.cleandoc(words).replace("\n", " ")
    return texts


def describe_fields(record: type, schema: dict[str, Any]) -> None:
    """Write the docstrings of a class's fields beside their types in its JSON schema."""
    texts = field_docstrings(record)
    for key, found in schema.get("properties", {}).items():
        if key in texts:
            found.setdefault("description", texts[key])


@cache
def _classes(module: str) -> dict[str, list[ast.stmt]]:
    """Return what is in each class of a module, by the class's name; nothing where there is no source to read."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    return {node.name: node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}
