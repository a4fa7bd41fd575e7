"""A gradebook in any of its forms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path

from grader.classes.gradebook.fill import fill_template
from grader.classes.gradebook.fresh import fresh
from grader.classes.gradebook.identity import Platform
from grader.classes.gradebook.marks import marks_of, remarks_of, wanted_columns
from grader.classes.gradebook.model import Book, Form, Row
from grader.classes.gradebook.plain import write_csv, write_jsonl
from grader.classes.gradebook.whole import whole_file
from grader.errors import UsageError
from grader.files import atomic_write

PLATFORMS: Mapping[Form, Platform] = {"canvas": "canvas", "moodle": "moodle", "blackboard": "blackboard"}


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
    platform = PLATFORMS.get(form)
    if platform is None:
        if template or per_criterion or column:
            raise UsageError(
                f"--form {form} has every criterion and needs no template",
                hint="--template, --per-criterion and --column are for canvas, moodle and blackboard",
            )
        _plain(book, rows, target, form)
        return ()
    marks = marks_of(book, rows, per_criterion=per_criterion)
    wanted = wanted_columns(book, column, per_criterion=per_criterion)
    if not wanted:
        raise UsageError(
            f"{book.title} has no criteria that are worth points", hint="leave out --per-criterion"
        )
    remarks = list(remarks_of(marks, per_criterion=per_criterion))
    if template:
        data, more = fill_template(template, platform, marks, wanted, named=bool(column))
        atomic_write(target, data)
    else:
        lines, more = fresh(platform, marks, wanted, book.columns)
        with whole_file(target) as path, path.open("w", encoding="utf-8", newline="") as file:
            file.writelines(lines)
    return (*remarks, *more)


def _plain(book: Book, rows: Iterable[Row], target: Path, form: Form) -> None:
    if form == "csv":
        write_csv(book, rows, target)
    elif form == "jsonl":
        write_jsonl(rows, target)
    else:  # only who wants a workbook waits for its library
        import_module("grader.classes.gradebook.workbook").write_workbook(book, rows, target)
