"""What an exported grader is told: `grader.json` beside the rubric's folder, written by the export."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from grader.errors import InternalError
from grader.model.record import Record
from grader.model.submission import SandboxMode

FILE = "grader.json"
Modes = Literal["lost", "granted"]


class Settings(Record):
    """`rubric` is the rubric's path from the folder of the settings; `minutes` is the platform's time limit for all.

    `modes` says what a script counts as whose executable bit the upload has lost.
    """

    rubric: str
    minutes: int
    sandbox: SandboxMode = "auto"
    modes: Modes = "lost"

    @property
    def grading_s(self) -> int:
        """How long grading may take, so that there is time left to say that it took too long."""
        return self.minutes * 60 - 30

    def to_json(self) -> bytes:
        """Its file."""
        return f"{self.model_dump_json(indent=2)}\n".encode()


def read_settings(folder: Path) -> Settings:
    """Those in `folder`. Raises InternalError: the export wrote them, no student."""
    try:
        return Settings.model_validate_json((folder / FILE).read_bytes())
    except (OSError, ValidationError) as error:
        raise InternalError(
            f"{folder / FILE} cannot be read: {type(error).__name__}", hint="export the grader again"
        ) from error
