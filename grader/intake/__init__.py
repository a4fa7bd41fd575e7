"""A folder, an archive or a git URL becomes a folder on disk with the lab's package in it; nothing is run."""

from __future__ import annotations

import errno
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from grader.errors import GraderError, OutputError, SubmissionError
from grader.intake.find import enclosing_package, find_packages
from grader.intake.git import Git
from grader.intake.limits import Limits
from grader.intake.names import brief, printable, safe_name
from grader.intake.open import describe, locate, open_source
from grader.intake.passwords import without_password
from grader.intake.recordings import find_recordings, is_recording, several, single
from grader.intake.source import Source, parse_source
from grader.model.submission import RecordedSubmission, Submission

__all__ = [
    "Limits",
    "Source",
    "enclosing_package",
    "find_packages",
    "find_recordings",
    "open_recorded",
    "open_recording",
    "open_submission",
    "parse_source",
    "safe_name",
    "unreadable",
    "without_password",
]


def open_submission(
    source: str | Source,
    *,
    package: str,
    workdir: Path,
    submission_id: str | None = None,
    git_timeout_s: float = 120.0,
    limits: Limits | None = None,
) -> Submission:
    """The submission that `source` names, with the lab's `package` found in it; it may be read already.

    A folder is used in place and never written to. An archive or a repository comes to lie in a new folder
    below `workdir`, which is made where it is missing and belongs to the caller. All of git's work together
    takes at most `git_timeout_s` seconds.

    Raises UsageError for a source that does not exist, OutputError for a `workdir` that cannot be written,
    PackageNotFound where the package is not there, SubmissionError for all else that is wrong with it.
    """
    parsed = _parsed(source)
    with _base(workdir) as base:
        try:
            git = Git(base / "git-home", timeout_s=git_timeout_s)
            limits = limits or Limits()
            opened = open_source(parsed, git, base, limits)
            located = locate(opened, package)
            submission = describe(located, git, limits)
        except OSError as error:
            raise unreadable(parsed.given, error) from error
    if submission_id is None:
        return submission
    return submission.model_copy(update={"id": safe_name(submission_id)})


def open_recording(source: str | Source, *, submission_id: str | None = None) -> RecordedSubmission | None:
    """The submission where `source` is itself a recording (a bag or an MCAP file), None where it is anything else.

    Raises what `open_submission` raises.
    """
    parsed = _parsed(source)
    try:
        if parsed.kind != "archive" or parsed.path is None or not is_recording(parsed.path):
            return None
        submission = single(parsed, parsed.path)
    except OSError as error:
        raise unreadable(parsed.given, error) from error
    return (
        submission
        if submission_id is None
        else submission.model_copy(update={"id": safe_name(submission_id)})
    )


def open_recorded(
    source: str | Source, *, workdir: Path, submission_id: str | None = None, git_timeout_s: float = 120.0
) -> RecordedSubmission:
    """The submission of a lab that asks for recordings alone: as `open_submission`, and no package is looked for."""
    parsed = _parsed(source)
    with _base(workdir) as base:
        try:
            git = Git(base / "git-home", timeout_s=git_timeout_s)
            submission = several(open_source(parsed, git, base, Limits()), git)
        except OSError as error:
            raise unreadable(parsed.given, error) from error
    return (
        submission
        if submission_id is None
        else submission.model_copy(update={"id": safe_name(submission_id)})
    )


def _parsed(source: str | Source) -> Source:
    if isinstance(source, Source):
        return source
    try:
        return parse_source(source)
    except OSError as error:
        raise unreadable(printable(source), error) from error


def unreadable(given: str, error: OSError) -> GraderError:
    """The error for a source that this machine could not read, or had no room for."""
    if error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)):
        return OutputError(f"{given}: the disk is full", hint="Free some room (`df -h`) and try again.")
    where = f" at {brief(str(error.filename))}" if error.filename else ""
    return SubmissionError(
        f"{given} cannot be read: {error.strerror or brief(str(error))}{where}",
        hint="Check its permissions (`ls -l`).",
    )


@contextmanager
def _base(workdir: Path) -> Iterator[Path]:
    """A new folder below `workdir`. If opening fails nothing of it stays."""
    try:
        workdir.mkdir(parents=True, exist_ok=True)
        base = Path(tempfile.mkdtemp(prefix="source-", dir=workdir)).resolve()
    except OSError as error:
        raise OutputError(
            f"the work folder {workdir} cannot be written: {error.strerror}", hint="Choose another folder."
        ) from error
    try:
        yield base
    except BaseException:
        shutil.rmtree(base, ignore_errors=True)
        raise
    if not (base / "tree").exists():
        shutil.rmtree(base, ignore_errors=True)
