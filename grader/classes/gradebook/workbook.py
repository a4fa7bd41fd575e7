"""The plain gradebook as an Excel workbook, written row by row."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import xlsxwriter
from xlsxwriter.exceptions import XlsxWriterException
from xlsxwriter.format import Format
from xlsxwriter.worksheet import Worksheet

from grader.classes.gradebook.table import Book, Cell, Row, cells, header, visible_text
from grader.errors import OutputError
from grader.files import whole_file

WIDTH_MIN, WIDTH_MAX, WIDTH_TEXT = 8, 40, 24
OPTIONS = {
    "constant_memory": True,
    "strings_to_formulas": False,
    "strings_to_urls": False,
    "strings_to_numbers": False,
}


def write_workbook(book: Book, rows: Iterable[Row], target: Path) -> None:
    """Two sheets: the gradebook, and what its criteria are. No text is a formula or a link."""
    with whole_file(target) as path, TemporaryDirectory(prefix="gradebook-") as temporary:
        workbook = xlsxwriter.Workbook(str(path), {**OPTIONS, "tmpdir": temporary})
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
            for sheet in sheets:  # where something failed, the rows that are there already are still open
                sheet.row_data_fh.close()


def _gradebook(sheet: Worksheet, book: Book, rows: Iterable[Row], bold: Format) -> None:
    names = header(book)
    _widths(sheet, names)
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


def _widths(sheet: Worksheet, names: Sequence[str]) -> None:
    wide = {"id", "name", "late", "comment", "error"}
    for column, name in enumerate(names):
        width = WIDTH_TEXT if name in wide else min(max(len(name) + 3, WIDTH_MIN), WIDTH_MAX)
        sheet.set_column(column, column, width)


def _write(sheet: Worksheet, number: int, row: Sequence[Cell], form: Format | None = None) -> None:
    for column, cell in enumerate(row):
        if isinstance(cell, str) and cell:
            sheet.write_string(number, column, visible_text(cell), form)
        elif isinstance(cell, int | float):
            sheet.write_number(number, column, cell, form)
