"""Rows of a table become entries. Every fault of a row is reported with its line, all of them at once."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from pathlib import Path

from grader.classes.roster.allowed_sources import Local, ref_fault, source_fault, whole_source
from grader.classes.roster.table import Row, Table
from grader.errors import UsageError
from grader.intake.names import brief, encodable, is_package_name, safe_name
from grader.model.batch import Entry, Roster, RosterFault


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
    name, group = fields.get("name", ""), fields.get("group", "")
    return Found(
        where=where, id=fields.get("id", ""), entry=entry, faults=faults, name=name, group=group, extra=extra
    )


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
    if (package := fields.get("package", "")) and not is_package_name(package):
        yield f"package: {brief(package)} cannot be a package's name"
    submitted_at, extension = fields.get("submitted_at", ""), fields.get("extension_days", "")
    if submitted_at and (fault := time_fault(submitted_at)):
        yield f"submitted_at: {brief(submitted_at)} {fault}"
    if extension and parse_days(extension) is None:
        yield f"extension_days: {brief(extension)} is not a number of days"


def _entry(fields: dict[str, str], extra: dict[str, str], where: str, base: Path) -> Entry:
    return Entry(
        id=fields["id"],
        source=whole_source(fields["source"], base),
        ref=fields.get("ref") or None,
        package=fields.get("package", ""),
        name=fields.get("name", ""),
        group=fields.get("group", ""),
        submitted_at=parse_time(fields.get("submitted_at", "")),
        extension_days=parse_days(fields.get("extension_days", "")) or 0.0,
        where=where,
        extra=extra,
    )


ID_BYTES_MAX = 255


@dataclass(frozen=True, kw_only=True)
class Found:
    """One submission, or what was meant for one. `id` is empty where it has none, `entry` None where it has faults;
    `name`, `group` and `extra` are what is known of the student even then."""

    where: str
    id: str = ""
    entry: Entry | None = None
    faults: tuple[str, ...] = ()
    name: str = ""
    group: str = ""
    extra: Mapping[str, str] = field(default_factory=dict)


def gather(file: Path, found: Sequence[Found], *, columns: tuple[str, ...] = ()) -> Roster:
    """The first of those that share an id stays; each later one is a fault that says where the first is."""
    times = Counter(_key(one.id) for one in found)
    first: dict[str, str] = {}
    entries: list[Entry] = []
    again: list[Entry] = []
    faults: list[RosterFault] = []
    for one in found:
        key = _key(one.id)
        wrong = [*one.faults, *id_faults(one.id)]
        sound = not wrong
        is_again = bool(key) and key in first
        if is_again:
            wrong.append(f"id: {brief(one.id)} is there already, in {first[key]}")
        first.setdefault(key, one.where)
        own = one.id if key and times[key] == 1 and not any(id_faults(one.id)) else None
        faults += [
            RosterFault(where=one.where, id=own, text=text, name=one.name, group=one.group, extra=one.extra)
            for text in wrong
        ]
        if sound and one.entry is not None:
            (again if is_again else entries).append(one.entry)
    return Roster(
        file=str(file), entries=tuple(entries), columns=columns, faults=tuple(faults), again=tuple(again)
    )


def id_faults(submission_id: str) -> Iterator[str]:
    """Why `submission_id` can name no folder of results; nothing for an empty one, which is a fault of its own."""
    if not submission_id:
        return
    if not encodable(submission_id):
        yield f"id: {brief(submission_id)} is not a string"
    elif any(unicodedata.category(sign) in {"Cc", "Zl", "Zp"} for sign in submission_id):
        yield f"id: {brief(submission_id)} has a line end or a control character in it"
    elif not any(sign.isalnum() for sign in submission_id):
        yield f"id: {brief(submission_id)} has no letter and no digit"
    elif len(submission_id.encode()) > ID_BYTES_MAX:
        yield f"id: {brief(submission_id)} is longer than a file's name may be ({ID_BYTES_MAX} bytes)"


def columns_of(entries: Iterable[Entry | None]) -> tuple[str, ...]:
    """Return the names of all further columns, in the order in which they turn up."""
    return tuple(dict.fromkeys(name for entry in entries if entry for name in entry.extra))


def _key(submission_id: str) -> str:
    """Two ids that would share one folder of results are one, on file systems that take `A` for `a`, too."""
    return safe_name(submission_id).casefold() if submission_id else ""


REQUIRED = ("id", "source")
OPTIONAL = ("ref", "package", "name", "group", "submitted_at", "extension_days")
KNOWN = (*REQUIRED, *OPTIONAL)
NEARLY = 0.82


def known_columns(table: Table, path: Path, required: Sequence[str] = REQUIRED) -> dict[str, str]:
    """The name of each column that means something. Raises UsageError where one is missing, or is there twice."""
    names = {column: _plain(column) for column in table.columns}
    missing = [name for name in required if name not in names.values()]
    where = f"{path}:{table.line}"
    if missing:
        there = ", ".join(brief(column) for column in table.columns if column) or "none"
        meant = "; ".join(meant for _, meant in near_misses(table.columns))
        raise UsageError(
            f"{where}: no column {' and no column '.join(missing)}; there are: {there}",
            hint=meant or f"the first line names the columns: {','.join(required)}",
        )
    written = [names[column] if names[column] in KNOWN else column for column in table.columns if column]
    double = next((name for name in written if written.count(name) > 1), None)
    if double:
        raise UsageError(
            f"{where}: the column {brief(double)} is there twice", hint="take one out, or rename it"
        )
    return {column: name for column, name in names.items() if name in KNOWN}


def near_misses(columns: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Columns that are nearly one which means something and is not there, each with what was meant."""
    plain = {_plain(column) for column in columns}
    missing = [name for name in KNOWN if name not in plain]
    for column in columns:
        near = difflib.get_close_matches(_plain(column)[:40], missing, n=1, cutoff=NEARLY)
        if near and near[0][0] == _plain(column)[0] and _plain(column) not in KNOWN:
            yield column, f"the column {brief(column)} means nothing here: did you mean {near[0]}?"


