"""CSV as spreadsheets and learning platforms write it: rows with their lines, whatever the delimiter."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from grader.errors import UsageError

BYTES_MAX = 32 << 20
FIELD_LETTERS_MAX = 10_000
DELIMITERS = (",", ";", "\t")


class Row(NamedTuple):
    """The fields of one row by their column's name, and the line in which it begins, counted from 1."""

    line: int
    fields: Mapping[str, str]


class Table(NamedTuple):
    """Column names as they are written, and the rows that are not empty."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    faults: tuple[str, ...]


def read_table(path: Path) -> Table:
    """Raises UsageError where the file is no table of text at all; what is wrong with a row is among the faults."""
    lines = _text(path).splitlines(keepends=True)
    if not lines:
        raise UsageError(f"{path}: the file is empty", hint="its first line names the columns: id,source")
    delimiter = max(DELIMITERS, key=lines[0].count)
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    columns: tuple[str, ...] = ()
    rows, faults = [], []
    while True:
        begins = reader.line_num + 1
        try:
            fields = next(reader, None)
        except csv.Error as error:
            faults.append(f"{path.name}:{begins}: {error}")
            break
        if fields is None:
            break
        if not columns:
            columns = tuple(name.strip() for name in fields)
        elif any(field.strip() for field in fields):
            rows.append(Row(begins, _named(columns, fields)))
            faults += [f"{path.name}:{begins}: {fault}" for fault in _misfits(columns, fields)]
    return Table(columns, tuple(rows), tuple(faults))


def _named(columns: Sequence[str], fields: Sequence[str]) -> dict[str, str]:
    return {name: field.strip() for name, field in zip(columns, fields, strict=False) if name}


def _misfits(columns: Sequence[str], fields: Sequence[str]) -> list[str]:
    found = []
    if len(fields) > len(columns):
        found.append(f"{len(fields)} fields, but the first line names {len(columns)} columns")
    if any(len(field) > FIELD_LETTERS_MAX for field in fields):
        found.append(f"a field of more than {FIELD_LETTERS_MAX} letters")
    return found


def _text(path: Path) -> str:
    try:
        data = path.read_bytes() if path.stat().st_size <= BYTES_MAX else None
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from error
    if data is None:
        raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is no roster")
    try:
        return data.decode("utf-16" if data[:2] in {b"\xff\xfe", b"\xfe\xff"} else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise UsageError(
            f"{path}:{line}: no UTF-8 text", hint="save it as CSV UTF-8 (in Excel: 'CSV UTF-8', not 'CSV')"
        ) from error
