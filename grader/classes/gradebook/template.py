"""A platform's own export with our points filled in. All other bytes stay as they were."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.classes.gradebook.matching import (
    ColumnKind,
    Identity,
    Mark,
    Platform,
    PointsColumn,
    entry_identity,
    kinds,
    letters_and_digits,
    match,
    row_identity,
)
from grader.classes.gradebook.table import harmless, number_text
from grader.classes.roster.entries import delimiter_of, encoding_of
from grader.errors import UsageError
from grader.files import read_given
from grader.wording import first_few

KEPT = {"EX", "N/A"}
"""What Canvas writes for who is excused, and for who has not got the assignment."""
# below the header, Canvas has a row that says how each column is posted
_POSTING = re.compile(r"\s*(Muted|Manual Posting.*)?\s*", re.IGNORECASE | re.DOTALL)


@dataclass(kw_only=True)
class _Work:
    """`places` are the columns that are filled in, in the order of `wanted`; `maximum` is Moodle's own column of it."""

    platform: Platform
    sheet: Sheet
    known: dict[str, ColumnKind]
    wanted: Sequence[PointsColumn]
    places: list[int] = field(default_factory=list)
    maximum: int | None = None
    remarks: list[str] = field(default_factory=list)


def fill_template(
    template: Path, platform: Platform, marks: Sequence[Mark], wanted: Sequence[PointsColumn], *, named: bool
) -> tuple[bytes, list[str]]:
    """Return the export with the points of the students found in it, every other byte as it was; and remarks.

    Raises UsageError where the file is none of this platform's exports, or where it is not clear which column is ours.
    """
    sheet = read_sheet(template)
    known = kinds(sheet.header, platform)
    if not set(known.values()) - {"section"}:
        raise UsageError(
            f"{template}: no column says whose row it is; there are: {', '.join(sheet.header)[:300]}",
            hint="give the platform's own export of its gradebook",
        )
    work = _Work(platform=platform, sheet=sheet, known=known, wanted=wanted)
    students = [record for record in sheet.records[1:] if _is_student(record)]
    _find_columns(work, named=named)
    work.remarks += _maxima(work, students)
    theirs = [row_identity(_fields(record, work), work.known) for record in students]
    rows, doubtful = match([entry_identity(mark.entry, platform) for mark in marks], theirs)
    for place, mark in enumerate(marks):
        if place in rows:
            _fill(work, students[rows[place]], mark)
        else:
            who = f"{mark.entry.id} ({mark.entry.name})" if mark.entry.name else mark.entry.id
            work.remarks.append(f"{who}: not in {template.name}: {doubtful[place]}")
    work.remarks += _unmatched_remarks(work, students, theirs, set(rows.values()))
    return sheet.to_bytes(), work.remarks


def _is_student(record: TemplateRow) -> bool:
    values = [record.value(column) for column in range(len(record.cells))]
    # an empty line, or Canvas's rows that belong to no student
    return "Points Possible" not in values[0] and not all(_POSTING.fullmatch(value) for value in values)


def _fields(record: TemplateRow, work: _Work) -> dict[str, str]:
    return {name: record.value(column) for column, name in enumerate(work.sheet.header) if name in work.known}


def _find_columns(work: _Work, *, named: bool) -> None:
    header = work.sheet.header
    worksheet = worksheet_columns(header, work.known) if work.platform == "moodle" else None
    if worksheet and not named:
        if len(work.wanted) > 1:
            raise UsageError(
                f"{work.sheet.path}: an offline grading worksheet has one grade for the whole",
                hint="leave out --per-criterion, or give an export of the grader report",
            )
        work.places, work.maximum = [worksheet[0]], worksheet[1]
        return
    whole = len(work.wanted) == 1
    for wanted in work.wanted:
        place = find_column(header, wanted, work.platform, work.known, named=named and whole)
        work.places.append(_add_column(work, wanted) if place is None else place)


def _add_column(work: _Work, wanted: PointsColumn) -> int:
    """Add a column at the end of every row, and return its place."""
    place = len(work.sheet.header)
    points = number_text(wanted.max_points)
    new = f"{wanted.title} [Total Pts: {points} Score]" if work.platform == "blackboard" else wanted.title
    (name,) = harmless([new])
    for number, record in enumerate(work.sheet.records):
        if record.is_empty:
            continue
        record.cells += [""] * (place - len(record.cells))
        text = name if number == 0 else points if "Points Possible" in record.value(0) else ""
        record.cells.append(work.sheet.written(text) if text else "")
    made = {
        "canvas": "Canvas makes a new assignment of it",
        "moodle": "map it to a new grade item",
        "blackboard": "Blackboard makes a column of text of it: better make the column there, and export again",
    }
    work.remarks.append(f"no column is called {wanted.title}: it is added at the end; {made[work.platform]}")
    return place


