"""What intake returns: a folder on disk with the lab's package in it, and who it is."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Literal

from grader.model.record import Record

ModeSource = Literal["git", "archive", "disk", "none"]
"""Whose word counts for executable bits. "none": the source carries no modes."""


def chmod_hint(source: ModeSource | None, *paths: str, only_git_lacks_it: bool = False) -> str:
    """Return how these files become executable in what is handed in, by where their modes come from.

    `source` is None where nobody knows how the package is handed in. With git, the words are right for files that are
    tracked and for new ones; with `only_git_lacks_it`, the disk has the bit and the files are tracked.
    """
    files = shlex.join(paths)
    if source == "git" and only_git_lacks_it:
        return f"git update-index --chmod=+x {files}, then commit and push"
    # `git add --chmod` as well: where `core.fileMode` is off, as on Windows, git does not look at the disk's bit.
    if source == "git":
        return f"chmod +x {files}, then git add --chmod=+x {files}, commit and push"
    if source == "archive":
        return f"chmod +x {files}, then pack it again with tar or zip, which keep that permission"
    return f"chmod +x {files}, and hand it in with git, tar or zip, which keep that permission"


class SourcePackage(Record):
    """One catkin package of the submission.

    `folder` is absolute on this machine, `path` the same relative to the submission's root (posix, `.` for the
    root itself). `executable` maps each regular file's path, relative to `folder`, to its executable bit, or to
    None where the source carries no modes (`mode_source` "none"). `left_out` are the paths, as in `SourceFile.path`, of
    what no one opens or copies: files too large or not readable here, pipes and devices. `right_in_git` are those whose
    Windows line ends are this disk's alone: git hands them in without. `asked` is the lab's name for it where the lab
    asks for several packages and this is not the main one.
    """

    name: str
    folder: Path
    path: str
    mode_source: ModeSource
    executable: dict[str, bool | None]
    left_out: frozenset[str] = frozenset()
    right_in_git: frozenset[str] = frozenset()
    path_in_git: str = ""
    """The same as `path` from the top of the repository around a folder that is graded in place; "" for others."""
    asked: str = ""


class Submission(Record):
    """`commit` is the full hash where the source is a repository, `archive_sha256` where it is an archive.

    `digest` is the sha256 of the package's tree (paths, executable bits, contents), and of those of `also`: what the
    lab asks for besides, as far as it is there. `packages` are the other packages of the same submission, for
    dependencies. `hints` are remarks that the report shows, for instance that the package was found under another
    spelling.
    """

    id: str
    source: str
    root: Path
    commit: str | None
    archive_sha256: str | None
    digest: str
    package: SourcePackage
    packages: tuple[SourcePackage, ...]
    also: tuple[SourcePackage, ...] = ()
    hints: tuple[str, ...] = ()


class RecordedSubmission(Record):
    """Recordings and no package: there is nothing to build or to run.

    `file` is the recording that the source itself is; where it is None, recordings lie below `root`. `digest` is the
    sha256 of the file, or of the tree.
    """

    id: str
    source: str
    root: Path
    file: Path | None
    commit: str | None
    digest: str
