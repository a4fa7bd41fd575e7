"""`docs/reference/formats.md` and the JSON Schemas beside it, made from the list of formats and their records."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator

from grader.evidence.events import PACKAGE_TOPIC, TOPICS
from grader.report.file_formats import FORMATS, Format, Schema, records_in, schema_of

INTRODUCTION = """# Formats

The files that the grader writes and reads, key by key. This page and the schemas are made from the code
(`python -m scripts.reference`). `grader schema NAME` prints the schema (JSON Schema, draft 2020-12) of the grader that
is installed; `grader schema` lists them.
"""

POLICY = """## What may change

Each format has its own version, a whole number. A released grader reads every version that was released before it, and
writes the newest. `fixtures/formats/` holds files that an earlier grader wrote; the tests read and judge them again.

**A newer version** than a grader knows is refused with a one-line message, and the file stays as it is:
`results/ada/result.json: written by a newer grader (grader.result/2); this one reads up to 1`. Update the grader.
(`grader grade` does not read earlier results: it replaces what is in its folder, whichever version wrote it.)

**Without a new version**, these may be added:

- to files that a grader writes: optional keys, further JSON channels, metadata of evidence, and values of `error.kind`.
  A reader should ignore what it does not know, as the grader itself does: no status and no points depend on it. When an
  older grader writes such a file again, the additions are lost. The schemas allow all of this.
- to files that people write: keys, checks, and values of keys. An older grader reports each as a fault, with file and
  line, because there an unknown key is usually a typing error.

**A new version** is needed for everything else: a key that is removed, means something else or has another type, a new
word where a key has one of a fixed set (`status`, say), and everything that would make an older reader take a
status or a number of points for another.

The layout of a file (the order of keys, indentation, digits of a number) is not part of a format. The words of
`message`, `hint` and other sentences are for people and may change at any time; `id`, `check`, `status` and `kind` are
for programs.

The [exit codes](exit-codes.md) have a page of their own.
"""

OF_EVIDENCE = """\
MCAP files ([mcap.dev](https://mcap.dev)), profile `ros1`, chunks compressed by zstd with checksums. `package.mcap`
holds what the files say and the build, each `<scenario>.mcap` a run. Any MCAP reader opens them.

- **What nodes published**: a channel for each topic and publisher, `message_encoding` `ros1`, its schema
  (`ros1msg`) as the publisher sent it, and the channel metadata `topic`, `callerid`, `md5sum`, `latching` (`1` or
  `0`). `log_time` is when the kernel took the message in (ns since 1970), `sequence` counts on the channel from 0.
  `/grader/calibration` (`std_msgs/Header`) is a publisher of the grader's, whose pace is known, where a rate is judged.
- **What the grader noted**: the JSON channels below, `message_encoding` `json`, each with its JSON Schema in the
  file. All times are their `log_time`.
- **Attachments** of `package.mcap`: the files of the package that were judged.
- **Metadata** `grader.evidence`: what the run was. All values are text.
"""

METADATA = {
    "format": "The version of this format: `1`.",
    "scenario": "The scenario's name in the rubric; `package` for the files and the build.",
    "clock": "`real` or `warped`.",
    "warp": "How many times faster than real time a warped clock ran.",
    "submission.id": "As in the result.",
    "submission.source": "As in the result.",
    "submission.commit": "As in the result; empty if there is none.",
    "submission.digest": "As in the result.",
    "submission.package": "As in the result.",
    "scenario.digest": "sha256 of the scenario's definition: if that changes, the scenario has to be run again.",
    "grader": "The version of the grader that recorded it.",
    "ros": "The ROS that ran it.",
    "python": "The Python of that ROS.",
    "sandbox": "What confined the student's code.",
    "limits": "The limits that it ran under, as JSON.",
    "made_up": "The values that were made up for the submission, as JSON; only there if there are any.",
    "not_run": "Why nothing was run; only there if nothing was.",
    "recording.missing": "Which file should have been handed in and was missing.",
    "recording.problem": "Why the recording that was handed in cannot be read.",
}

CHANNELS = {
    "/grader/package": "What the package's files say (`PackageFacts`): manifest, CMake, scripts, launch files, each "
    "with file and line. Its records are in the schema."
}

PAGE, SCHEMAS = "formats.md", "schemas"
PLAIN = {"string": "text", "object": "map", "array": "list"}
IN_FULL = ("result", "run", "overrides")
"""Formats whose every key is on the page; of the others, the page links the schema."""


def format_pages() -> dict[str, str]:
    """Every file that is made, by its path below the folder of the reference."""
    schemas = {f"{SCHEMAS}/{name}.schema.json": _schema_text(name) for name in FORMATS}
    return {PAGE: _formats_page(), **schemas}


def _schema_text(name: str) -> str:
    return json.dumps(schema_of(name), indent=2, ensure_ascii=False) + "\n"


def _formats_page() -> str:
    """The whole page as Markdown."""
    parts = [INTRODUCTION, *_overview(), POLICY]
    for name, about in FORMATS.items():
        parts += [f"## {about.title}", "", *_format_section(about), ""]
        if name in IN_FULL:
            parts += list(_record_sections(name, schema_of(name)))
        if name == "evidence":
            parts += [OF_EVIDENCE, *_metadata(), *_channels()]
    return "\n".join(parts).rstrip() + "\n"


def _overview() -> Iterator[str]:
    yield from ("| format | version | file | its version is in | a newer version |", "|---|---|---|---|---|")
    for about in FORMATS.values():
        link = f"[{about.name}](#{about.title.lower().replace(' ', '-')})"
        yield f"| {link} | `{about.is_}` | {about.where} | {about.says} | {about.newer} |"
    yield ""


def _format_section(about: Format) -> Iterator[str]:
    file = f"{about.name}.schema.json"
    yield f"{about.where[0].upper()}{about.where[1:]}. Schema: [{file}]({SCHEMAS}/{file})."
    if about.additions:
        yield from ("", "Keys that were added without a new version, and what a file without them means:", "")
        yield from ("| version | key | without it |", "|---|---|---|")
        for one in about.additions:
            yield f"| {one.version} | `{one.key}` | {one.what} |"


def _record_sections(name: str, schema: Schema) -> Iterator[str]:
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
