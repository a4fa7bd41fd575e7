"""Walks folders of any depth and size without following a link."""

from __future__ import annotations

import os
import stat
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from grader.errors import SubmissionError
from grader.intake.names import printable

# Far more than any workspace; much deeper, and Python's own functions for trees fail.
MAX_DEPTH = 200
# Part of no submission: git's own files and what macOS adds.
NO_CONTENT = frozenset({".git", ".DS_Store", "__MACOSX"})


@dataclass(frozen=True, kw_only=True)
class Folder:
    """One folder of a walk. `path` is relative to the walk's root, `.` for the root itself.

    Whoever walks may take names out of `folders`: those are then not entered.
    """

    path: str
    folders: list[str]
    others: list[os.DirEntry[str]]

    def inside(self, name: str) -> str:
        """The path of an entry of this folder."""
        return name if self.path == "." else f"{self.path}/{name}"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Whatever is no folder: `executable` is the owner's bit on this disk."""

    path: str
    kind: Literal["file", "link", "other"]
    executable: bool


def walk(root: Path, *, tolerant: bool = False) -> Iterator[Folder]:
    """Every folder from `root` on, nearest first, in order of names; links are entries, never ways.

    Raises OSError for a folder that cannot be read and SubmissionError for more than MAX_DEPTH folders in each
    other; `tolerant` passes over those below the root.
    """
    waiting = deque(["."])
    while waiting:
        path = waiting.popleft()
        try:
            with os.scandir(root / path) as scan:
                entries = sorted(scan, key=lambda entry: entry.name)
        except OSError:
            if tolerant and path != ".":
                continue
            raise
        names = [entry.name for entry in entries if entry.is_dir(follow_symlinks=False)]
        others = [entry for entry in entries if not entry.is_dir(follow_symlinks=False)]
        folder = Folder(path=path, folders=names, others=others)
        yield folder
        below = [folder.inside(name) for name in folder.folders]
        if below and below[0].count("/") >= MAX_DEPTH:
            if tolerant:
                continue
            raise too_deep(root.name)
        waiting.extend(below)


def too_deep(name: str) -> SubmissionError:
    """The error for a tree that no student's work looks like."""
    return SubmissionError(
        f"{printable(name)} holds more than {MAX_DEPTH} folders in each other",
        hint="Hand in the package alone.",
    )


def list_entries(root: Path, *, leave_out: Path | None = None, tolerant: bool = False) -> list[Entry]:
    """Everything below `root` but folders, sorted by path; `leave_out` is a folder not to enter."""
    found = []
    for folder in walk(root, tolerant=tolerant):
        folder.folders[:] = [
            name
            for name in folder.folders
            if name not in NO_CONTENT and root / folder.inside(name) != leave_out
        ]
        found += [_entry(folder, other) for other in folder.others if other.name not in NO_CONTENT]
    return sorted(found, key=lambda entry: os.fsencode(entry.path))


def is_file(path: Path) -> bool:
    """Whether there is a file; where that may not even be asked, there is none."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def is_there(path: Path) -> bool:
    """Whether there is anything of that name; where that may not even be asked, there is nothing."""
    try:
        path.lstat()
    except (OSError, ValueError):
        return False
    return True


def _entry(folder: Folder, entry: os.DirEntry[str]) -> Entry:
    mode = entry.stat(follow_symlinks=False).st_mode
    kind: Literal["file", "link", "other"] = "other"
    if stat.S_ISREG(mode):
        kind = "file"
    elif stat.S_ISLNK(mode):
        kind = "link"
    return Entry(path=folder.inside(entry.name), kind=kind, executable=bool(mode & stat.S_IXUSR))
