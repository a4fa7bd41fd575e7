"""`grader export prairielearn LAB`: a question with an external grader, and the files of its image."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from grader.cli.output import say
from grader.errors import ExitCode, UsageError
from grader.files import atomic_write
from grader.integrations.prairielearn import IMAGE, question
from grader.integrations.bundle import FILE, Settings
from grader.rubric.load import load_rubric

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode


def run(
    *,
    lab: str,
    out: Path | None = None,
    image: str = IMAGE,
    minutes: int = 10,
    sandbox: Mode = "auto",
    assume_executable: bool = False,
) -> ExitCode:
    """Write the folder, or the zip where `out` ends so. Raises UsageError for a folder that holds something else."""
    rubric = load_rubric(lab)
    settings = Settings(
        rubric="", minutes=minutes, sandbox=sandbox, modes="granted" if assume_executable else "lost"
    )
    target = out or Path(f"{rubric.rubric.id}-prairielearn")
    parcel = question(rubric, settings, image)
    if target.suffix.lower() == ".zip":
        atomic_write(target, parcel.zipped(), public=True)
    else:
        _check_free(target)
        parcel.write(target)
    say(f"{target}: question/ goes among your course's questions; image/ is what {image} is built from")
    return ExitCode.PASSED


def _check_free(folder: Path) -> None:
    """An earlier export may be written over."""
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is no folder", hint="give --out a folder, or a name that ends with .zip")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "question" / "tests" / FILE).is_file():
        raise UsageError(f"{folder} holds other files", hint="choose a new folder with --out")
