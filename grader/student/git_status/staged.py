"""A package as the next commit would hold it: git's index, written out, and nothing of the repository run."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from grader.errors import SubmissionError, UsageError
from grader.intake.git import Git, GitFailed
from grader.intake.gitdir import Unfit, git_folder, repository_around
from grader.intake.limits import Limits
from grader.intake.names import brief, printable
from grader.student.git_status.view import View, open_view

SECONDS = 30.0
_AT_ONCE = 200
_LONGEST_LINE = 50_000


def write_staged(package: Path, base: Path, *, index: str = "") -> Path:
    """The package in the folder `package` as it is staged, written below the new folder `base`; gives its folder there.

    `index` is git's own variable for the index that a commit is made of (`git commit -a` has one of its own).
    Raises UsageError where there is no repository, SubmissionError where nothing of it is staged or git cannot tell.
    """
    package = package.resolve()
    top = repository_around(package)
    if top is None:
        raise UsageError(f"{printable(str(package))} is in no git repository", hint="leave out --staged")
    try:
        view = _view(top, base, index)
        paths = _paths(view, package)
        into = base / "staged"
        for some in _in_parts(paths):
            view.run("checkout-index", f"--prefix={into}/", "--", *some, cwd=package)
    except (GitFailed, Unfit, OSError) as error:
        said = (str(error).strip().splitlines() or [type(error).__name__])[-1]
        raise SubmissionError(
            f"what is staged cannot be read: {brief(said)}",
            hint="leave out --staged: what is on the disk is checked",
        ) from error
    return into / package.relative_to(top)


def _view(top: Path, base: Path, index: str) -> View:
    git = Git(base / "home", timeout_s=SECONDS)
    view = open_view(top, base / "view", git)
    own = git_folder(top, top, git).resolve()
    place = Path(os.path.realpath(top / index)) if index else own / "index"
    if place != own / "index" and place.parent == own and place.is_file():
        shown = view.repository.git_dir / "index"
        shown.unlink(missing_ok=True)
        shown.write_bytes(place.read_bytes())
    return view


def _paths(view: View, package: Path) -> list[str]:
    """The package's staged files, relative to its folder. What is only a pointer to another repository is none."""
    said = view.run("ls-files", "--stage", "-z", cwd=package)
    pairs = (record.partition(b"\t") for record in said.split(b"\0") if record)
    paths = [os.fsdecode(path) for meta, _, path in pairs if not meta.startswith(b"160000")]
    if not paths:
        raise SubmissionError(
            f"git has nothing of the package in {printable(package.name)}",
            hint="git add its files, and commit",
        )
    if len(paths) > Limits().package_files:
        raise SubmissionError(
            f"{len(paths)} files are staged", hint="take what was built or recorded out of the repository"
        )
    return paths


def _in_parts(paths: Sequence[str]) -> list[list[str]]:
    """As many at once as a command line takes."""
    parts: list[list[str]] = [[]]
    room = _LONGEST_LINE
    for path in paths:
        if len(parts[-1]) == _AT_ONCE or len(path) > room:
            parts.append([])
            room = _LONGEST_LINE
        parts[-1].append(path)
        room -= len(path)
    return parts
