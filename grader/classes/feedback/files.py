"""Feedback as files: a folder for each student, or one zip that Moodle or Canvas takes, with names that say whose each
file is.

Both platforms tell students apart by the names of their own download, so the class has to be graded from that, or its
roster needs Moodle's numbers.
"""

from __future__ import annotations

import io
import re
import tarfile
import zipfile
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Literal

from grader.classes.feedback.forms import PAGE, TEXT, Feedback, Sender, SendSettings
from grader.classes.gradebook.matching import kinds
from grader.classes.roster.exports import platform_name
from grader.errors import NotSent, UsageError
from grader.files import atomic_write, whole_file

_TAR = re.compile(r"\.(?:tar|tar\.(?P<ending>gz|xz|bz2)|t(?P<short>gz|xz|bz2?))$", re.IGNORECASE)
# what no disk takes in a name, and `_`, at which Moodle divides it
_NO_NAME = re.compile(r'[_/\\:*?"<>|\x00-\x1f\x7f]+')
_MODES: Mapping[str, Literal["w:", "w:gz", "w:bz2", "w:xz"]] = {
    "": "w:",
    "gz": "w:gz",
    "bz": "w:bz2",
    "bz2": "w:bz2",
    "xz": "w:xz",
}
YEAR = (1980, 1, 1, 0, 0, 0)
"""The time of each file in a zip: the same feedback gives the same bytes."""


class _Empty(Exception):
    """No zip is better than an empty one."""


class Archive(Sender):
    """One zip. Without `--out` it gets a name that is free: an earlier one may not be uploaded yet."""

    together = True
    platform = ""

    def __init__(self, settings: SendSettings) -> None:
        super().__init__(settings)
        if settings.out is not None and settings.out.exists():
            raise UsageError(f"{settings.out} is there already", hint="give another name with --out")
        self.target = settings.out or _free(settings.folder, f"feedback-{self.platform.lower()}")

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Make the zip; none if nothing is put into it."""
        with suppress(_Empty), whole_file(self.target) as beside:
            with zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as self._zip:
                yield
            if not self._zip.namelist():  # an exception keeps the file from its place
                raise _Empty

    def place(self, feedback: Feedback) -> str:
        """Return the file's name in the zip."""
        return f"{self.target}: {self.member(feedback)}"

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Add it to the zip."""
        del look
        about = zipfile.ZipInfo(self.member(feedback), YEAR)
        about.compress_type = zipfile.ZIP_DEFLATED
        about.external_attr = 0o644 << 16
        self._zip.writestr(about, self.content(feedback))
        return str(self.target)

    @abstractmethod
    def member(self, feedback: Feedback) -> str:
        """Return the file's name in the zip. Raises NotSent."""

    def content(self, feedback: Feedback) -> bytes:
        """Return the file's bytes. Raises NotSent."""
        return feedback.page


class Moodle(Archive):
    """`Full Name_123_assignsubmission_file_/report.html`: Moodle looks for the number behind the first underscore, and
    for the kind of submission behind the second."""

    platform = "Moodle"

    def member(self, feedback: Feedback) -> str:
        """Return the folder as the download has it, and the page's name."""
        who, number = self._who(feedback)
        return f"{_NO_NAME.sub(' ', who).strip() or 'Participant'}_{number}_assignsubmission_file_/{PAGE}"

    def _who(self, feedback: Feedback) -> tuple[str, str]:
        entry = feedback.entry
        named = platform_name(entry.where)
        if named and named.platform == self.platform:
            return named.name, named.id
        known = kinds(entry.extra, "moodle")
        for column in (column for column, kind in known.items() if kind == "platform"):
            # Moodle's own column says `Participant 123`
            if found := re.search(r"\d+$", entry.extra[column].strip()):
                return entry.name or entry.id, found.group()
        raise NotSent(
            "Moodle's number for this submission is not known",
            hint="grade Moodle's download of all submissions, or give the roster a column `Moodle id`",
        )


class CanvasFiles(Archive):
    """`lovelaceada_12345_67890_lab1.zip`: Canvas looks for the numbers of the student and of the submitted file."""

    platform = "Canvas"

    def member(self, feedback: Feedback) -> str:
        """Return the name of the submitted file, as the download has it."""
        where = feedback.entry.where
        named = platform_name(where)
        if named is None or named.platform != self.platform:
            raise NotSent(
                "the name of the file that was submitted to Canvas is not known",
                hint="grade Canvas' download of all submissions",
            )
        return where

    def content(self, feedback: Feedback) -> bytes:
        """Return an archive of the kind that was submitted: its name says of which kind it is."""
        name = self.member(feedback)
        reports = {PAGE: feedback.page, TEXT: feedback.text.encode()}
        if name.lower().endswith(".zip"):
            return _zip(reports)
        if found := _TAR.search(name):
            return _tar(reports, (found["ending"] or found["short"] or "").lower())
        raise NotSent(
            f"no report can be named like this file: {Path(name).suffix or name}",
            hint="attach the report by hand: grader feedback --form folder writes it",
        )


def _zip(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in files.items():
            made.writestr(zipfile.ZipInfo(name, YEAR), content, zipfile.ZIP_DEFLATED)
    return data.getvalue()


def _tar(files: dict[str, bytes], compressed: str) -> bytes:
    data, mode = io.BytesIO(), _MODES[compressed]
    with tarfile.open(None, mode, data) as made:
        for name, content in files.items():
            about = tarfile.TarInfo(name)
            about.size = len(content)
            made.addfile(about, io.BytesIO(content))
    return data.getvalue()


def _free(folder: Path, stem: str) -> Path:
    names = (folder / f"{stem}{f'-{number}' if number > 1 else ''}.zip" for number in range(1, 10_000))
    return next(name for name in names if not name.exists())


class FeedbackFolder(Sender):
    """Writes into `--out`, by default `feedback/` in the class's folder."""

    def place(self, feedback: Feedback) -> str:
        """Return the student's folder."""
        return str((self.settings.out or self.settings.folder / "feedback") / feedback.name)

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Write both files. Raises OutputError, which ends the run."""
        del look
        folder = Path(self.place(feedback))
        atomic_write(folder / TEXT, feedback.text.encode())
        atomic_write(folder / PAGE, feedback.page)
        return str(folder)
