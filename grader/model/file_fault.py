"""Why a file of a student's cannot be read as what it should be."""

from __future__ import annotations

import re

from pydantic import Field

from grader.model.record import Record
from grader.model.verdict import FileCitation


class Fault(Record):
    """Why a file cannot be read as what it should be.

    `kind` is the parser's own word (`XMLSyntaxError`, `TabError`). `cause` says the same in words for
    students, and is empty if the message says enough; `fix` says what to do, and is empty if that is not
    known. `unclosed` is the bracket that is opened on that line and never closed, `?` if Python does not
    say which. `source` is the text of the line if the column is known. `further` says how to write other lines of the
    file that cannot be read either.
    """

    file: str
    line: int | None
    column: int | None = None
    kind: str
    message: str
    cause: str = ""
    fix: str = ""
    unclosed: str = ""
    source: str = ""
    further: tuple[str, ...] = Field(default=(), exclude_if=lambda value: not value)

    @property
    def explanation(self) -> str:
        """What is wrong, and what to do if that is known."""
        why = self.cause or self.message
        return f"{why}: {self.fix}" if self.fix else why

    @property
    def place(self) -> FileCitation:
        """The line, with its column if known."""
        return FileCitation(file=self.file, line=self.line, column=self.column, source=self.source)

    @property
    def advice(self) -> str:
        """What to do on which line; "" if that is not known."""
        # Such a fix says its line itself.
        named = self.line is None or re.match(r"(above|below|delete|write|make) line \d", self.fix)
        where = "" if named else f"line {self.line}: "
        return f"{where}{self.fix}" if self.fix else ""
