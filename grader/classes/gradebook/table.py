"""The rows of the plain gradebook: one a submission, the same in CSV and in a workbook."""

from __future__ import annotations

from collections.abc import Iterator

from grader.classes.gradebook.cells import Cell
from grader.classes.gradebook.model import Book, Row
from grader.model.result import AppliedOverride, GradingResult

BEFORE = ("id", "name", "group", "status", "points", "max_points", "points_before_late", "late")
AFTER = ("comment", "error")
"""Of a criterion that has no points yet: a person has to look."""


def header(book: Book) -> tuple[str, ...]:
    """The columns' names: each is there once, whatever criteria and the roster's columns are called."""
    taken = {*BEFORE, *AFTER}
    names = list(BEFORE)
    for name, kind in [
        *((c.id, "criterion") for c in book.criteria),
        *((name, "roster") for name in book.columns),
    ]:
        names.append(_free(name, kind, taken))
    criteria = len(BEFORE) + len(book.criteria)
    return (*names[:criteria], *AFTER, *names[criteria:])


def cells(book: Book, row: Row) -> Iterator[Cell]:
    """What stands below each name of `header`."""
    entry, result = row.entry, row.result
    yield from (entry.id, entry.name, entry.group, result.status)
    yield from (result.points, result.max_points or book.max_points)
    yield result.late.points_before if result.late else result.points
    yield late_text(result)
    found = criterion_points(result)
    yield from (found.get(criterion.id) for criterion in book.criteria)
    yield comment(result)
    yield error_text(result)
    yield from (entry.extra.get(name, "") for name in book.columns)


def criterion_points(result: GradingResult) -> dict[str, float | None]:
    """Points by the criterion's id; None where they are still open."""
    return {c.id: None if c.status.is_open else c.points for c in result.criteria}


def late_text(result: GradingResult) -> str:
    """What being late cost, and why; empty for in time."""
    return result.late.text if result.late and result.late.late_s > 0 else ""


def comment(result: GradingResult) -> str:
    """What people said when they gave points themselves."""
    return "; ".join(_override(override) for override in result.overrides)


def error_text(result: GradingResult) -> str:
    """Why it could not be graded, or what a person has to look at."""
    if result.error:
        return result.error.message
    waiting = [c.id for c in result.criteria if c.status.is_open and c.max_points > 0]
    return f"open: {', '.join(waiting)}" if waiting else ""


def _override(override: AppliedOverride) -> str:
    author = f" ({override.author})" if override.author else ""
    return f"{override.criterion}: {override.comment or 'points given by a person'}{author}"


def _free(name: str, kind: str, taken: set[str]) -> str:
    """`name`, or another one where it is taken."""
    free, number = name, 1
    while free.casefold() in taken:
        free = f"{kind} {name}" if number == 1 else f"{kind} {name} {number}"
        number += 1
    taken.add(free.casefold())
    return free
