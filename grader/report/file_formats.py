"""The files that the grader writes or reads: `FORMATS` with their versions, `schema_of` for their JSON Schemas.

A format's version is in `grader/model/version.py`. It is raised when a reader that does not know of a change would take
a status or a point for another than it is, or could not read the file: a key is gone, means something else, has another
type, or one of a fixed set of words is new. What a reader may pass over is listed here as an `Addition`: an optional
key, with a default that says what a file without it means. A test compares the records with the schemas in
`docs/reference/` and fails where a change is neither. The reference page on them is made by
`scripts/reference/formats.py`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from grader.evidence import events
from grader.evidence.events import PACKAGE_TOPIC, TOPICS
from grader.model import batch, result, verdict, version
from grader.model.batch import BatchRun, Publication, Sent, Similarity
from grader.model.mutants import MutantsFile, RubricTest
from grader.model.package import PackageFacts
from grader.model.record import Record, describe_fields, field_docstrings
from grader.model.result import BankComment, GradingResult, WrittenOverride
from grader.model.version import Versioned
from grader.rubric import course
from grader.rubric.course import Course
from grader.rubric.model import Rubric
from grader.rubric.schema import DIALECT, rubric_schema


@dataclass(frozen=True)
class Addition:
    """`key` (`Record.key`, or a metadata key), added to a version; `what` says what a file without it means."""

    version: int
    key: str
    what: str


@dataclass(frozen=True, kw_only=True)
class Format:
    """One kind of file. `by` says who writes it: unknown keys of a grader are ignored, those of a person are faults.

    For the reference page: `where` the file is, where it `says` its version, and what happens with a `newer` one.
    """

    is_: Versioned
    title: str
    where: str
    by: Literal["grader", "person"]
    says: str
    newer: str
    additions: tuple[Addition, ...] = ()

    @property
    def name(self) -> str:
        """The name that `grader schema` takes: `result`."""
        return self.is_.short


_UNREADABLE = "exit code 3"
_FAULT = "exit code 2, with file and line"
_NOT_READ = "the grader does not read it again"


def _by_grader(
    is_: Versioned,
    title: str,
    where: str,
    newer: str,
    *,
    says: str = "`schema`",
    additions: tuple[Addition, ...] = (),
) -> Format:
    return Format(is_=is_, title=title, where=where, by="grader", says=says, newer=newer, additions=additions)


def _by_person(
    is_: Versioned, title: str, where: str, says: str = "`schema`; without it, a file is read as version 1"
) -> Format:
    return Format(is_=is_, title=title, where=where, by="person", says=says, newer=_FAULT)


_FORMATS = (
    _by_grader(
        version.RESULT,
        "Result",
        "`<out>/<submission>/result.json`, and each line of `results.jsonl` (with `roster` beside it)",
        f"{_UNREADABLE}; in a class, before anything is written",
        additions=(
            Addition(1, "SubmissionInfo.name", "no roster gave a name"),
            Addition(1, "GradingResult.rubric_origin", "it is not known where the rubric came from"),
        ),
    ),
    _by_grader(
        version.EVIDENCE,
        "Evidence",
        "`<out>/<submission>/evidence/*.mcap`",
        _UNREADABLE,
        says="`format` in the metadata record `grader.evidence`, as a number",
    ),
    _by_person(
        version.RUBRIC, "Rubric", "`rubrics/<lab>.yaml`, and every file that is given with `--rubric`"
    ),
    _by_person(version.OVERRIDES, "Overrides", "`<out>/overrides.yaml`"),
    _by_person(version.COMMENTS, "Comments", "`<out>/comments.yaml`"),
    _by_grader(version.RUN, "Run of a class", "`<out>/run.json`", "exit code 2"),
    _by_grader(version.PUBLISHED, "Published results", "each line of `<out>/published.jsonl`", "exit code 2"),
    _by_grader(version.SENT, "Sent feedback", "each line of `<out>/sent.jsonl`", "exit code 2"),
    _by_person(version.COURSE, "Course", "`course.yaml`"),
    _by_grader(version.SIMILARITY, "Similarity", "`<out>/similarity.json`", _NOT_READ),
    _by_person(
        version.MUTANTS,
        "Mutants of a lab",
        "`fixtures/<lab>.yaml`, and `mutants/<lab>.yaml` beside a rubric of your own",
        says="`schema`, which has to be there",
    ),
    _by_grader(version.RUBRIC_TEST, "Test of a rubric", "what `grader rubric test --json` prints", _NOT_READ),
)
FORMATS: dict[str, Format] = {one.name: one for one in _FORMATS}


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
    """Yield every record that a format's schema describes, by its name; first that of the file itself, if it is one."""
    if name in ROOTS:
        yield ROOTS[name].__name__, schema
    yield from schema.get("$defs", {}).items()


def _describe(record: str, schema: Schema, about: Format) -> None:
    """Add each key's own text; what graders write may have more keys than a reader knows."""
    if about.by == "grader" and schema.get("additionalProperties") is False:
        del schema["additionalProperties"]
    if record in _RECORDS:
        describe_fields(_RECORDS[record], schema)


def _of(record: type[Record]) -> Callable[[], Schema]:
    """Return a file that holds this record. What tells its version is always written."""

    def make() -> Schema:
        schema = record.model_json_schema(by_alias=True)
        if "schema" in schema["properties"]:
            schema["required"] = ["schema", *(k for k in schema.get("required", ()) if k != "schema")]
        return schema

    return make


def _evidence() -> Schema:
    """Return all JSON channels in one: their records have no name in common that means something else."""
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
    """Return the schema of a map, which the file is. What may be left out may be left empty, too."""
    override = _with_empty(
        WrittenOverride, ("comment", "author", "comments", "answer", "answered", "together")
    )
    override["anyOf"] = [{"required": [name]} for name in ("points", "comments", "comment", "answer")]
    return _two_levels("overrides", "What people decided: by submission, then by criterion.", override)


def _comments() -> Schema:
    """Return the schema of such a map of comments."""
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
    for module in (batch, course, events, result, verdict)
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
