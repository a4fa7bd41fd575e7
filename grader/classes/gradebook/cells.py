"""What stands in a cell: numbers that stay numbers, and text that is on one line, visible, and no formula."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from decimal import Decimal

from grader.report.text import csv_text
from grader.untrusted_text import line

CELL_CHARS = 10_000
"""What a cell holds of a longer text; a workbook's may have 32,767 characters."""
Cell = str | float | None

_NUMBER = re.compile(r"[+-]?\d{1,15}([.,]\d{1,15})?|-", re.ASCII)
"""A number, or the dash that stands for none."""
_JOINERS = ("\u200c", "\u200d")
"""Letters of Persian, Hindi and others need them between them, and nothing is hidden by them."""


def number_text(value: float) -> str:
    """`87.5`, `100`: as every platform reads it."""
    return format(Decimal(repr(float(value))).normalize(), "f")


def visible_text(text: str) -> str:
    """One visible line. Where letters need joiners between them, those stay."""
    return _joined(line(text, CELL_CHARS))


def harmless(cells: Sequence[Cell]) -> list[str]:
    """One row as text that no spreadsheet takes for a formula. A number stays as it is written, in text too."""
    texts = [number_text(cell) if isinstance(cell, int | float) else cell or "" for cell in cells]
    safe = next(csv.reader(io.StringIO(csv_text([texts]), newline="")), [])
    return [
        text if _NUMBER.fullmatch(text) else _joined(harmless)
        for text, harmless in zip(texts, safe, strict=True)
    ]


def csv_line(cells: Sequence[Cell], *, quoted: bool = False) -> str:
    """One row of CSV with its line end, made harmless. With `quoted`, every field is in quotation marks."""
    out = io.StringIO()
    writer = csv.writer(out, quoting=csv.QUOTE_ALL if quoted else csv.QUOTE_MINIMAL, lineterminator="\r\n")
    writer.writerow(harmless(cells))
    return out.getvalue()


def _joined(text: str) -> str:
    for joiner in _JOINERS:
        text = text.replace(f"\\u{ord(joiner):04x}", joiner)
    return text
