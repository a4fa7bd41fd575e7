"""Copies of correct packages."""

from __future__ import annotations

import shutil
from pathlib import Path

from grader.rubric.load import LoadedRubric, load_rubric

ROOT = Path(__file__).resolve().parents[3]
LEEDS = "leeds-comp3631-lab1"


def copy_of(lab: str, folder: Path) -> Path:
    """The lab's correct package, below `folder`."""
    (solution,) = (path for path in (ROOT / "reference_solutions" / lab).iterdir() if path.is_dir())
    package = folder / solution.name
    shutil.copytree(solution, package, ignore=shutil.ignore_patterns("__pycache__"))
    return package


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
