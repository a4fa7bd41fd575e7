"""What of a package is read, and what is left out of it: giants, what may not be read, what is no file."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.errors import SubmissionError
from grader.intake.limits import NO_CODE, Limits, too_much
from grader.intake.names import brief, listing
from grader.intake.tree import Entry, list_entries

# What a build or an editor leaves in a package; it is copied nowhere, so it counts for nothing.
_MADE = frozenset({"build", "devel", "install", ".catkin_tools"})


@dataclass(frozen=True, kw_only=True)
class Content:
    """`entries` is everything but folders, `left_out` the paths of those that nobody opens, `hints` say why."""

    entries: list[Entry]
    left_out: frozenset[str]
    hints: tuple[str, ...]


def package_content(
    folder: Path, *, limits: Limits, leave_out: Path | None = None, tolerant: bool = False
) -> Content:
    """The content of a package's folder.

    Raises OSError and SubmissionError as `walk` does, SubmissionError for more files than a package has, and for a
    file that may not be read and could be one that matters; `tolerant` leaves that one out.
    """
    entries = list_entries(folder, leave_out=leave_out, tolerant=tolerant, max_folders=limits.package_files)
    files = [e for e in entries if e.kind == "file"]
    own = [e for e in files if e.path.partition("/")[0] not in _MADE]
    if len(own) > limits.package_files:
        raise too_much(brief(folder.name), f"holds more than {limits.package_files} files")
    closed = [e.path for e in files if not os.access(folder / e.path, os.R_OK, effective_ids=True)]
    if not tolerant:
        _refuse_closed(closed)
    large = _too_large(own, limits)
    others = [e.path for e in entries if e.kind == "other"]
    giants = (e.path for e in files if e.size_bytes > limits.file_bytes)
    left_out = frozenset((*closed, *large, *others, *giants))
    return Content(entries=entries, left_out=left_out, hints=tuple(_hints(closed, large, others)))


def _refuse_closed(paths: Iterable[str]) -> None:
    for path in paths:
        hidden = any(part.startswith(".") for part in path.split("/"))
        if not hidden and PurePosixPath(path).suffix.lower() not in NO_CODE:
            raise SubmissionError(
                f"{brief(path)} cannot be read: Permission denied", hint="Check its permissions (`ls -l`)."
            )


def _too_large(files: list[Entry], limits: Limits) -> list[str]:
    """Each that is too large by itself, then the largest, until the rest is no more than a package may be."""
    total = sum(e.size_bytes for e in files)
    found = []
    for entry in sorted(files, key=lambda e: e.size_bytes, reverse=True):
        if entry.size_bytes <= limits.file_bytes and total <= limits.package_bytes:
            break
        total -= entry.size_bytes
        found.append(entry.path)
    return sorted(found)


def _hints(closed: list[str], large: list[str], others: list[str]) -> Iterable[str]:
    if large:
        yield f"too large, so left out: {listing(large)} (keep recordings and data out of the package)"
    if closed:
        yield f"not readable here, so left out: {listing(closed)} (`ls -l` shows the permissions)"
    if others:
        yield f"neither a file nor a folder, so left out: {listing(others)}"
