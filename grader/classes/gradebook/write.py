"""Write a gradebook in any of its forms."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path

from grader.classes.gradebook.matching import Platform
from grader.classes.gradebook.platforms import fresh, marks_of, remarks_of, wanted_columns
from grader.classes.gradebook.table import Book, Form, Row, cells, csv_line, header
from grader.classes.gradebook.template import fill_template
from grader.errors import UsageError
from grader.files import atomic_write, whole_file
from grader.model.result import GradingResult
from grader.untrusted_text import json_text, steers

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


OPTIONAL = {
    name for name, field in GradingResult.model_fields.items() if not (field.is_required() or field.default)
}
"""What `result.json` has only where there is any."""


def write_csv(book: Book, rows: Iterable[Row], target: Path) -> None:
    """UTF-8 without a mark, as programs read it; the workbook is for Excel."""
    with whole_file(target) as path, path.open("w", encoding="utf-8", newline="") as file:
        file.write(csv_line(header(book)))
        file.writelines(csv_line(list(cells(book, row))) for row in rows)


def write_jsonl(rows: Iterable[Row], target: Path) -> None:
    """A line is what `result.json` says (`grader.result/1`), and what the roster says of it under `roster`."""
    with whole_file(target) as path, path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(json_line(row) for row in rows)


def json_line(row: Row) -> str:
    """One line, with its end. Nothing in it steers or hides."""
    result = row.result.model_dump(mode="json", by_alias=True)
    data = {key: value for key, value in result.items() if value or key not in OPTIONAL}
    data["roster"] = row.entry.model_dump(mode="json")
    text = json.dumps(data, ensure_ascii=False)
    if "##" not in text and not any(map(steers, set(text))):
        return text + "\n"
    return re.sub(r"\n *", "", json_text(data)) + "\n"
