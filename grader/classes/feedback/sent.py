"""`sent.jsonl`: what was sent to whom, by which form and when. Lines are appended, each flushed to the disk.

A line that was torn by a crash is passed over: the one before it says that sending was begun, and not how it ended.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path

from pydantic import ValidationError

from grader.classes.feedback.publish import read_rows
from grader.errors import UsageError
from grader.files import FILE as PRIVATE
from grader.files import unwritable
from grader.intake import safe_name
from grader.model.publication import Publication, Sent, SentState
from grader.model.version import SENT, UPDATE
from grader.portable import BINARY, CLOEXEC, NOFOLLOW

FILE = "sent.jsonl"


class SentLog:
    """What was sent of the class in `folder` by one form. Raises UsageError if a newer grader wrote of it."""

    def __init__(self, folder: Path, form: str) -> None:
        self.path, self.form = folder / FILE, form
        self._lines: dict[str, list[Sent]] = {}
        for number, row in enumerate(read_rows(self.path), start=1):
            if newer := SENT.newer_in(row):
                raise UsageError(f"{self.path}:{number}: {newer}", hint=UPDATE)
            try:
                self._remember(Sent.read_json(row))
            except ValidationError:
                continue

    def state(self, publication: Publication) -> SentState | None:
        """Return the last that is known of this publication; None if it was never begun."""
        same = [line.state for line in self._of(publication.id) if line.digest == publication.digest]
        return same[-1] if same else None

    def last_place(self, submission: str) -> str:
        """Return where this student's feedback went last; empty if none was sent."""
        return next((line.place for line in reversed(self._of(submission)) if line.state == "sent"), "")

    def add(
        self, publications: Sequence[Publication], state: SentState, *, place: str = "", message: str = ""
    ) -> None:
        """Append a line for each of them. Raises OutputError."""
        lines = [
            Sent(
                id=one.id,
                form=self.form,
                digest=one.digest,
                at=datetime.now(timezone.utc),
                state=state,
                place=place,
                message=message,
            )
            for one in publications
        ]
        text = "".join(f"{line.model_dump_json(by_alias=True)}\n" for line in lines)
        try:
            self._append(text.encode())
        except OSError as error:
            raise unwritable(self.path, error) from error
        for line in lines:
            self._remember(line)

    def _append(self, data: bytes) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | CLOEXEC | NOFOLLOW | BINARY
        with os.fdopen(os.open(self.path, flags, PRIVATE), "r+b", buffering=0) as file:
            if file.seek(0, os.SEEK_END) and file.seek(-1, os.SEEK_END) >= 0 and file.read(1) != b"\n":
                data = b"\n" + data
            file.write(data)
            os.fsync(file.fileno())

    def _of(self, submission: str) -> list[Sent]:
        return self._lines.get(safe_name(submission), [])

    def _remember(self, line: Sent) -> None:
        if line.form == self.form:
            self._lines.setdefault(safe_name(line.id), []).append(line)
