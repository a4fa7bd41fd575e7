"""Where a rubric came from: what it is worth that it judged.

Students can change what lies in their repositories. A rubric from there is what a student wants it to be.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from grader.model.result import RubricOrigin
from grader.rubric.load import LoadedRubric


def origin_of(rubric: LoadedRubric, students: Iterable[Path | None]) -> RubricOrigin:
    """Return where the rubric came from; `students` are the folders that the student can change, if they are known.

    A checkout of another repository in one of them is not the student's; a submodule is, since the student names it.
    """
    if rubric.origin != "elsewhere":
        return rubric.origin
    # A link of the student's chooses a file, too.
    files = {rubric.path.parent.resolve() / rubric.path.name, rubric.path.resolve()}
    roots = [folder.resolve() for folder in students if folder is not None]
    return "submission" if any(_holds(root, file) for root in roots for file in files) else "elsewhere"


def checkout_around(path: Path) -> Path | None:
    """Return the top of the git checkout around a path; None where there is none. A submodule, whose `.git` is a file,
    belongs to the one around it."""
    absolute = path.resolve()
    return next((folder for folder in (absolute, *absolute.parents) if (folder / ".git").is_dir()), None)


def _holds(root: Path, file: Path) -> bool:
    checkout = checkout_around(file.parent)
    return file.is_relative_to(root) and (checkout is None or root.is_relative_to(checkout))
