"""Scripts whose Windows line ends are this disk's alone: git has them as they are to be, and hands them in so."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from grader.intake.git import Git, GitFailed
from grader.intake.gitdir import Unfit, link_repository, repository_around
from grader.intake.modes import is_script
from grader.intake.tree import Entry, read_file
from grader.portable import system

_FIRST_LINE_BYTES = 4096
_AT_MOST = 200


def right_in_git(folder: Path, entries: Iterable[Entry], git: Git, base: Path) -> frozenset[str]:
    """The paths, below the package's folder, of scripts that have CRLF here and LF in git's index.

    On Linux there are none: there what lies on the disk is run, and its line ends count.
    """
    top = repository_around(folder.resolve()) if system() else None
    suspects = list(_suspects(folder, entries))[:_AT_MOST] if top is not None else []
    if top is None or not suspects:
        return frozenset()
    try:
        view = link_repository(top, base / "git-line-ends", git, within=top, objects=True)
        said = git.run("ls-files", "--eol", "-z", "--", *suspects, cwd=folder, repository=view)
    except (GitFailed, Unfit, OSError):
        return frozenset()
    pairs = (record.partition(b"\t") for record in said.split(b"\0") if record)
    return frozenset(os.fsdecode(path) for about, _, path in pairs if about.split()[:1] == [b"i/lf"])


def _suspects(folder: Path, entries: Iterable[Entry]) -> Iterator[str]:
    for entry in entries:
        if entry.kind == "file" and is_script(folder, entry.path):
            data = read_file(folder / entry.path, _FIRST_LINE_BYTES) or b""
            if data.partition(b"\n")[0].endswith(b"\r"):
                yield entry.path
