"""Asks git about one package, without the network, and without running anything that a repository brings along."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from grader.errors import GraderError
from grader.intake.git import Git, GitFailed, GitMissing, GitTimeout, GitTooMuch
from grader.intake.gitdir import Unfit, git_folder, repository_around
from grader.intake.names import brief
from grader.portable import user_id
from grader.student.git_status.files import files_of
from grader.student.git_status.refs import remote_of
from grader.student.git_status.state import Files, Head, Remote, State
from grader.student.git_status.view import View, open_view

SECONDS = 5.0
_OPERATIONS = {
    "rebase-merge": "rebase",
    "rebase-apply": "rebase",
    "MERGE_HEAD": "merge",
    "CHERRY_PICK_HEAD": "cherry-pick",
    "REVERT_HEAD": "revert",
    "BISECT_LOG": "bisect",
}


@dataclass(frozen=True, kw_only=True)
class Asked:
    """`state` where git could answer; else `reason` says why not, "" where there is no repository at all."""

    state: State | None = None
    reason: str = ""


def ask(package: Path, base: Path, *, seconds: float = SECONDS) -> Asked:
    """What git has of the package in the folder `package`. `base` is a new folder of ours. Raises nothing.

    All of git's work together takes at most `seconds`.
    """
    try:
        package = package.resolve()
        top = repository_around(package)
        if top is None:
            return Asked()
        git = Git(base / "home", timeout_s=seconds)
        return Asked(state=_state(package, top, git, base / "view"))
    except GitFailed as failure:
        return Asked(reason=_reason(failure, seconds))
    except (Unfit, OSError, ValueError, GraderError) as error:
        return Asked(reason=brief(str(error)) or type(error).__name__)


def _reason(failure: GitFailed, seconds: float) -> str:
    if isinstance(failure, GitMissing):
        return "git is not installed here"
    if isinstance(failure, GitTimeout):
        return f"git took longer than {seconds:g} seconds"
    if isinstance(failure, GitTooMuch):
        return "there is too much in this repository"
    return brief((failure.stderr.strip().splitlines() or ["git failed"])[-1])


def _state(package: Path, top: Path, git: Git, into: Path) -> State:
    own = git_folder(top, top, git)
    view = open_view(top, into, git)
    head, files = _head_and_files(view, package, own)
    linked = not (top / ".git").is_dir()
    further_worktree = linked and own.parent.name == "worktrees"
    around = None if further_worktree else repository_around(top.parent)
    return State(
        top=top,
        package=package,
        head=head,
        files=files,
        remote=remote_of(view, package, head) if head.commit else Remote(names=view.remote_names),
        around=around,
        submodule=linked and around is not None,
        owned=_owned(own),
    )


def _head_and_files(view: View, package: Path, own: Path) -> tuple[Head, Files]:
    branch, commit, files = files_of(view, package)
    operation = next((word for name, word in _OPERATIONS.items() if (own / name).exists()), "")
    return Head(branch=branch, commit=commit, operation=operation), files


def _owned(place: Path) -> bool:
    """Whether git itself would work there: it refuses what belongs to another user."""
    uid = user_id()
    return uid is None or place.stat().st_uid in (uid, int(os.environ.get("SUDO_UID") or uid))
