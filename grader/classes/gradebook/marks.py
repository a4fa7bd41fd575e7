"""What a learning platform is to be told of each submission: little enough to hold a whole class of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from grader.classes.gradebook.model import Book, Row
from grader.classes.gradebook.table import comment, criterion_points, error_text, late_text
from grader.model.batch import Entry
from grader.model.result import GradingResult


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """A column of points. `title` is what a new one is called, `names` what one that is there may be called."""

    title: str
    names: tuple[str, ...]
    max_points: float


@dataclass(frozen=True, kw_only=True)
class Mark:
    """`points` by column, None where they are open; `open` says why. `late_cost` is what being late cost.

    `comment` is for the student.
    """

    entry: Entry
    points: tuple[float | None, ...]
    open: str = ""
    comment: str = ""
    late_cost: float = 0.0


def wanted_columns(book: Book, column: str, *, per_criterion: bool) -> tuple[Wanted, ...]:
    """One column for the points, or one for each criterion that is worth any."""
    base = column or book.title
    if not per_criterion:
        names = (column,) if column else (book.title, book.rubric_id)
        return (Wanted(title=base, names=names, max_points=book.max_points),)
    worth = [criterion for criterion in book.criteria if criterion.max_points > 0]
    titles = [criterion.title for criterion in worth]
    return tuple(
        Wanted(
            title=f"{base} - {c.title}" + (f" ({c.id})" if titles.count(c.title) > 1 else ""),
            names=(f"{base} - {c.title}", f"{base} - {c.id}", c.id)
            if titles.count(c.title) == 1
            else (f"{base} - {c.title} ({c.id})", f"{base} - {c.id}", c.id),
            max_points=c.max_points,
        )
        for c in worth
    )


def marks_of(book: Book, rows: Iterable[Row], *, per_criterion: bool) -> list[Mark]:
    """Every row's mark. Of a result of status `error` no points count, of an inconclusive one those that are sure."""
    worth = [criterion.id for criterion in book.criteria if criterion.max_points > 0]
    return [_mark(row, worth if per_criterion else None) for row in rows]


def remarks_of(marks: Sequence[Mark], *, per_criterion: bool) -> Iterator[str]:
    """Whose points are open, and whose criteria do not say what being late cost."""
    for mark in marks:
        if mark.open:
            yield f"{mark.entry.id}: no grade ({mark.open})"
    late = [mark.entry.id for mark in marks if mark.late_cost]
    if per_criterion and late:
        yield f"criteria are without what being late cost: {', '.join(late)}"


def _mark(row: Row, worth: Sequence[str] | None) -> Mark:
    result, late = row.result, row.result.late
    cost = late.points_before - late.points if late else 0.0
    return Mark(
        entry=row.entry,
        points=_points(result, worth),
        open=_open(result),
        comment="; ".join(text for text in (late_text(result), comment(result)) if text),
        late_cost=cost,
    )


def _points(result: GradingResult, worth: Sequence[str] | None) -> tuple[float | None, ...]:
    if worth is None:
        return (result.points if result.status == "graded" else None,)
    if result.status == "error":
        return (None,) * len(worth)
    found = criterion_points(result)
    return tuple(found.get(criterion) for criterion in worth)


def _open(result: GradingResult) -> str:
    return "" if result.status == "graded" else f"{result.status}: {error_text(result)}".rstrip(": ")
