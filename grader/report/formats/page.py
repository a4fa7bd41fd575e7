"""`docs/reference/formats.md` and the schemas beside it, made from the list of formats and their records.

`python -m grader.report.formats.page docs/reference` writes them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from grader.evidence.events import PACKAGE_TOPIC, TOPICS
from grader.files import atomic_write
from grader.report.formats.known import FORMATS, Format
from grader.report.formats.schemas import Schema, records_in, schema_of
from grader.report.formats.words import CHANNELS, INTRODUCTION, METADATA, OF_EVIDENCE, POLICY

PAGE, SCHEMAS = "formats.md", "schemas"
PLAIN = {"string": "text", "object": "map", "array": "list"}
TOLD = ("result", "run", "overrides")
"""Formats whose every key is on the page. Of the others, the schema says it all."""


def pages() -> dict[str, str]:
    """Every file that is made, by its path below the folder of the reference."""
    schemas = {f"{SCHEMAS}/{name}.schema.json": schema_text(name) for name in FORMATS}
    return {PAGE: formats_page(), **schemas}


def schema_text(name: str) -> str:
    """A format's schema as the file has it."""
    return json.dumps(schema_of(name), indent=2, ensure_ascii=False) + "\n"


def formats_page() -> str:
    """The whole page as Markdown."""
    parts = [INTRODUCTION, *_overview(), POLICY]
    for name, about in FORMATS.items():
        parts += [f"## {about.title}", "", *_about(about), ""]
        if name in TOLD:
            parts += list(_records(name, schema_of(name)))
        if name == "evidence":
            parts += [OF_EVIDENCE, *_metadata(), *_channels()]
    return "\n".join(parts).rstrip() + "\n"


def _overview() -> Iterator[str]:
    yield from (
        "| format | version | file | says its version by | one that is newer |",
        "|---|---|---|---|---|",
    )
    for about in FORMATS.values():
        link = f"[{about.name}](#{about.title.lower().replace(' ', '-')})"
        yield f"| {link} | `{about.is_}` | {about.where} | {about.says} | {about.newer} |"
    yield ""


def _about(about: Format) -> Iterator[str]:
    file = f"{about.name}.schema.json"
    yield f"{about.where[0].upper()}{about.where[1:]}. Schema: [{file}]({SCHEMAS}/{file})."
    yield from ("", "| version | what changed |", "|---|---|")
    for change in about.changes:
        yield f"| {change.version} | {change.what} |"
    if about.additions:
        yield from ("", "What came later without a new version, and what a file without it means:", "")
        yield from ("| version | key | without it |", "|---|---|---|")
        for one in about.additions:
            yield f"| {one.version} | `{one.key}` | {one.what} |"


def _records(name: str, schema: Schema) -> Iterator[str]:
    for record, found in records_in(name, schema):
        if "properties" in found:
            yield from (f"### {record}", "", *_keys(found), "")


def _keys(schema: Schema) -> Iterator[str]:
    text = " ".join(schema.get("description", "").split())
    yield from (text, "", "| key | type | always there | |", "|---|---|---|---|")
    required = set(schema.get("required", ()))
    for key, found in schema["properties"].items():
        always = "yes" if key in required else ""
        yield f"| `{key}` | {_type(found)} | {always} | {found.get('description', '')} |"


def _type(schema: Schema) -> str:
    """A key's type in few words."""
    makers: dict[str, Callable[[], str]] = {
        "$ref": lambda: f"`{schema['$ref'].rpartition('/')[2]}`",
        "const": lambda: f"`{json.dumps(schema['const'])}`",
        "enum": lambda: ", ".join(f"`{word}`" for word in schema["enum"]),
        "anyOf": lambda: " or ".join(dict.fromkeys(_type(one) for one in schema["anyOf"])),
        "items": lambda: f"list of {_type(schema['items'])}",
        "prefixItems": lambda: "pair of " + " and ".join(_type(one) for one in schema["prefixItems"]),
        "format": lambda: {"date-time": "time", "date": "day"}.get(schema["format"], "text"),
    }
    inner = schema.get("additionalProperties")
    if isinstance(inner, dict):
        return f"map to {_type(inner)}"
    found = next((make for key, make in makers.items() if key in schema), None)
    plain = str(schema.get("type", "any"))
    return found() if found else PLAIN.get(plain, plain)


def _metadata() -> Iterator[str]:
    yield from ("| metadata | |", "|---|---|")
    for key, text in METADATA.items():
        yield f"| `{key}` | {text} |"
    yield ""


def _channels() -> Iterator[str]:
    schema = schema_of("evidence")
    for topic in (*TOPICS, PACKAGE_TOPIC):
        record = schema["properties"][topic]["$ref"].rpartition("/")[2]
        yield from (f"### `{topic}`", "")
        if topic == PACKAGE_TOPIC:
            yield from (CHANNELS[topic], "")
        else:
            yield from (*_keys(schema["$defs"][record]), "")
    yield from ("### Connection", "", *_keys(schema["$defs"]["Connection"]), "")


def main(folder: Path) -> None:
    """Write all of it."""
    for name, text in pages().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        atomic_write(folder / name, text.encode(), public=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
