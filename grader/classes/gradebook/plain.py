"""The plain gradebook as CSV, and the results as JSON Lines."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path

from grader.classes.gradebook.cells import csv_line
from grader.classes.gradebook.model import Book, Row
from grader.classes.gradebook.table import cells, header
from grader.classes.gradebook.whole import whole_file
from grader.model.result import GradingResult
from grader.untrusted_text import json_text, steers

OPTIONAL = {
    name for name, field in GradingResult.model_fields.items() if not (field.is_required() or field.default)
}
"""What `result.json` has only where there is any."""


def write_csv(book: Book, rows: Iterable[Row], target: Path) -> None:
    """UTF-8 without a mark, as programs read it; whoever has Excel takes the workbook."""
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
