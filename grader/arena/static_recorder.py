"""A recording of which nothing is run: the package's files alone are evidence. It needs no ROS, and no Linux."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from typing_extensions import Self

from grader.arena.limits import Limits
from grader.arena.recorded import NO_ROS, PACKAGE, STILL_HOLDS, Recording, attachments, metadata
from grader.arena.ros_env import find_ros
from grader.evidence.writer import EvidenceWriter
from grader.model.package import PackageFacts
from grader.model.progress import Progress
from grader.model.submission import Submission
from grader.portable import system
from grader.rubric.model import Rubric


def why_unrun() -> str:
    """Why no node can be run here, "" where one can. Raises RosMissing where ROS is not where it should be."""
    if system():
        return f"ROS 1's nodes run on Linux, and this is {system()}"
    return "" if find_ros() is not None else NO_ROS


class Unrun:
    """As `arena.recording.Recorder`, where nothing is to be run or can be; `reason` says why."""

    def __init__(
        self,
        submission: Submission,
        facts: PackageFacts,
        rubric: Rubric,
        folder: Path,
        *,
        reason: str,
        progress: Progress,
        recorded: Mapping[str, Path] | None = None,
    ) -> None:
        self.recording = Recording(folder=folder, facts=facts)
        self._submission, self._rubric, self._progress = submission, rubric, progress
        self._reason, self._recorded = reason, recorded or {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing was begun."""

    def record_all(self, _meanwhile: Callable[[], None]) -> None:
        """The package's files, and what was recorded before. There is no build to wait for meanwhile."""
        for name, path in self._recorded.items():
            shutil.copyfile(path, self.recording.folder / f"{name}.mcap")
            self._progress.step(name, "skipped", STILL_HOLDS)
        self._write_package()
        for name in self._rubric.scenarios:
            if name not in self._recorded:
                self._progress.step(name, "skipped", self._reason)

    def record_again(self, scenarios: Iterable[str]) -> None:
        """None of them."""

    def _write_package(self) -> None:
        recording = self.recording
        path = recording.folder / f"{PACKAGE}.mcap"
        limits = Limits().shared_by(len(self._rubric.scenarios))
        about = {**metadata(self._submission, recording, limits), "not_run": self._reason}
        with EvidenceWriter(path, scenario=PACKAGE, clock="real", warp=1.0, metadata=about) as writer:
            now_ns = time.time_ns()
            writer.package(recording.facts, now_ns)
            for name, data in attachments(self._submission.package.folder, recording.facts):
                writer.attach(name, data, now_ns, "text/plain")
        recording.files.append(path)
