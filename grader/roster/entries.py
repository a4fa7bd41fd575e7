"""Rows of a table become entries; whatever is wrong with a row is named by its line, all faults at once."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from datetime import datetime, timezone
from pathlib import Path

from grader.errors import UsageError
from grader.intake.names import safe_name
from grader.model.roster import Entry, Roster
from grader.roster.table import Row, Table

REQUIRED = ("id", "source")
OPTIONAL = ("ref", "name", "group", "submitted_at", "extension_days")
KNOWN = (*REQUIRED, *OPTIONAL)
EXTENSION_DAYS_MAX = 3660.0
SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|[^/\s@]+@[^/\s:]+:")
"""An address with a scheme, or git's `user@host:path`."""


def entries_of(table: Table, path: Path) -> Roster:
    """Raises UsageError where a column is missing, or is there twice."""
    names = _column_names(table, path)
    faults, entries, seen = list(table.faults), [], dict[str, str]()
    for row in table.rows:
        where = f"{path.name}:{row.line}"
        fields = {names[column]: field for column, field in row.fields.items() if column in names}
        found = [*_faults(fields, path.parent), *_doubles(fields, seen, where)]
        faults += [f"{where}: {fault}" for fault in found]
        if not found:
            entries.append(_entry(fields, row, where, path.parent))
    columns = tuple(column for column in table.columns if column and column not in names)
    return Roster(file=str(path), entries=tuple(entries), columns=columns, faults=tuple(faults))


def _column_names(table: Table, path: Path) -> dict[str, str]:
    """The column's own name for each that means something, however it is written."""
    names = {column: re.sub(r"[\s-]+", "_", column.casefold()) for column in table.columns}
    missing = [name for name in REQUIRED if name not in names.values()]
    if missing:
        there = ", ".join(column for column in table.columns if column) or "none"
        raise UsageError(
            f"{path}:1: no column {' and no column '.join(missing)}; there are: {there}",
            hint="the first line names the columns: id,source",
        )
    double = sorted({column for column in table.columns if column and table.columns.count(column) > 1})
    known = [name for name in KNOWN if list(names.values()).count(name) > 1]
    if double or known:
        raise UsageError(f"{path}:1: the column {(double + known)[0]} is there twice")
    return {column: name for column, name in names.items() if name in KNOWN}


def _faults(fields: dict[str, str], base: Path) -> Iterator[str]:
    """What is wrong with one row."""
    for name in REQUIRED:
        if not fields.get(name):
            yield f"no {name}"
    source = fields.get("source", "")
    if source and not SCHEME.match(source) and _leads_out(source, base):
        yield f"source: {source} leads out of the roster's folder"
    if fields.get("submitted_at") and parse_time(fields["submitted_at"]) is None:
        yield f"submitted_at: {fields['submitted_at']} is no time such as 2026-11-20T23:59:00+01:00"
    if fields.get("extension_days") and _days(fields["extension_days"]) is None:
        yield f"extension_days: {fields['extension_days']} is no number of days"


def _leads_out(source: str, base: Path) -> bool:
    """A relative path stays in the roster's folder, through links too; an absolute one is meant as it is."""
    return not Path(source).is_absolute() and not (base / source).resolve().is_relative_to(base.resolve())


def _doubles(fields: dict[str, str], seen: dict[str, str], where: str) -> Iterator[str]:
    """Two ids that would share one folder of results are one id, on file systems that take `A` for `a`, too."""
    if fields.get("id"):
        key = safe_name(fields["id"]).casefold()
        if key in seen:
            yield f"id: {fields['id']} is there already, in {seen[key]}"
        seen.setdefault(key, where)


def _entry(fields: dict[str, str], row: Row, where: str, base: Path) -> Entry:
    source = fields["source"]
    known = {column for column in row.fields if re.sub(r"[\s-]+", "_", column.casefold()) in KNOWN}
    return Entry(
        id=fields["id"],
        source=source if SCHEME.match(source) else str(base.absolute() / source),
        ref=fields.get("ref") or None,
        name=fields.get("name", ""),
        group=fields.get("group", ""),
        submitted_at=parse_time(fields.get("submitted_at", "")),
        extension_days=_days(fields.get("extension_days", "")) or 0.0,
        where=where,
        extra={column: field for column, field in row.fields.items() if column not in known},
    )


def parse_time(text: str) -> datetime | None:
    """An ISO 8601 time; without a zone, it is of this machine's. None for what is no time."""
    try:
        found = datetime.fromisoformat(text.strip().replace("Z", "+00:00").replace("z", "+00:00"))
        return found.astimezone() if found.tzinfo is None else found.astimezone(timezone.utc)
    except (ValueError, OverflowError):
        return None


def _days(text: str) -> float | None:
    try:
        days = float(text.replace(",", "."))
    except ValueError:
        return None
    return days if math.isfinite(days) and 0 <= days <= EXTENSION_DAYS_MAX else None
