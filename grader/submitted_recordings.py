"""Copy recordings that students submit (bags, MCAP files of other tools) into the evidence, unchanged."""

from __future__ import annotations

import shutil
import time
from collections.abc import Mapping
from pathlib import Path

from grader.errors import EvidenceError, SubmissionError
from grader.evidence.events import RECORDING_MISSING, RECORDING_PROBLEM, ScenarioEvent
from grader.evidence.reader import SUFFIXES, load_evidence
from grader.evidence.run import LESS
from grader.evidence.writer import EvidenceWriter
from grader.files import writing
from grader.intake.limits import IntakeLimits
from grader.intake.names import safe_name
from grader.intake.open import find_recordings
from grader.model.result import Progress
from grader.model.submission import RecordedSubmission, Submission
from grader.rubric.model import Rubric

NAMES_SHOWN = 4


def copy_recordings(
    rubric: Rubric, submission: Submission | RecordedSubmission, folder: Path, progress: Progress
) -> None:
    """Copy the recording that is the whole submission into the folder, under its own name; else the recording of each
    scenario that names one, or write an evidence file that says why there is none.

    Raises SubmissionError if the whole submission cannot be read, or is the grader's own evidence.
    """
    if isinstance(submission, RecordedSubmission) and submission.file is not None:
        path = submission.file
        try:
            _copy(path, folder / (safe_name(path.stem) + _suffix(path)))
        except EvidenceError as error:
            raise SubmissionError(error.message, hint=error.hint) from error
        return
    for name, scenario in rubric.scenarios.items():
        if scenario.recording is None:
            continue
        progress.step(name, "running", f"looking for {scenario.recording}")
        found = find_recordings(submission.root, scenario.recording)
        reason = _copy_recording(found, scenario.recording, submission.root, folder / name)
        if reason:
            _write_reason(folder / f"{name}.mcap", name, reason, submission)
        progress.step(
            name, "failed" if reason else "done", next(iter(reason.values()), found[0].name if found else "")
        )


def _copy_recording(found: list[Path], pattern: str, root: Path, target: Path) -> dict[str, str]:
    """Return why a scenario has no recording; empty if it was copied to `target`, with its own suffix."""
    if not found:
        return {RECORDING_MISSING: pattern}
    if len(found) > 1:
        names = ", ".join(path.relative_to(root).as_posix() for path in found[:NAMES_SHOWN])
        return {RECORDING_PROBLEM: f"{len(found)} recordings fit {pattern}: {names}"}
    try:
        _copy(found[0], target.with_name(target.name + _suffix(found[0])))
    except (EvidenceError, SubmissionError) as error:
        # our temporary folder says nothing to a student
        return {RECORDING_PROBLEM: error.message.replace(f"{root}/", "")}
    return {}


def _check(path: Path) -> None:
    """Raise EvidenceError or SubmissionError if this is not a recording of another tool."""
    (run,) = load_evidence([path]).values()
    if not run.foreign:
        raise SubmissionError(
            f"{path}: the grader's own evidence, not a recording", hint="`grader judge` judges it again"
        )


def _suffix(path: Path) -> str:
    """Return `.bag`, `.mcap` or `.db3`, by which evidence is found."""
    suffix = path.suffix.casefold()
    if suffix in SUFFIXES:
        return suffix
    # by how the formats begin; what got this far and is neither of these is a bag
    with path.open("rb") as file:
        return {b"\x89MCAP": ".mcap", b"SQLit": ".db3"}.get(file.read(5), ".bag")


def _copy(path: Path, target: Path) -> None:
    """Copy the file, and check the copy: so what is judged is what was checked."""
    limit_bytes = IntakeLimits().recording_bytes
    if path.stat().st_size > limit_bytes:
        raise EvidenceError(f"{path}: larger than {limit_bytes >> 20} MiB", hint=LESS)
    with writing(target):
        shutil.copyfile(path, target)
    try:
        _check(target)
    except (EvidenceError, SubmissionError) as error:
        target.unlink()
        raise type(error)(error.message.replace(str(target), str(path)), hint=error.hint) from error


def _write_reason(
    path: Path, scenario: str, reason: Mapping[str, str], submission: Submission | RecordedSubmission
) -> None:
    about = {"submission.id": submission.id, "submission.digest": submission.digest, **reason}
    with EvidenceWriter(path, scenario=scenario, clock="real", warp=1.0, metadata=about) as writer:
        writer.event("/grader/scenario", time.time_ns(), ScenarioEvent(event="end", outcome="silent"))
