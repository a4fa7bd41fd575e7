"""What every recording of a submission has: its facts and files, where they come from, and what it cost.

`arena.recorder.Recorder` and `arena.static_recorder.StaticRecorder` fill a `Recording`; `metadata`, `write_files` and
`left_out_events` are what both of them write into the evidence.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from grader import __version__
from grader.arena.limits import RunLimits
from grader.evidence.events import ActorEvent
from grader.evidence.writer import EvidenceWriter
from grader.files import read_untrusted
from grader.model.package import PackageFacts, SourceFile
from grader.model.record import Record
from grader.model.result import Progress
from grader.model.submission import Submission
from grader.ros_env import RosInstallation

if TYPE_CHECKING:
    from grader.arena.sandbox import Sandbox


RETRIES = 2
"""So often a run is recorded again that could not be judged."""
ATTACHED_BYTES_MAX = 256 << 10
ATTACHED_FILES_MAX = 60
ATTACHED_SUFFIXES = (
    ".py", ".xml", ".txt", ".launch", ".yaml", ".yml", ".cfg", ".sh", ".cpp", ".h", ".msg", ".srv",
    ".action", ".c", ".cc", ".hpp", ".md", ".rst",
)  # fmt: skip
LAST_SUFFIXES = (".md", ".rst")
"""Where there are too many files, no code is left out for these."""
STILL_HOLDS = "unchanged: what was recorded before still holds"


class RunCost(Record):
    """CPU seconds: the grader's own share of a run, or of a build, and that of the student's processes."""

    cpu_s: float
    student_cpu_s: float


@dataclass(kw_only=True)
class Recording:
    """What was recorded, where, by what, and at what cost (CPU seconds)."""

    folder: Path
    facts: PackageFacts
    ros: RosInstallation | None = None
    sandbox: Sandbox | None = None
    cpu_s: float = 0.0
    student_cpu_s: float = 0.0
    files: list[Path] = field(default_factory=list)

    @property
    def labels(self) -> tuple[str, str]:
        """The ROS and the sandbox that ran the submission, "" for what there was none of."""
        return self.ros.label if self.ros else "", self.sandbox.label if self.sandbox else ""

    def add(self, cost: RunCost | Recording) -> None:
        self.cpu_s += cost.cpu_s
        self.student_cpu_s += cost.student_cpu_s


def metadata(submission: Submission, recording: Recording, limits: RunLimits) -> dict[str, str]:
    """Return what every file of evidence says of where it comes from."""
    ros, sandbox = recording.labels
    return {
        "submission.id": submission.id,
        "submission.source": submission.source,
        "submission.commit": submission.commit or "",
        "submission.digest": submission.digest,
        "submission.package": submission.package.name,
        "grader": __version__,
        "ros": ros,
        "python": recording.ros.python if recording.ros else "",
        "sandbox": sandbox,
        "limits": limits.model_dump_json(),
    }


def write_files(writer: EvidenceWriter, submission: Submission, facts: PackageFacts) -> None:
    """Write the facts of the submission's packages, and their text files, into the evidence. Those of other packages
    than the main one are named as they lie from its folder: `../lab_msgs/msg/Reading.msg`."""
    now_ns = time.time_ns()
    writer.package(facts, now_ns)
    packages = zip((submission.package, *submission.also), (facts, *facts.also), strict=True)
    for package, own in packages:
        for name, data in attachments(package.folder, own):
            writer.attach(f"{facts.way_to(own)}/{name}" if own.asked else name, data, now_ns, "text/plain")


def attachments(folder: Path, facts: PackageFacts) -> Iterable[tuple[str, bytes]]:
    """Yield the package's own text files that were judged, as far as their size allows."""
    for file in _texts(facts)[:ATTACHED_FILES_MAX]:
        data = read_untrusted(folder / file.path, ATTACHED_BYTES_MAX)
        if data is not None:
            yield file.path, data


def left_out_events(facts: PackageFacts) -> Iterable[ActorEvent]:
    """Yield an event for each file that `attachments` leaves out, as a limit that was met."""
    for other in facts.also:
        for event in left_out_events(other):
            yield event.model_copy(update={"actor": f"{other.asked}: {event.actor}"})
    texts = _texts(facts)
    for file in texts[:ATTACHED_FILES_MAX]:
        if file.size_bytes > ATTACHED_BYTES_MAX:
            detail = f"is larger than {ATTACHED_BYTES_MAX >> 10} kB: only its beginning is in the evidence"
            yield ActorEvent(action="limit", actor=file.path, detail=detail)
    if len(texts) > ATTACHED_FILES_MAX:
        detail = f"holds more than {ATTACHED_FILES_MAX} text files: only the first are in the evidence"
        yield ActorEvent(action="limit", actor="the package", detail=detail)


def _texts(facts: PackageFacts) -> list[SourceFile]:
    found = (f for f in facts.files if not f.binary and f.link is None and f.path.endswith(ATTACHED_SUFFIXES))
    # `sorted` keeps the order of equals, so all else stays as it was.
    return sorted(found, key=lambda file: file.path.endswith(LAST_SUFFIXES))


def copy_recorded(recorded: Mapping[str, Path], folder: Path, progress: Progress) -> None:
    """Copy evidence that stands for a run of its scenario into the recording's folder."""
    for name, path in recorded.items():
        shutil.copyfile(path, folder / f"{name}.mcap")
        progress.step(name, "skipped", STILL_HOLDS)
