"""CSV as spreadsheets and learning platforms write it, whatever the encoding and delimiter: rows with their lines."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from grader.errors import UsageError
from grader.intake.names import is_archive_name

BYTES_MAX = 32 << 20
FIELD_LETTERS_MAX = 10_000
UNREADABLE_MAX = 50
DELIMITERS = (",", ";", "\t")
_SEPARATOR = re.compile(r"\"?sep=(.)\"?[\r\n]*", re.IGNORECASE)


class RosterRow(NamedTuple):
    """The fields of one row by their column's name, the line in which it begins, counted from 1, and what is wrong.

    In a row that is `shifted`, no field but the first can be told to be in its column.
    """

    line: int
    fields: Mapping[str, str]
    faults: tuple[str, ...] = ()
    shifted: bool = False


class Table(NamedTuple):
    """Column names as they are written, the line that names them, and the rows that are not empty, in their order."""

    columns: tuple[str, ...]
    rows: tuple[RosterRow, ...]
    line: int = 1


def read_table(path: Path) -> Table:
    """Raises UsageError where the file is not a table of text at all; what is wrong with a row is said by the row."""
    lines = list(io.StringIO(_text(path), newline=""))
    found = _rows(lines, *_delimiter(lines))
    header = next(found, None)
    if header is None:
        raise UsageError(f"{path}: the file is empty", hint="its first line names the columns: id,source")
    line, fields, faults = header
    if faults:
        raise UsageError(f"{path}:{line}: {faults[0]}", hint="the first line names the columns: id,source")
    columns = tuple(_bare(name) for name in fields)
    return Table(columns, tuple(_row(columns, *row) for row in found), line)


class _Fields(NamedTuple):
    line: int
    fields: list[str]
    faults: tuple[str, ...] = ()


def _rows(lines: Sequence[str], delimiter: str, start: int) -> Iterator[_Fields]:
    """Each row that is not empty. After one that cannot be read, the next line begins a row again; of it there is the
    first field at most."""
    unreadable = 0
    while start < len(lines) and unreadable < UNREADABLE_MAX:
        # Python 3.10 reads no zero byte: its place is kept by a sign that says the same to a reader.
        reader = csv.reader(
            (line.replace("\0", "\ufffd") for line in lines[start:]), delimiter=delimiter, strict=True
        )
        begins = start
        try:
            for fields in reader:
                zero = any("\0" in line for line in lines[begins : start + reader.line_num])
                if any(field.strip() for field in fields):
                    yield _Fields(begins + 1, fields, ("a zero byte in it",) if zero else ())
                begins = start + reader.line_num
        except csv.Error as error:
            first = lines[begins].partition(delimiter)[0]
            yield _Fields(begins + 1, [] if '"' in first else [first], (_explain_csv(error),))
            start, unreadable = begins + 1, unreadable + 1
        else:
            return
    if start < len(lines):
        yield _Fields(start + 1, [], ("too many rows that cannot be read before it: the rest is left out",))


def _explain_csv(error: csv.Error) -> str:
    said = str(error)
    if said == "unexpected end of data":
        return "a quotation mark that never ends"
    if "expected after" in said:
        return "a quotation mark that does not end where its field ends"
    return f"no CSV: {said}"


def _row(columns: Sequence[str], line: int, fields: list[str], faults: tuple[str, ...]) -> RosterRow:
    named = {name: _bare(field) for name, field in zip(columns, fields, strict=False) if name}
    shifted = any(field.strip() for field in fields[len(columns) :])
    found = list(faults)
    if shifted:
        found.append(f"{len(fields)} fields, but the first line names {len(columns)} columns")
    if any(len(field) > FIELD_LETTERS_MAX for field in fields):
        found.append(f"a field of more than {FIELD_LETTERS_MAX} letters")
    return RosterRow(line, named, tuple(found), shifted)


def _bare(field: str) -> str:
    """Without blanks around it, nor the invisible signs that come along when text is copied into a spreadsheet."""
    return field.strip().strip("\ufeff\u200b\u200e\u200f\u2060").strip()


def _delimiter(lines: Sequence[str]) -> tuple[str, int]:
    """What stands between fields, and how many lines come before the header: Excel may say `sep=;` in the first."""
    if lines and (said := _SEPARATOR.fullmatch(lines[0])):
        return said[1], 1
    return delimiter_of(next((line for line in lines if line.strip()), "")), 0


def delimiter_of(header: str) -> str:
    """Return what stands between the cells of a table, by the line that names its columns."""
    return max(DELIMITERS, key=re.sub(r'"[^"]*"', "", header).count)


def _text(path: Path) -> str:
    try:
        data = path.read_bytes() if path.stat().st_size <= BYTES_MAX else None
    except OSError as error:
        raise UsageError(
            f"{path}: cannot be read: {error.strerror}", hint="give a CSV file, a folder, or an export"
        ) from error
    if is_archive_name(path.name):
        raise UsageError(f"{path}: an archive is not a roster", hint="unpack it first, and give the folder")
    if data is None:
        raise UsageError(f"{path}: larger than {BYTES_MAX >> 20} MB: this is not a roster")
    return text_of(data, path)


_MARKS = (  # the longer ones first: UTF-32's begins with UTF-16's
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
    (codecs.BOM_UTF8, "utf-8"),
)
_WORKBOOKS = {b"PK\x03\x04": "an Excel or LibreOffice workbook", b"\xd0\xcf\x11\xe0": "an old Excel workbook"}
_SAVE = "save it as CSV UTF-8 (in Excel: 'CSV UTF-8', not 'CSV')"


def text_of(data: bytes, path: Path) -> str:
    """UTF-8, with or without its mark, or UTF-16. Raises UsageError with the line of what is neither."""
    workbook = next((what for magic, what in _WORKBOOKS.items() if data.startswith(magic)), None)
    if workbook:
        raise UsageError(f"{path}: this is {workbook}, not CSV", hint=_SAVE)
    mark, encoding = encoding_of(data)
    try:
        return data[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        named = encoding.removesuffix("-le").removesuffix("-be").upper()
        raise UsageError(f"{path}:{line}: not {named} text", hint=_SAVE) from error


def encoding_of(data: bytes) -> tuple[bytes, str]:
    """Return the byte-order mark that a text begins with (or none) and its encoding, UTF-8 if nothing tells.

    UTF-16 without a mark has a zero in every second byte of plain text.
    """
    marked = next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), None)
    if marked:
        return marked
    head = data[:1000]
    for start, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        if (
            len(head) >= 4
            and head[start::2].count(0) > len(head) * 0.4
            and head[1 - start :: 2].count(0) == 0
        ):
            return b"", name
    return b"", "utf-8"
