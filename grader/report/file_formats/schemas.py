"""The JSON Schema (draft 2020-12) of each format, made of the records that read and write it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from grader.evidence import events
from grader.evidence.events import PACKAGE_TOPIC, TOPICS
from grader.model import batch, publication, result, verdict
from grader.model.batch import BatchRun
from grader.model.mutants import MutantsFile, RubricTest
from grader.model.package import PackageFacts
from grader.model.publication import Publication, Sent
from grader.model.record import Record, field_docstrings
from grader.model.result import BankComment, GradingResult, WrittenOverride
from grader.model.similarity import Similarity
from grader.report.file_formats.known import FORMATS, Format
from grader.rubric import course
from grader.rubric.course import Course
from grader.rubric.model import Rubric
from grader.rubric.schema import DIALECT, rubric_schema

Schema = dict[str, Any]
ROOTS: dict[str, type[Record]] = {
    "result": GradingResult,
    "rubric": Rubric,
    "run": BatchRun,
    "published": Publication,
    "sent": Sent,
    "course": Course,
    "similarity": Similarity,
    "mutants": MutantsFile,
    "rubric-test": RubricTest,
}
"""The record that a whole file is; evidence has one for each topic, and overrides and comments are maps."""


def schema_of(name: str) -> Schema:
    """Return the schema of the newest version of the format `name` (a key of `FORMATS`).

    Of what graders write, it leaves room for keys of later ones, as this grader's reader does. Of evidence it describes
    an object with a key for each JSON channel: a message on `/grader/host` is a value of the key `/grader/host`.
    """
    about, body = FORMATS[name], _MAKERS[name]()
    for record, found in records_in(name, body):
        _describe(record, found, about)
    definitions = {"$defs": body.pop("$defs")} if "$defs" in body else {}
    head = {
        "$schema": DIALECT,
        "$id": f"urn:ros-lab-grader:{name}:{about.is_.version}",
        "title": f"{about.title} ({about.is_})",
    }
    return {**head, **{key: value for key, value in body.items() if key not in head}, **definitions}


def records_in(name: str, schema: Schema) -> Iterator[tuple[str, Schema]]:
    """Every record that the schema of a format describes, by its name; first that of the file itself, if it is one."""
    if name in ROOTS:
        yield ROOTS[name].__name__, schema
    yield from schema.get("$defs", {}).items()


def _describe(record: str, schema: Schema, about: Format) -> None:
    """Each key's own text; what graders write may have more keys than a reader knows."""
    if about.by == "grader" and schema.get("additionalProperties") is False:
        del schema["additionalProperties"]
    texts = field_docstrings(_RECORDS[record]) if record in _RECORDS else {}
    for key, found in schema.get("properties", {}).items():
        if key in texts:
            found.setdefault("description", texts[key])


def _of(record: type[Record]) -> Callable[[], Schema]:
    """Return a file that holds this record. What tells its version is always written."""

    def make() -> Schema:
        schema = record.model_json_schema(by_alias=True)
        if "schema" in schema["properties"]:
            schema["required"] = ["schema", *(k for k in schema.get("required", ()) if k != "schema")]
        return schema

    return make


def _evidence() -> Schema:
    """All JSON channels in one: their records have no name in common that means something else."""
    definitions: Schema = {}
    channels: Schema = {}
    records: Mapping[str, type[Record]] = {**TOPICS, PACKAGE_TOPIC: PackageFacts}
    for topic, record in records.items():
        schema = record.model_json_schema(by_alias=True, ref_template="#/$defs/{model}")
        definitions |= schema.pop("$defs", {})
        definitions.setdefault(record.__name__, schema)  # one that holds others of its kind is there already
        channels[topic] = {"$ref": f"#/$defs/{record.__name__}"}
    text = (
        "The JSON channels of an evidence file: each message on a topic is what stands under its name here."
    )
    return {
        "description": text,
        "type": "object",
        "properties": channels,
        "$defs": dict(sorted(definitions.items())),
    }


def _overrides() -> Schema:
    """The file is a map, not a record. What may be left out may be left empty, too."""
    override = _with_empty(WrittenOverride, ("comment", "author", "comments", "answer", "together"))
    override["anyOf"] = [{"required": ["points"]}, {"required": ["comments"]}]
    return _two_levels("overrides", "What people decided: by submission, then by criterion.", override)


def _comments() -> Schema:
    """It is such a map, too."""
    says = "Comments that are used again and again: by criterion, then by id."
    return _two_levels("comments", says, _with_empty(BankComment, ()))


def _with_empty(record: type[Record], keys: Sequence[str]) -> Schema:
    schema = record.model_json_schema(by_alias=True)
    for key in keys:
        found = schema["properties"][key]
        kept = {"title": found.pop("title"), "default": found.pop("default")}
        schema["properties"][key] = {**kept, "anyOf": [dict(found), {"type": "null"}]}
    return schema


def _two_levels(name: str, says: str, one: Schema) -> Schema:
    title = one["title"]
    inner = {"type": "object", "additionalProperties": {"$ref": f"#/$defs/{title}"}}
    version = field_docstrings(GradingResult)["schema"]
    return {
        "description": says,
        "type": "object",
        "properties": {"schema": {"const": str(FORMATS[name].is_), "description": version}},
        "additionalProperties": {"anyOf": [inner, {"type": "null"}]},
        "$defs": {title: one},
    }


_RECORDS: dict[str, type[Record]] = {
    kind.__name__: kind
    for module in (batch, course, events, publication, result, verdict)
    for kind in vars(module).values()
    if inspect.isclass(kind) and issubclass(kind, Record)
}
"""The records whose fields have docstrings, by the names that schemas give them."""
_MAKERS: dict[str, Callable[[], Schema]] = {
    **{name: _of(record) for name, record in ROOTS.items()},
    "rubric": rubric_schema,
    "course": lambda: Course.model_json_schema(by_alias=True),
    "evidence": _evidence,
    "overrides": _overrides,
    "comments": _comments,
}