def _maxima(work: _Work, students: Sequence[TemplateRow]) -> Iterator[str]:
    """Yield where the platform counts to another maximum. Points stay as they are: that is for a person to settle."""
    for wanted, place in zip(work.wanted, work.places, strict=True):
        said = _maximum(work, students, place)
        if said is not None and abs(said - wanted.max_points) > 1e-6:
            yield (
                f"{work.sheet.header[place]}: the platform has a maximum of {number_text(said)} points, "
                f"the rubric {number_text(wanted.max_points)}: points are written as the rubric gives them"
            )


def _maximum(work: _Work, students: Sequence[TemplateRow], place: int) -> float | None:
    if work.platform == "blackboard":
        found = re.search(r"\[Total Pts: (?:up to )?([\d.]+)", work.sheet.header[place])
        return float(found[1]) if found and found[1].count(".") < 2 else None
    if work.maximum is not None:
        return next((_number(record.value(work.maximum)) for record in students), None)
    possible = (record for record in work.sheet.records if "Points Possible" in record.value(0))
    return next((_number(record.value(place)) for record in possible), None)


def _fill(work: _Work, record: TemplateRow, mark: Mark) -> None:
    for place, points in zip(work.places, mark.points, strict=True):
        record.cells += [""] * (place + 1 - len(record.cells))
        there = record.value(place).strip()
        if points is None:
            if there not in {"", "-"}:  # Moodle's sign for no grade
                work.remarks.append(f"{mark.entry.id}: {there} is there already, and stays")
        elif work.platform == "canvas" and there.upper() in KEPT:
            work.remarks.append(
                f"{mark.entry.id}: {there} stays, the {number_text(points)} points are left out"
            )
        elif _number(there) != points:  # `87.50` that is right stays as it is written
            record.cells[place] = work.sheet.written(number_text(points), record.cells[place])


def _unmatched_remarks(
    work: _Work, students: Sequence[TemplateRow], theirs: Sequence[Identity], taken: set[int]
) -> Iterator[str]:
    """Yield a remark for each student who is in the export only."""
    for place, (record, identity) in enumerate(zip(students, theirs, strict=True)):
        fields = _fields(record, work)
        named = [fields[name] for name, kind in work.known.items() if kind != "section" and fields.get(name)]
        if place not in taken and identity.name != "test student":  # whom Canvas puts into every course
            yield f"{', '.join(named) or 'a row without a name'}: in {work.sheet.path.name}, without a submission here"


def _number(text: str) -> float | None:
    # with a comma, as exports in other languages have it
    found = re.fullmatch(r"\s*(-?\d{1,12})(?:[.,](\d{1,12}))?\s*", text, re.ASCII)
    return float(f"{found[1]}.{found[2] or 0}") if found else None


_GRADE = {"grade", "bewertung", "note", "calificación", "valutazione"}
_MAXIMUM = {"maximumgrade", "bestwertung", "notemaximale", "calificaciónmáxima", "valutazionemassima"}
_REAL = re.compile(r"\((real|points|punkte|points?|réel|brut|real\w*)\)\s*$", re.IGNORECASE)
_OTHER = re.compile(r"\((feedback|percentage|letter|prozentsatz|buchstabe)\)\s*$", re.IGNORECASE)
SHOWN_MAX = 12


def find_column(
    header: Sequence[str],
    wanted: PointsColumn,
    platform: Platform,
    known: dict[str, ColumnKind],
    *,
    named: bool,
) -> int | None:
    """Return the column's place; None where there is none. With `named`, the instructor has said what it is called.

    Raises UsageError where several columns could be it, or none is what was named.
    """
    exact = [place for place, name in enumerate(header) if name.strip() in wanted.names]
    meant = {letters_and_digits(name) for name in wanted.names}
    near = [
        place
        for place, name in enumerate(header)
        if name not in known and not _OTHER.search(name) and meant & _titles(name, platform)
    ]
    # Moodle exports one item as points, percentage and letter, each a column: points go where points are.
    near = [place for place in near if _REAL.search(header[place])] or near if len(near) > 1 else near
    found = exact or near
    if len(found) > 1:
        raise UsageError(
            f"several columns could be {wanted.title}: {', '.join(header[place] for place in found)}",
            hint="say which one with --column",
        )
    if not found and named:
        others = [name for name in header if name.strip() and name not in known]
        hint = f"there are: {first_few(others, SHOWN_MAX)}"
        raise UsageError(f"no column {wanted.title} in the template", hint=hint)
    return found[0] if found else None


