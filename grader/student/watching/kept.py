"""Evidence of earlier runs, each with the picture of the package that it was recorded of."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Mapping
from pathlib import Path

from grader.model.result import GradingResult
from grader.rubric.model import Rubric
from grader.student.watching.affected import stale
from grader.student.watching.snapshot import Picture


class Kept:
    """Holds copies in `folder`, the newest of each scenario; only scenarios in which something is started have any."""

    def __init__(self, folder: Path, rubric: Rubric) -> None:
        self._folder = folder
        self._rubric = rubric
        self._scenarios = tuple(name for name, s in rubric.scenarios.items() if s.recording is None)
        self._pictures: dict[str, Picture] = {}

    def fitting(self, picture: Picture | None) -> dict[str, Path]:
        """Evidence by scenario that holds for this package too."""
        if picture is None:
            return {}
        return {
            name: self._path(name)
            for name, before in self._pictures.items()
            if not stale(self._rubric, name, before, picture)
        }

    def others(self, known: Collection[str]) -> tuple[str, ...]:
        """The scenarios that are to be run where evidence of these is there."""
        return tuple(name for name in self._scenarios if name not in known)

    def keep(
        self, evidence: Path, picture: Picture | None, used: Mapping[str, Path], result: GradingResult
    ) -> None:
        """Take over what was recorded of the package in the picture; not what could not be judged."""
        doubtful = {c.scenario for c in result.criteria if c.status.is_retryable}
        for name in self._scenarios:
            recorded = evidence / f"{name}.mcap"
            if picture is None or name in doubtful or not recorded.is_file():
                self._pictures.pop(name, None)
            elif name not in used:
                shutil.copyfile(recorded, self._path(name))
                self._pictures[name] = picture

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.mcap"
