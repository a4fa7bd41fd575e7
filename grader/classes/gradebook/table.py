"""The plain gradebook as rows and cells, the same in CSV and in a workbook. No text in it is a formula."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from decimal import Decimal
from typing import Literal, NamedTuple

from grader.model.batch import Entry
from grader.model.record import Record
from grader.model.result import AppliedOverride, GradingResult
from grader.report.text import csv_cell
from grader.untrusted_text import line

GradebookFormat = Literal["csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard"]
FORMS: tuple[GradebookFormat, ...] = ("csv", "jsonl", "xlsx", "canvas", "moodle", "blackboard")


class GradebookRow(Record):
    """One submission of the roster and its result."""

    entry: Entry
    result: GradingResult


class BookCriterion(NamedTuple):
    id: str
    title: str
    max_points: float
    extra: float = 0.0


class Book(Record):
    """What all rows share: the rubric's `title` and criteria, and the names of the roster's further columns."""

    title: str
    rubric_id: str
    max_points: float
    criteria: tuple[BookCriterion, ...] = ()
    columns: tuple[str, ...] = ()


BEFORE = ("id", "name", "group", "status", "points", "max_points", "points_before_late", "late")
AFTER = ("comment", "error")


def header(book: Book) -> tuple[str, ...]:
    """Return the columns' names: each is there once, whatever criteria and the roster's columns are called."""
    taken = {*BEFORE, *AFTER}
    criteria = [_free(criterion.id, "criterion", taken) for criterion in book.criteria]
    return (*BEFORE, *criteria, *AFTER, *(_free(name, "roster", taken) for name in book.columns))


def cells(book: Book, row: GradebookRow) -> Iterator[Cell]:
    """Yield what stands below each name of `header`."""
    entry, result = row.entry, row.result
    yield from (entry.id, entry.name, entry.group, result.status)
    counting = [c for c in result.criteria if c.counts]
    # if every criterion is open, 0 points would look like a mark
    graded = result.status != "error" and not (counting and all(c.status.is_open for c in counting))
    yield from (result.points if graded else None, result.max_points or book.max_points)
    yield (result.late.points_before if result.late else result.points) if graded else None
    yield late_text(result)
    found = criterion_points(result)
    yield from (found.get(criterion.id) for criterion in book.criteria)
    yield comment(result)
    yield error_text(result)
    yield from (entry.extra.get(name, "") for name in book.columns)


def criterion_points(result: GradingResult) -> dict[str, float | None]:
    """Return the points by the criterion's id; None where they are still open."""
    return {c.id: None if c.status.is_open else c.points for c in result.criteria}


def late_text(result: GradingResult) -> str:
    """Return what being late cost, and why; empty for in time."""
    return result.late.text if result.late and result.late.late_s > 0 else ""


def comment(result: GradingResult) -> str:
    """Return what people said when they gave points themselves, or answered."""
    return "; ".join(_override(override) for override in result.overrides)


def error_text(result: GradingResult) -> str:
    """Return why it could not be graded, or what a person has to look at."""
    if result.error:
        return result.error.message
    waiting = [c.id for c in result.criteria if c.status.is_open and c.counts]
    return f"open: {', '.join(waiting)}" if waiting else ""


def _override(override: AppliedOverride) -> str:
    author = f" ({override.author})" if override.author else ""
    said = "; ".join(filter(None, (override.comment, override.answer)))
    return f"{override.criterion}: {said or 'points given by a person'}{author}"


def _free(name: str, kind: str, taken: set[str]) -> str:
    """Return `name`, or another one where it is taken."""
    free, number = name, 1
    while free.casefold() in taken:
        free = f"{kind} {name}" if number == 1 else f"{kind} {name} {number}"
        number += 1
    taken.add(free.casefold())
    return free


CELL_CHARS = 10_000
"""What a cell holds of a longer text; a workbook's may have 32,767 characters."""
Cell = str | float | None

_NUMBER = re.compile(r"[+-]?\d{1,15}([.,]\d{1,15})?|-", re.ASCII)
"""A number, or the dash that stands for none."""
_JOINERS = ("\u200c", "\u200d")
"""Letters of Persian, Hindi and others need them between them, and nothing is hidden by them."""


def number_text(value: float) -> str:
    """Return a number as every platform reads it: `87.5`, `100`."""
    # by `repr`, which has no more digits than the number needs; `f` writes no exponent
    return format(Decimal(repr(float(value))).normalize(), "f")


def visible_text(text: str) -> str:
    """Return one visible line. Where letters need joiners between them, those stay."""
    return _restore_joiners(line(text, CELL_CHARS))


def harmless(cells: Sequence[Cell]) -> list[str]:
    """Return one row as text that no spreadsheet takes for a formula. A number stays as it is written, in text too."""
    texts = [number_text(cell) if isinstance(cell, int | float) else cell or "" for cell in cells]
    return [text if _NUMBER.fullmatch(text) else _restore_joiners(csv_cell(text)) for text in texts]


def csv_line(cells: Sequence[Cell], *, quoted: bool = False) -> str:
    """Return one row of CSV with its line end, made harmless. With `quoted`, every field is in quotation marks."""
    out = io.StringIO()
    # as RFC 4180 has it
    writer = csv.writer(out, quoting=csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL, lineterminator="\r\n")
    writer.writerow(harmless(cells))
    return out.getvalue()


def _restore_joiners(text: str) -> str:
    for joiner in _JOINERS:
        text = text.replace(f"\\u{ord(joiner):04x}", joiner)
    return text