def worksheet_columns(header: Sequence[str], known: dict[str, ColumnKind]) -> tuple[int, int | None] | None:
    """Return the places of the grade and of its maximum in Moodle's offline grading worksheet; None in other files."""
    plains = [letters_and_digits(name) for name in header]
    grade = next((place for place, name in enumerate(plains) if name in _GRADE), None)
    if grade is None or "platform" not in known.values():
        return None
    return grade, next((place for place, name in enumerate(plains) if name in _MAXIMUM), None)


def _titles(name: str, platform: Platform) -> set[str]:
    """Return what the column may be called without what the platform adds."""
    # the assignment's number: `Lab 1 (12345)`
    if platform == "canvas":
        return {letters_and_digits(re.sub(r"\s*\(\d+\)\s*$", "", name))}
    if platform == "blackboard":
        return {letters_and_digits(re.sub(r"\s*\[Total Pts:.*$|\s*\|\s*\d+\s*$", "", name))}
    # the kind of the grade, `Lab 1 (Real)`, and before it the kind of the item: `Assignment: Lab 1`
    bare = re.sub(r"\s*\([^()]*\)\s*$", "", name)
    return {letters_and_digits(bare), letters_and_digits(bare.partition(":")[2]) or letters_and_digits(bare)}


BYTES_MAX = 64 << 20
_EXPORT = "export it from the platform as CSV, and do not save it from a spreadsheet"


@dataclass(kw_only=True)
class TemplateRow:
    """The cells of one row as they are written, quotation marks too, and the line end behind them."""

    cells: list[str]
    end: str

    def value(self, column: int) -> str:
        """Return what a cell says; empty where the row has no such cell."""
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
    records: list[TemplateRow]

    @property
    def header(self) -> list[str]:
        """The columns' names, as they are written."""
        return [_value(cell) for cell in self.records[0].cells]

    def written(self, text: str, instead: str = "") -> str:
        """Return a cell that says `text`, quoted if the cell before was, or else if every column's name is."""
        quoted = instead.startswith('"') if instead else all(c.startswith('"') for c in self.records[0].cells)
        if quoted or any(sign in text for sign in (self.delimiter, '"', "\r", "\n")):
            return '"' + text.replace('"', '""') + '"'
        return text

    def to_bytes(self) -> bytes:
        """Return the whole file."""
        text = "".join(self.delimiter.join(record.cells) + record.end for record in self.records)
        return self.mark + text.encode(self.encoding)


def read_sheet(path: Path) -> Sheet:
    """Read the export. Raises UsageError for what is not a table of text."""
    data = read_given(path, BYTES_MAX, hint="give the platform's export")
    # PK: a workbook is a zip file
    if not data or data.startswith(b"PK\x03\x04"):
        raise UsageError(f"{path}: this is not a CSV export", hint=_EXPORT)
    mark, encoding = encoding_of(data)
    try:
        text = data[len(mark) :].decode(encoding)
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: not {encoding.upper()} text", hint=_EXPORT) from error
    delimiter = delimiter_of(re.split(r"[\r\n]", text, maxsplit=1)[0])
    sheet = Sheet(
        path=path, mark=mark, encoding=encoding, delimiter=delimiter, records=list(_records(text, delimiter))
    )
    # a file with nothing but a byte order mark has no row at all
    if not sheet.records or not any(name.strip() for name in sheet.header):
        raise UsageError(f"{path}:1: no columns are named", hint=_EXPORT)
    return sheet


def _records(text: str, delimiter: str) -> Iterator[TemplateRow]:
    """Yield the rows. Whatever is there becomes a cell; joined again, they are the same text."""
    # a cell in quotation marks, where `""` stands for one, or one without; then what ends it
    cell = re.compile(
        rf'("[^"]*(?:""[^"]*)*"[^{delimiter}\r\n]*|[^{delimiter}\r\n]*)({delimiter}|\r\n|\n|\r|\Z)'
    )
    cells: list[str] = []
    for found in cell.finditer(text):
        cells.append(found[1])
        if found[2] == delimiter:
            continue
        if found[2] or len(cells) > 1 or cells[0]:
            yield TemplateRow(cells=cells, end=found[2])
        cells = []


def _value(cell: str) -> str:
    cell = cell.strip()
    return cell[1:-1].replace('""', '"') if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell
