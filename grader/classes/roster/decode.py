"""The text of a file that a spreadsheet may have written, in the encodings that they use."""

from __future__ import annotations

import codecs
from pathlib import Path

from grader.errors import UsageError

_MARKS = (  # the longer ones first: UTF-32's begins with UTF-16's
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_WORKBOOKS = {b"PK\x03\x04": "an Excel or LibreOffice workbook", b"\xd0\xcf\x11\xe0": "an old Excel workbook"}
_SAVE = "save it as CSV UTF-8 (in Excel: 'CSV UTF-8', not 'CSV')"


def text_of(data: bytes, path: Path) -> str:
    """UTF-8, with or without its mark, or UTF-16. Raises UsageError with the line of what is neither."""
    workbook = next((what for magic, what in _WORKBOOKS.items() if data.startswith(magic)), None)
    if workbook:
        raise UsageError(f"{path}: this is {workbook}, no CSV", hint=_SAVE)
    encoding = _encoding(data)
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        named = encoding.removesuffix("-sig").removesuffix("-le").removesuffix("-be").upper()
        raise UsageError(f"{path}:{line}: no {named} text", hint=_SAVE) from error


def _encoding(data: bytes) -> str:
    """By the mark at the beginning; UTF-16 without one has a zero in every second byte of plain text."""
    marked = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    if marked:
        return marked
    head = data[:1000]
    for start, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        if (
            len(head) >= 4
            and head[start::2].count(0) > len(head) * 0.4
            and head[1 - start :: 2].count(0) == 0
        ):
            return name
    return "utf-8-sig"