def _plain(column: str) -> str:
    return re.sub(r"[\s-]+", "_", column.casefold())


EXTENSION_DAYS_MAX = 3660.0
EXAMPLE = "2026-11-20 23:59"
_TIME = re.compile(
    r"(?P<year>\d{4})[-/](?P<month>\d{1,2})[-/](?P<day>\d{1,2})"
    r"(?:(?:T|\s+)(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,](?P<part>\d{1,12}))?)?"
    r"\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)?)?",
    re.IGNORECASE | re.ASCII,
)
_DAY_AND_MONTH = re.compile(r"\d{1,2}([/.-])\d{1,2}\1\d{2,4}\b.*", re.ASCII | re.DOTALL)
_DAYS = re.compile(r"\+?\d{1,5}([.,]\d{1,6})?", re.ASCII)


def parse_time(text: str) -> datetime | None:
    """An ISO 8601 time, also with blanks and slashes; without a zone, of this machine's. None for what is none."""
    found = _TIME.fullmatch(text.strip())
    if found is None:
        return None
    numbers = {name: int(found[name] or 0) for name in ("year", "month", "day", "hour", "minute", "second")}
    part = int((found["part"] or "0")[:6].ljust(6, "0"))
    try:
        time = datetime(**numbers, microsecond=part, tzinfo=_zone(found["zone"]))
        return time.astimezone() if time.tzinfo is None else time.astimezone(timezone.utc)
    except (ValueError, OverflowError, OSError):
        return None


def time_fault(text: str) -> str:
    """Why `text` is no time; empty where it is one."""
    if parse_time(text) is not None:
        return ""
    if _DAY_AND_MONTH.fullmatch(text.strip()):
        return f"can be read with the day or the month first: write it as {EXAMPLE}"
    return f"is no time such as {EXAMPLE} or 2026-11-20T23:59:00+01:00"


def parse_days(text: str) -> float | None:
    """Return a number of days from 0 to ten years, with a point or a comma. None for what is none."""
    days = float(text.replace(",", ".")) if _DAYS.fullmatch(text) else None
    return days if days is not None and days <= EXTENSION_DAYS_MAX else None


def _zone(text: str | None) -> timezone | None:
    if text is None:
        return None
    if text[0] not in "+-":
        return timezone.utc
    digits = text[1:].replace(":", "").ljust(4, "0")
    offset = timedelta(hours=int(digits[:2]), minutes=int(digits[2:]))
    return timezone(-offset if text[0] == "-" else offset)
