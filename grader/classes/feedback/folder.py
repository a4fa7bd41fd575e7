"""A folder for each student, with the report as Markdown and as a page."""

from __future__ import annotations

from grader.classes.feedback.forms import PAGE, TEXT, Feedback, Sender
from grader.files import atomic_write


class Folder(Sender):
    """Writes into `--out`, by default `feedback/` in the class's folder."""

    def place(self, feedback: Feedback) -> str:
        """Return the student's folder."""
        return str((self.settings.out or self.settings.folder / "feedback") / feedback.name)

    def send(self, feedback: Feedback, *, look: bool = False) -> str:
        """Write both files. Raises OutputError, which ends the run."""
        del look
        folder = (self.settings.out or self.settings.folder / "feedback") / feedback.name
        atomic_write(folder / TEXT, feedback.text.encode())
        atomic_write(folder / PAGE, feedback.page)
        return str(folder)
