"""What an earlier grader wrote: `fixtures/formats/<submission>/`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "fixtures" / "formats"
CLASS = FOLDER / "class"


@dataclass(frozen=True)
class Kept:
    """One submission's folder, and what that grader said of it."""

    name: str
    said: dict[str, Any]

    @property
    def folder(self) -> Path:
        return FOLDER / self.name

    @property
    def rubric(self) -> str:
        """As `--rubric` takes it; one that is not the grader's own is beside the class, or in this repository."""
        given = str(self.said["rubric"])
        if not given.endswith(".yaml"):
            return given
        beside = FOLDER / given
        return str(beside if beside.is_file() else ROOT / given)

    @property
    def judged(self) -> bool:
        """Whether anything was recorded."""
        return (self.folder / "evidence").is_dir()

    @property
    def criteria(self) -> dict[str, tuple[str, float]]:
        """Each criterion's status and points."""
        return {
            name: (str(status), float(points)) for name, (status, points) in self.said["criteria"].items()
        }


def submissions() -> list[Kept]:
    expected = yaml.safe_load((FOLDER / "expected.yaml").read_text())
    return [Kept(name, said) for name, said in expected.items()]
