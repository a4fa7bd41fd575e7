"""Rows of a table become entries; whatever is wrong with a row is named by its line, all faults at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from grader.classes.roster.columns import REQUIRED, known_columns, near_misses
from grader.classes.roster.gather import Found, gather
from grader.classes.roster.local import Local
from grader.classes.roster.sources import ref_fault, source_fault, whole_source
from grader.classes.roster.table import Row, Table
from grader.classes.roster.times import parse_days, parse_time, time_fault
from grader.intake.names import brief
from grader.model.batch import Entry, Roster


def entries_of(table: Table, path: Path, local: Local) -> Roster:
    """Raises UsageError where a column is missing, or is there twice."""
    names = known_columns(table, path)
    header = f"{path.name}:{table.line}"
    found = [Found(where=header, faults=(meant,)) for _, meant in near_misses(table.columns)]
    found += [_found(row, names, table, path, local) for row in table.rows]
    further = tuple(column for column in table.columns if column and column not in names)
    return gather(path, found, columns=further)


def _found(row: Row, names: dict[str, str], table: Table, path: Path, local: Local) -> Found:
    where, base = f"{path.name}:{row.line}", path.parent
    fields = {names[column]: field for column, field in row.fields.items() if column in names}
    if row.faults:  # what stands in which column is not sure
        sure = not row.shifted or names.get(table.columns[0]) == "id"
        return Found(where=where, id=fields.get("id", "") if sure else "", faults=row.faults)
    faults = tuple(_faults(fields, base, local))
    extra = {column: field for column, field in row.fields.items() if column not in names}
    entry = None if faults else _entry(fields, extra, where, base)
    return Found(where=where, id=fields.get("id", ""), entry=entry, faults=faults)


def _faults(fields: dict[str, str], base: Path, local: Local) -> Iterator[str]:
    """What is wrong with one row."""
    for name in REQUIRED:
        if not fields.get(name):
            yield f"no {name}"
    said = {
        "source": source_fault(fields["source"], base, local) if fields.get("source") else "",
        "ref": ref_fault(fields.get("ref", "")),
    }
    yield from (f"{name}: {fault}" for name, fault in said.items() if fault)
    submitted_at, extension = fields.get("submitted_at", ""), fields.get("extension_days", "")
    if submitted_at and (fault := time_fault(submitted_at)):
        yield f"submitted_at: {brief(submitted_at)} {fault}"
    if extension and parse_days(extension) is None:
        yield f"extension_days: {brief(extension)} is no number of days"


def _entry(fields: dict[str, str], extra: dict[str, str], where: str, base: Path) -> Entry:
    return Entry(
        id=fields["id"],
        source=whole_source(fields["source"], base),
        ref=fields.get("ref") or None,
        name=fields.get("name", ""),
        group=fields.get("group", ""),
        submitted_at=parse_time(fields.get("submitted_at", "")),
        extension_days=parse_days(fields.get("extension_days", "")) or 0.0,
        where=where,
        extra=extra,
    )
