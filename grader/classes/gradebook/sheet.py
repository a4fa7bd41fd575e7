"""A platform's export, of which every byte stays as it is but the cells that are filled in."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.errors import UsageError

BYTES_MAX = 64 << 20
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_EXPORT = "export it from the platform as CSV, and do not save it from a spreadsheet"


@dataclass(kw_only=True)
class Record:
    """The cells of one row as they are written, quotation marks too, and the line end behind them."""

    cells: list[str]
    end: str

    def value(self, column: int) -> str:
        """What a cell says; empty where the row has no such cell."""
        return _value(self.cells[column]) if column < len(self.cells) else ""

    @property
    def is_empty(self) -> bool:
        return not any(cell.strip() for cell in self.cells)


@dataclass(kw_only=True)
class Sheet:
    """`mark` are the bytes before the text, `delimiter` is what stands between cells."""

    path: Path
    mark: bytes
    encoding: str
    delimiter: str
    records: list[Record]

    @property
    def header(self) -> list[str]:
        """The columns' names, as they are written."""
        return [_value(cell) for cell in self.records[0].cells]

    def written(self, text: str, instead: str = "") -> str:
        """A cell that says `text`, in quotation marks where the cell before had them, or else every column's name."""
        quoted = instead.startswith('"') if instead else all(c.startswith('"') for c in self.records[0].cells)
        if quoted or any(sign in text for sign in (self.delimiter, '"', "\r", "\n")):
            return '"' + text.replace('"', '""') + '"'
        return text

    def to_bytes(self) -> bytes:
        """The whole file."""
        text = "".join(self.delimiter.join(record.cells) + record.end for record in self.records)
        return self.mark + text.encode(self.encoding)


def read_sheet(path: Path) -> Sheet:
    """Raises UsageError for what is no table of text."""
    try:
        data = path.read_bytes() if path.stat().st_size <= BYTES_MAX else b""
    except OSError as error:
        raise UsageError(
            f"{path}: cannot be read: {error.strerror}", hint="give the platform's export"
        ) from error
    if not data or data.startswith(b"PK\x03\x04"):
        raise UsageError(f"{path}: this is no export as CSV", hint=_EXPORT)
    mark, encoding = next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), (b"", "utf-8"))
    try:
        text = data[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: no {encoding.upper()} text", hint=_EXPORT) from error
    first = re.sub(r'"[^"]*"', "", re.split(r"[\r\n]", text, maxsplit=1)[0])
    delimiter = max((",", ";", "\t"), key=first.count)
    sheet = Sheet(
        path=path,
        mark=mark,
        encoding=encoding,
        delimiter=delimiter,
        records=list(_records(text, delimiter)),
    )
    if not any(name.strip() for name in sheet.header):
        raise UsageError(f"{path}:1: no columns are named", hint=_EXPORT)
    return sheet


def _records(text: str, delimiter: str) -> Iterator[Record]:
    """Whatever is there becomes a cell; joined again, the records are the same text."""
    cell = re.compile(
        rf'("[^"]*(?:""[^"]*)*"[^{delimiter}\r\n]*|[^{delimiter}\r\n]*)({delimiter}|\r\n|\n|\r|\Z)'
    )
    cells: list[str] = []
    for found in cell.finditer(text):
        cells.append(found[1])
        if found[2] == delimiter:
            continue
        if found[2] or len(cells) > 1 or cells[0]:
            yield Record(cells=cells, end=found[2])
        cells = []


def _value(cell: str) -> str:
    cell = cell.strip()
    return cell[1:-1].replace('""', '"') if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell
