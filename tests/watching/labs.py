"""Copies of correct packages, and pictures of them before and after a change."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from grader.rubric.load import LoadedRubric, load_rubric
from grader.student.watching.affected import concerned
from grader.student.watching.snapshot import Picture, take_picture

ROOT = Path(__file__).resolve().parents[2]
LABS = (
    "eyantra-ros-basics",
    "leeds-comp3631-lab1",
    "mcr2-basic-comms",
    "sheffield-com2009-week1",
    "york-ele00118m-lab7",
)


def copy_of(lab: str, folder: Path) -> Path:
    """The lab's correct package, below `folder`."""
    (solution,) = (path for path in (ROOT / "reference_solutions" / lab).iterdir() if path.is_dir())
    package = folder / solution.name
    shutil.copytree(solution, package, ignore=shutil.ignore_patterns("__pycache__"))
    return package


def picture(package: Path, lab: str = "leeds-comp3631-lab1") -> Picture:
    """The package as it is now."""
    return take_picture(str(package), load_rubric(lab).rubric.package)


def concerned_by(lab: str, package: Path, change: Callable[[], object]) -> frozenset[str]:
    """The scenarios that are to be run again after `change`."""
    before = picture(package, lab)
    change()
    return concerned(rubric(lab).rubric, before, picture(package, lab))


def rubric(lab: str) -> LoadedRubric:
    """The lab's own."""
    return load_rubric(lab)


def write(path: Path, text: str) -> Path:
    """A file with this text, and its folders."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def append(path: Path, text: str = "\n# changed\n") -> Path:
    """The file with more at its end."""
    return write(path, path.read_text(encoding="utf-8") + text)
