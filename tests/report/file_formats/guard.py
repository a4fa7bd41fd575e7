"""What in a new schema an older reader, or an older file, could not bear."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from grader.report.file_formats import Format, records_in

PROSE = {"description", "title", "default", "examples"}
Schema = Mapping[str, Any]


def faults(name: str, old: Schema, new: Schema, about: Format) -> list[str]:
    """Every change that takes a new version, or an entry in the list of additions, and has none."""
    if old.get("$id") != new.get("$id"):
        return []  # a new version may change everything
    before, after = dict(records_in(name, dict(old))), dict(records_in(name, dict(new)))
    listed = {addition.key for addition in about.additions}
    found: list[str] = []
    for record in before.keys() | after.keys():
        if record not in after:
            found.append(f"{record} is gone")
        elif record in before:
            found += _record(record, before[record], after[record], listed, about.by)
    return sorted(found)


def _record(record: str, old: Schema, new: Schema, listed: set[str], by: str) -> Iterator[str]:
    before, after = old.get("properties", {}), new.get("properties", {})
    required = set(new.get("required", ()))
    for key in before.keys() - after.keys():
        yield f"{record}.{key} is gone"
    for key in after.keys() - before.keys():
        if key in required:
            yield f"{record}.{key} is new, and files of before lack it: give it a default"
        elif by == "grader" and f"{record}.{key}" not in listed:
            yield f"{record}.{key} is new: list it among the additions (grader/report/file_formats.py)"
    for key in before.keys() & after.keys():
        if key in required - set(old.get("required", ())):
            yield f"{record}.{key} has to be there now, and files of before may lack it"
        if not _bears(_bare(before[key]), _bare(after[key]), by):
            yield f"{record}.{key} is of another type"
    if _bare({k: v for k, v in old.items() if k in KINDS}) != _bare(
        {k: v for k, v in new.items() if k in KINDS}
    ):
        yield f"{record} is of another kind"


KINDS = ("type", "enum", "const")


def _bears(old: Any, new: Any, by: str) -> bool:
    """People's files may know more words and alternatives than before; what graders write may not."""
    if old == new:
        return True
    if by == "grader" or not (isinstance(old, dict) and isinstance(new, dict)):
        return False
    for key in ("enum", "oneOf", "anyOf"):
        if key in old and key in new:
            rest_old, rest_new = _without(old, key), _without(new, key)
            return rest_old == rest_new and all(one in new[key] for one in old[key])
    both = old.keys() & new.keys()
    return old.keys() == new.keys() and all(_bears(old[key], new[key], by) for key in both)


def _without(schema: Schema, key: str) -> dict[str, Any]:
    return {name: value for name, value in schema.items() if name not in {key, "discriminator"}}


def _bare(schema: Any) -> Any:
    """Without what is for people."""
    if isinstance(schema, dict):
        return {k: _bare(v) for k, v in schema.items() if not (k in PROSE and not isinstance(v, dict))}
    return [_bare(one) for one in schema] if isinstance(schema, list) else schema


def copy_of(schema: Schema) -> Any:
    return json.loads(json.dumps(schema))
