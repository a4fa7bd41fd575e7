"""`grader export gradescope LAB`: an autograder as a zip that Gradescope takes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from grader.cli.say import say
from grader.deliver.gradescope import autograder
from grader.deliver.settings import Settings
from grader.errors import ExitCode
from grader.files import atomic_write
from grader.rubric.load import load_rubric

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode


def run(
    *,
    lab: str,
    out: Path | None = None,
    minutes: int = 10,
    sandbox: Mode = "auto",
    assume_executable: bool = False,
) -> ExitCode:
    """Write the zip to `out`. Raises UsageError where the grader is not installed, RubricError for a faulty rubric."""
    rubric = load_rubric(lab)
    settings = Settings(
        rubric="", minutes=minutes, sandbox=sandbox, modes="granted" if assume_executable else "lost"
    )
    target = out or Path(f"{rubric.rubric.id}-gradescope.zip")
    atomic_write(target, autograder(rubric, settings))
    say(f"{target}: upload it under Configure Autograder, with Ubuntu 22.04 as the base image")
    return ExitCode.PASSED
