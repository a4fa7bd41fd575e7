"""The recorder that runs nothing: it needs no ROS, and no Linux.

A submission and its facts come in; `package.mcap` goes out, with the facts, the files as attachments and the reason why
nothing was run. `StaticRecorder` is the entry, used as `arena.recorder.Recorder` is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from typing_extensions import Self

from grader.arena.limits import RunLimits
from grader.arena.recording_files import Recording, copy_recorded, metadata, write_files
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.writer import EvidenceWriter
from grader.model.package import PackageFacts
from grader.model.result import Progress
from grader.model.submission import Submission
from grader.rubric.model import Rubric

STATIC_ONLY = "nothing was run: only the files were asked for"


class StaticRecorder:
    """As `arena.recorder.Recorder`, where nothing is to be run or can be; `reason` says why."""

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

    def record_all(self, _import_later: Callable[[], None]) -> None:
        """Record the package's files, and copy what was recorded before. There is no build to wait for."""
        copy_recorded(self._recorded, self.recording.folder, self._progress)
        self._write_package()
        for name in self._rubric.scenarios:
            if name not in self._recorded:
                self._progress.step(name, "skipped", self._reason)

    def record_again(self, scenarios: Iterable[str]) -> None:
        """Do nothing: there are no runs."""

    def repeat(self, scenarios: Iterable[str], folder: Path) -> None:
        """Do nothing: there are no runs."""

    def _write_package(self) -> None:
        recording = self.recording
        path = recording.folder / f"{PACKAGE_RUN}.mcap"
        limits = RunLimits().shared_by(len(self._rubric.scenarios))
        about = {**metadata(self._submission, recording, limits), "not_run": self._reason}
        with EvidenceWriter(path, scenario=PACKAGE_RUN, clock="real", warp=1.0, metadata=about) as writer:
            write_files(writer, self._submission, recording.facts)
        recording.files.append(path)
