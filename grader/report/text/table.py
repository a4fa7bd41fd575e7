"""CSV that spreadsheets read as what it is: numbers of ours, and text that is never a formula."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence

from grader.untrusted_text import line

CELL_CHARS = 2000
Cell = str | float | None

# Spreadsheets skip blanks and quotes before the sign, know it in full width, and split at `;` in half of Europe.
_FORMULA = re.compile(r"(^|;)([\s\"'`]*[=+\-@\uff1d\uff0b\uff0d\uff20\u2212\ufe62\ufe63\ufe66\ufe6b])")


def csv_text(rows: Iterable[Sequence[Cell]]) -> str:
    """The rows as RFC 4180 has them. Numbers stay numbers; text that could be a formula begins with `'`."""
    out = io.StringIO()
    writer = csv.writer(out, quoting=csv.QUOTE_MINIMAL, lineterminator="\r\n")
    writer.writerows([_cell(value) for value in row] for row in rows)
    return out.getvalue()


def _cell(value: Cell) -> str:
    if value is None:
        return ""
    if not isinstance(value, str):
        return str(value) if math.isfinite(value) else ""
    return _FORMULA.sub(r"\1'\2", line(value, CELL_CHARS))
