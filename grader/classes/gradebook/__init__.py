"""A class's results as a table: for people, for programs, and as learning platforms import it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from grader.classes.gradebook.matching import Platform, marks_of, new_import_file, remarks_of, wanted_columns
from grader.classes.gradebook.table import (
    FORMS,
    Book,
    Cell,
    GradebookFormat,
    GradebookRow,
    cells,
    csv_line,
    header,
    visible_text,
)
from grader.classes.gradebook.template import fill_template
from grader.errors import OutputError, UsageError
from grader.files import atomic_write, temporary_folder, whole_file
from grader.model.result import GradingResult
from grader.untrusted_text import json_text, steers

__all__ = ["FORMS", "Book", "GradebookFormat", "GradebookRow", "write_gradebook"]


if TYPE_CHECKING:
    from xlsxwriter.format import Format
    from xlsxwriter.worksheet import Worksheet

PLATFORMS: Mapping[GradebookFormat, Platform] = {name: name for name in get_args(Platform)}


def write_gradebook(
    book: Book,
    rows: Iterable[GradebookRow],
    target: Path,
    form: GradebookFormat,
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
        PLAIN[form](book, rows, target)
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
        lines, more = new_import_file(platform, marks, wanted, book.columns)
        _write_lines(target, lines)
    return (*remarks, *more)


OPTIONAL = {
    name for name, field in GradingResult.model_fields.items() if not (field.is_required() or field.default)
}
"""What `result.json` has only where there is any."""


def write_csv(book: Book, rows: Iterable[GradebookRow], target: Path) -> None:
    """Write UTF-8 without a byte order mark, as programs read it; the workbook is for Excel."""
    below = (list(cells(book, row)) for row in rows)
    _write_lines(target, map(csv_line, chain([header(book)], below)))


def write_jsonl(_book: Book, rows: Iterable[GradebookRow], target: Path) -> None:
    """Write a line for each row: what `result.json` says (`grader.result/1`), and the roster under `roster`."""
    _write_lines(target, map(json_line, rows))


def _write_lines(target: Path, lines: Iterable[str]) -> None:
    with whole_file(target) as path, path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(lines)


def json_line(row: GradebookRow) -> str:
    """Return the row as one line of JSON, with its end. Nothing in it steers or hides."""
    result = row.result.model_dump(mode="json", by_alias=True)
    data = {key: value for key, value in result.items() if value or key not in OPTIONAL}
    data["roster"] = row.entry.model_dump(mode="json")
    text = json.dumps(data, ensure_ascii=False)
    # `json_text` escapes, and takes several times as long
    if "##" not in text and not any(map(steers, set(text))):
        return text + "\n"
    return re.sub(r"\n *", "", json_text(data)) + "\n"


WIDTH_MIN, WIDTH_MAX, WIDTH_TEXT = 8, 40, 24
WORKBOOK = {
    # row by row to the disk, so that memory does not grow with the class
    "constant_memory": True,
    "strings_to_formulas": False,
    "strings_to_urls": False,
    "strings_to_numbers": False,
}


def write_workbook(book: Book, rows: Iterable[GradebookRow], target: Path) -> None:
    """Write two sheets: the gradebook, and what its criteria are. No text is a formula or a link."""
    import xlsxwriter  # noqa: PLC0415 - slow to load
    from xlsxwriter.exceptions import XlsxWriterException  # noqa: PLC0415 - as above

    with whole_file(target) as path, temporary_folder("gradebook") as temporary:
        workbook = xlsxwriter.Workbook(str(path), {**WORKBOOK, "tmpdir": temporary})
        sheets = [workbook.add_worksheet(name) for name in ("Gradebook", "Criteria")]
        try:
            bold = workbook.add_format({"bold": True})
            _gradebook(sheets[0], book, rows, bold)
            _criteria(sheets[1], book, bold)
            workbook.close()
        except XlsxWriterException as error:
            raise OutputError(
                f"cannot write {target}: {error}", hint="choose another form with --form"
            ) from error
        finally:
            # xlsxwriter closes these files of rows itself only when it writes the workbook
            for sheet in sheets:  # where something failed, the rows that are there already are still open
                sheet.row_data_fh.close()


def _gradebook(sheet: Worksheet, book: Book, rows: Iterable[GradebookRow], bold: Format) -> None:
    names = header(book)
    wide = {"id", "name", "late", "comment", "error"}
    for column, name in enumerate(names):
        width = WIDTH_TEXT if name in wide else min(max(len(name) + 3, WIDTH_MIN), WIDTH_MAX)
        sheet.set_column(column, column, width)
    _write(sheet, 0, names, bold)
    last = 0
    for last, row in enumerate(rows, start=1):
        _write(sheet, last, list(cells(book, row)))
    sheet.freeze_panes(1, 1)
    sheet.autofilter(0, 0, max(last, 1), len(names) - 1)


def _criteria(sheet: Worksheet, book: Book, bold: Format) -> None:
    names = ("id", "title", "max_points")
    sheet.set_column(0, 0, WIDTH_TEXT)
    sheet.set_column(1, 1, WIDTH_MAX)
    _write(sheet, 0, names, bold)
    for number, criterion in enumerate(book.criteria, start=1):
        _write(sheet, number, criterion[: len(names)])
    sheet.freeze_panes(1, 0)


def _write(sheet: Worksheet, number: int, row: Sequence[Cell], form: Format | None = None) -> None:
    for column, cell in enumerate(row):
        if isinstance(cell, str) and cell:
            sheet.write_string(number, column, visible_text(cell), form)
        elif isinstance(cell, int | float):
            sheet.write_number(number, column, cell, form)


PLAIN: Mapping[GradebookFormat, Callable[[Book, Iterable[GradebookRow], Path], None]] = {
    "csv": write_csv,
    "jsonl": write_jsonl,
    "xlsx": write_workbook,
}
