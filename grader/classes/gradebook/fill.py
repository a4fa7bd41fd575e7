"""A platform's own export with our points filled in."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.classes.gradebook.cells import harmless, number_text
from grader.classes.gradebook.columns import find_column, maximum_in, new_header, worksheet_columns
from grader.classes.gradebook.identity import Identity, Kind, Platform, entry_identity, kinds, row_identity
from grader.classes.gradebook.marks import Mark, Wanted
from grader.classes.gradebook.match import match
from grader.classes.gradebook.sheet import Record, Sheet, read_sheet
from grader.errors import UsageError

KEPT = {"EX", "N/A"}
"""What Canvas writes for who is excused, and for who has not got the assignment."""
_POSTING = re.compile(r"\s*(Muted|Manual Posting.*)?\s*", re.IGNORECASE | re.DOTALL)


@dataclass(kw_only=True)
class _Work:
    """`places` are the columns that are filled in, in the order of `wanted`; `maximum` is Moodle's own column of it."""

    platform: Platform
    sheet: Sheet
    known: dict[str, Kind]
    wanted: Sequence[Wanted]
    places: list[int] = field(default_factory=list)
    maximum: int | None = None
    remarks: list[str] = field(default_factory=list)


def fill_template(
    template: Path, platform: Platform, marks: Sequence[Mark], wanted: Sequence[Wanted], *, named: bool
) -> tuple[bytes, list[str]]:
    """The export with the points of whoever is found in it, every other byte as it was; and remarks.

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
    theirs = [_identity(record, work) for record in students]
    found = match([entry_identity(mark.entry, platform) for mark in marks], theirs)
    for place, mark in enumerate(marks):
        if place in found.rows:
            _fill(work, students[found.rows[place]], mark)
        else:
            who = f"{mark.entry.id} ({mark.entry.name})" if mark.entry.name else mark.entry.id
            work.remarks.append(f"{who}: not in {template.name}: {found.doubtful[place]}")
    work.remarks += _left(work, students, theirs, set(found.rows.values()))
    return sheet.to_bytes(), work.remarks


def _is_student(record: Record) -> bool:
    values = [record.value(column) for column in range(len(record.cells))]
    return "Points Possible" not in values[0] and not all(_POSTING.fullmatch(value) for value in values)


def _identity(record: Record, work: _Work) -> Identity:
    return row_identity(_fields(record, work), work.known)


def _fields(record: Record, work: _Work) -> dict[str, str]:
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
        work.places.append(_added(work, wanted) if place is None else place)


def _added(work: _Work, wanted: Wanted) -> int:
    """A new column at the end of every row."""
    place = len(work.sheet.header)
    points = number_text(wanted.max_points)
    (name,) = harmless([new_header(wanted, work.platform, points)])
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


def _maxima(work: _Work, students: Sequence[Record]) -> Iterator[str]:
    """Where the platform counts to another maximum, points stay as they are: that is for a person to settle."""
    for wanted, place in zip(work.wanted, work.places, strict=True):
        said = _maximum(work, students, place)
        if said is not None and abs(said - wanted.max_points) > 1e-6:
            yield (
                f"{work.sheet.header[place]}: the platform has a maximum of {number_text(said)} points, "
                f"the rubric {number_text(wanted.max_points)}: points are written as the rubric gives them"
            )


def _maximum(work: _Work, students: Sequence[Record], place: int) -> float | None:
    if work.platform == "blackboard":
        return maximum_in(work.sheet.header[place])
    if work.maximum is not None:
        return next((_number(record.value(work.maximum)) for record in students), None)
    possible = (record for record in work.sheet.records if "Points Possible" in record.value(0))
    return next((_number(record.value(place)) for record in possible), None)


def _fill(work: _Work, record: Record, mark: Mark) -> None:
    for place, points in zip(work.places, mark.points, strict=True):
        record.cells += [""] * (place + 1 - len(record.cells))
        there = record.value(place).strip()
        if points is None:
            if there not in {"", "-"}:
                work.remarks.append(f"{mark.entry.id}: {there} is there already, and stays")
        elif work.platform == "canvas" and there.upper() in KEPT:
            work.remarks.append(
                f"{mark.entry.id}: {there} stays, the {number_text(points)} points are left out"
            )
        elif _number(there) != points:
            record.cells[place] = work.sheet.written(number_text(points), record.cells[place])


def _left(
    work: _Work, students: Sequence[Record], theirs: Sequence[Identity], taken: set[int]
) -> Iterator[str]:
    """Whoever is in the export only."""
    for place, (record, identity) in enumerate(zip(students, theirs, strict=True)):
        fields = _fields(record, work)
        named = [fields[name] for name, kind in work.known.items() if kind != "section" and fields.get(name)]
        if place not in taken and identity.name != "test student":
            yield f"{', '.join(named) or 'a row without a name'}: in {work.sheet.path.name}, without a submission here"


def _number(text: str) -> float | None:
    found = re.fullmatch(r"\s*(-?\d{1,12})(?:[.,](\d{1,12}))?\s*", text, re.ASCII)
    return float(f"{found[1]}.{found[2] or 0}") if found else None
