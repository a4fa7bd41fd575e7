"""`grader export gradescope LAB`: an autograder as a zip that Gradescope takes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from grader.cli.output import say
from grader.errors import ExitCode
from grader.files import atomic_write
from grader.integrations.gradescope import autograder
from grader.integrations.bundle import Settings
from grader.rubric.load import load_rubric

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode

STDOUT = "-"


def run(
    *,
    lab: str,
    out: Path | None = None,
    minutes: int = 10,
    sandbox: Mode = "auto",
    assume_executable: bool = False,
) -> ExitCode:
    """Write the zip to `out`, or into it where it is a folder, or to stdout where it is `-`.

    Raises UsageError where the grader is not installed, RubricError for a faulty rubric.
    """
    rubric = load_rubric(lab)
    settings = Settings(
        rubric="", minutes=minutes, sandbox=sandbox, modes="granted" if assume_executable else "lost"
    )
    data = autograder(rubric, settings)
    if str(out) == STDOUT:
        sys.stdout.buffer.write(data)
        return ExitCode.PASSED
    name = f"{rubric.rubric.id}-gradescope.zip"
    target = out / name if out is not None and out.is_dir() else out or Path(name)
    atomic_write(target, data, public=True)
    say(f"{target}: upload it under Configure Autograder, with Ubuntu 22.04 as the base image")
    return ExitCode.PASSED
