"""Intake: what was handed in, open on this disk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grader.intake import open_recorded, open_recording, open_submission
from grader.intake.source import Source
from grader.model.progress import Progress
from grader.model.result import SubmissionInfo
from grader.model.submission import RecordedSubmission, Submission
from grader.rubric.load import LoadedRubric, needs_package
from grader.steps.options import GradeOptions
from grader.temporary import temporary_folder


@contextmanager
def opened(
    source: str | Source, rubric: LoadedRubric, options: GradeOptions, progress: Progress
) -> Iterator[Submission | RecordedSubmission]:
    """The submission, as long as the block runs. Raises SubmissionError, UsageError."""
    progress.step("intake", "running", source if isinstance(source, str) else source.given)
    with temporary_folder("source") as folder:
        recorded = open_recording(source, submission_id=options.submission_id)
        submission = recorded or _opened_tree(source, rubric, folder, options)
        progress.step("intake", "done", submission.id)
        yield submission


def _opened_tree(
    source: str | Source, rubric: LoadedRubric, workdir: Path, options: GradeOptions
) -> Submission | RecordedSubmission:
    if not needs_package(rubric):
        return open_recorded(source, workdir=workdir, submission_id=options.submission_id)
    return open_submission(
        source, package=rubric.rubric.package, workdir=workdir, submission_id=options.submission_id
    )


def about(submission: Submission | RecordedSubmission) -> SubmissionInfo:
    """Whose work it is, as the result says it."""
    return SubmissionInfo(
        id=submission.id,
        source=submission.source,
        commit=submission.commit,
        digest=submission.digest,
        package=submission.package.name if isinstance(submission, Submission) else "",
    )
