"""Recordings that are handed in: SOURCE itself, or files of what SOURCE holds."""

from __future__ import annotations

import hashlib
import os
import re
from fnmatch import fnmatchcase
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.digest import tree_digest
from grader.intake.git import Git
from grader.intake.gitdir import Repositories
from grader.intake.limits import Limits
from grader.intake.names import safe_name
from grader.intake.open import Opened
from grader.intake.source import Source
from grader.intake.tree import NO_CONTENT, Entry, is_there, list_entries, walk
from grader.model.submission import RecordedSubmission

_SUFFIX = re.compile(r"\.(bag|bag\.active|bag\.orig|mcap|db3)$", re.IGNORECASE)
_MAGIC = (b"#ROSBAG V", b"\x89MCAP0\r\n")


def is_recording(path: Path) -> bool:
    """Whether a file is a recording by its name or its first bytes; a damaged one is one too.

    Raises OSError where it cannot be read.
    """
    if not path.is_file():
        return False
    if _SUFFIX.search(path.name):
        return True
    with path.open("rb") as file:
        return file.read(16).startswith(_MAGIC)


def single(source: Source, path: Path) -> RecordedSubmission:
    """The submission that is one recording. Raises OSError where it cannot be read, SubmissionError for its size."""
    limit_bytes = Limits().recording_bytes
    if path.stat().st_size > limit_bytes:
        raise SubmissionError(
            f"{source.given} is larger than {limit_bytes >> 20} MiB",
            hint="Record the lab's topics only: `rosbag record /topic …`, or cut it with `rosbag filter`.",
        )
    return RecordedSubmission(
        id=safe_name(_SUFFIX.sub("", path.name)),
        source=source.given,
        root=path.parent,
        file=path,
        commit=None,
        digest=_sha256(path),
    )


def several(opened: Opened, git: Git) -> RecordedSubmission:
    """The submission whose recordings lie somewhere in what was opened, with or without a package."""
    entries = list_entries(opened.root, leave_out=opened.leave_out, tolerant=True)
    left_out = {e.path for e in entries if e.size_bytes > Limits().recording_bytes or not _is_open(opened, e)}
    commit = opened.commit
    if opened.in_place and is_there(opened.root / ".git"):
        commit = Repositories(git, opened.leave_out, root=opened.root).head(opened.root)
    return RecordedSubmission(
        id=safe_name(opened.name),
        source=opened.source.given,
        root=opened.root,
        file=None,
        commit=commit,
        digest=tree_digest(opened.root, entries, {}, left_out),
    )


def _is_open(opened: Opened, entry: Entry) -> bool:
    return entry.kind != "file" or os.access(opened.root / entry.path, os.R_OK, effective_ids=True)


def find_recordings(root: Path, pattern: str) -> list[Path]:
    """The files below `root` that fit a pattern, nearest first; each content once, links left out.

    A pattern without a slash is for a file's name in any folder; capitals make no difference.
    """
    wanted = pattern.casefold().removeprefix("./")
    found: list[Path] = []
    for folder in walk(root, tolerant=True):
        folder.folders[:] = [n for n in folder.folders if n not in NO_CONTENT and not n.startswith(".")]
        names = [entry.name for entry in folder.others if entry.is_file(follow_symlinks=False)]
        found += [root / path for path in map(folder.inside, names) if _fits(path, wanted)]
    if len(found) < 2 or any(path.stat().st_size > Limits().recording_bytes for path in found):
        return found
    return list({_sha256(path): path for path in reversed(found)}.values())[::-1]


def _fits(path: str, wanted: str) -> bool:
    name = path.rpartition("/")[2]
    if name.startswith("."):
        return False
    return fnmatchcase(path.casefold() if "/" in wanted else name.casefold(), wanted)


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
