"""Walks folders of any depth and size without following a link, and gives their digest."""

from __future__ import annotations

import hashlib
import os
import stat
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Literal

from grader.errors import SubmissionError
from grader.intake.names import brief
from grader.portable import READ

# Far more than any workspace; much deeper, and Python's own functions for trees fail.
MAX_DEPTH = 60
MAX_IN_FOLDER = 150_000
MAX_IN_TREE = 1_000_000
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
        """Return the path of an entry of this folder."""
        return name if self.path == "." else f"{self.path}/{name}"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """Whatever is not a folder: `executable` is the owner's bit on this disk, `size_bytes` 0 for all but files."""

    path: str
    kind: Literal["file", "link", "other"]
    executable: bool
    size_bytes: int


def walk(root: Path, *, tolerant: bool = False) -> Iterator[Folder]:
    """Yield every folder from `root` on, nearest first, in order of names; links are entries, never ways, and folders
    of NO_CONTENT are left out.

    Raises OSError for a folder that cannot be read, hidden ones left out, and SubmissionError for more than MAX_DEPTH
    folders in each other or too much in one of them; `tolerant` passes over those below the root. Raises
    SubmissionError for more than MAX_IN_TREE entries in all.
    """
    waiting = deque(["."])
    seen = 0
    while waiting:
        path = waiting.popleft()
        try:
            entries = _scan(root, path)
        except (OSError, SubmissionError) as error:
            hidden = isinstance(error, OSError) and _is_hidden(path)
            if (tolerant or hidden) and path != ".":
                continue
            raise
        seen += len(entries)
        if seen > MAX_IN_TREE:
            raise _too_many(root.name, MAX_IN_TREE)
        folders = [entry for entry in entries if entry.is_dir(follow_symlinks=False)]
        others = [entry for entry in entries if not entry.is_dir(follow_symlinks=False)]
        names = [entry.name for entry in folders if entry.name not in NO_CONTENT]
        folder = Folder(path=path, folders=names, others=others)
        yield folder
        below = [folder.inside(name) for name in folder.folders]
        if below and below[0].count("/") >= MAX_DEPTH:
            if tolerant:
                continue
            raise too_deep(root.name)
        waiting.extend(below)


def _scan(root: Path, path: str) -> list[os.DirEntry[str]]:
    with os.scandir(root / path) as scan:
        entries = list(islice(scan, MAX_IN_FOLDER + 1))
    if len(entries) > MAX_IN_FOLDER:
        raise _too_many(root.name if path == "." else path, MAX_IN_FOLDER)
    return sorted(entries, key=lambda entry: entry.name)


def _is_hidden(path: str) -> bool:
    return any(part.startswith(".") for part in path.split("/") if part != ".")


def too_deep(name: str) -> SubmissionError:
    """Return the error for a tree that no student's work looks like."""
    return SubmissionError(
        f"{brief(name)} holds more than {MAX_DEPTH} folders in each other", hint="Hand in the package alone."
    )


def _too_many(name: str, number: int) -> SubmissionError:
    return SubmissionError(f"{brief(name)} holds more than {number} files", hint="Hand in the package alone.")


def list_entries(
    root: Path, *, leave_out: Path | None = None, tolerant: bool = False, max_folders: int = MAX_IN_TREE
) -> list[Entry]:
    """Return everything below `root` but folders, sorted by path; `leave_out` is a folder not to enter.

    Raises what `walk` raises, and SubmissionError for more than `max_folders` folders.
    """
    found = []
    for count, folder in enumerate(walk(root, tolerant=tolerant)):
        if count > max_folders:
            raise _too_many(root.name, max_folders)
        folder.folders[:] = [name for name in folder.folders if root / folder.inside(name) != leave_out]
        found += [_entry(folder, other) for other in folder.others if other.name not in NO_CONTENT]
    # by bytes, since a name need not be UTF-8; the digest depends on this order
    return sorted(found, key=lambda entry: os.fsencode(entry.path))


def is_file(path: Path) -> bool:
    """Return whether there is a file; where that may not even be asked, there is none."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def is_there(path: Path) -> bool:
    """Return whether there is anything of that name; where that may not even be asked, there is nothing."""
    try:
        path.lstat()
    except (OSError, ValueError):
        return False
    return True


def read_file(path: Path, limit_bytes: int) -> bytes | None:
    """Return the file's first bytes; None for what is not a regular file. A pipe is never waited for.

    Raises OSError where it cannot be read.
    """
    descriptor = os.open(path, READ)
    with os.fdopen(descriptor, "rb") as stream:
        return stream.read(limit_bytes) if stat.S_ISREG(os.fstat(descriptor).st_mode) else None


def _entry(folder: Folder, entry: os.DirEntry[str]) -> Entry:
    about = entry.stat(follow_symlinks=False)
    mode = about.st_mode
    kind: Literal["file", "link", "other"] = "other"
    if stat.S_ISREG(mode):
        kind = "file"
    elif stat.S_ISLNK(mode):
        kind = "link"
    return Entry(
        path=folder.inside(entry.name),
        kind=kind,
        executable=bool(mode & stat.S_IXUSR),
        size_bytes=about.st_size if kind == "file" else 0,
    )


def tree_digest(
    root: Path,
    entries: Iterable[Entry],
    executable: Mapping[str, bool | None],
    left_out: Collection[str] = frozenset(),
) -> str:
    """Return the sha256 over the entries' paths, executable bits, link targets and contents; of what is left out, its
    size.

    Raises OSError for a file that cannot be read.
    """
    digest = hashlib.sha256()
    for entry in entries:
        path = os.fsencode(entry.path)
        content = b"%d" % entry.size_bytes if entry.path in left_out else _content(root / entry.path, entry)
        bit = b"x" if executable.get(entry.path) else b"-"
        # With the lengths in front, no two different trees give the same bytes.
        digest.update(b"%s %s %d %d\n%s" % (entry.kind.encode(), bit, len(path), len(content), path))
        digest.update(content)
    return digest.hexdigest()


def _content(path: Path, entry: Entry) -> bytes:
    """Return what an entry adds to the digest: a file its sha256. Only files are opened: a pipe would never end."""
    if entry.kind == "link":
        return os.fsencode(path.readlink())
    if entry.kind == "other":
        return b""
    return file_digest(path).digest()


def file_digest(path: Path) -> hashlib._Hash:
    """Return the sha256 of a file's contents."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest
