"""What graders of every time wrote: `fixtures/formats/<time>/<submission>/`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "fixtures" / "formats"


@dataclass(frozen=True)
class Old:
    """One submission's folder, and what the grader of then said of it."""

    folder: Path
    said: dict[str, Any]

    @property
    def name(self) -> str:
        return self.folder.relative_to(FOLDER).as_posix()

    @property
    def rubric(self) -> str:
        """As `--rubric` takes it; one that is not the grader's own lies beside the class, or in this repository."""
        given = str(self.said["rubric"])
        if not given.endswith(".yaml"):
            return given
        beside = FOLDER / self.name.split("/", maxsplit=1)[0] / given
        return str(beside if beside.is_file() else ROOT / given)

    @property
    def judged(self) -> bool:
        """Whether anything was recorded."""
        return (self.folder / "evidence").is_dir()

    @property
    def criteria(self) -> dict[str, tuple[str, float]]:
        """Statuses and points as they are today: those of then, and what has become fairer since."""
        changed = self.said.get("changed", {})
        then = {
            name: (str(status), float(points)) for name, (status, points) in self.said["criteria"].items()
        }
        return then | {name: (one["is"][0], float(one["is"][1])) for name, one in changed.items()}


def times() -> list[Path]:
    return sorted(path for path in FOLDER.iterdir() if path.is_dir())


def submissions() -> list[Old]:
    return [Old(time / name, said) for time in times() for name, said in _expected(time)]


def classes() -> list[Path]:
    return [time / "class" for time in times() if (time / "class").is_dir()]


def _expected(time: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    yield from yaml.safe_load((time / "expected.yaml").read_text()).items()
