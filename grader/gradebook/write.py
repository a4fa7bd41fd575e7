"""A gradebook in any of its forms."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from grader.errors import UsageError
from grader.gradebook.model import Book, Form, Row
from grader.gradebook.plain import write_csv, write_jsonl


def write_gradebook(
    book: Book,
    rows: Iterable[Row],
    target: Path,
    form: Form,
    *,
    per_criterion: bool = False,
    template: Path | None = None,
    column: str = "",
) -> tuple[str, ...]:
    """Write `rows`, read one by one, to the file `target`, which appears whole or not at all.

    The forms of platforms take `template`, an export of the platform to fill in, `per_criterion` for a column each, and
    `column` for what the platform calls it (default: the rubric's title). What comes back are remarks, a line each:
    whose mark is open, who could not be matched, what the platform will miss.

    Raises UsageError where the template cannot be filled in, OutputError or HostError where nothing can be written.
    """
    if form in ("csv", "jsonl", "xlsx"):
        if template or per_criterion or column:
            raise UsageError(
                f"--form {form} has every criterion and needs no template",
                hint="--template, --per-criterion and --column are for canvas, moodle and blackboard",
            )
        _plain(book, rows, target, form)
        return ()
    raise UsageError(f"--form {form} is not there yet")


def _plain(book: Book, rows: Iterable[Row], target: Path, form: Form) -> None:
    if form == "csv":
        write_csv(book, rows, target)
    elif form == "jsonl":
        write_jsonl(rows, target)
    else:  # only who wants a workbook waits for its library
        import_module("grader.gradebook.workbook").write_workbook(book, rows, target)
