"""Commands of git that can be typed as they are printed."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path

from grader.intake.names import encodable, printable
from grader.student.git_status.state import State

_NAMED_AT_MOST = 4
_MESSAGE = "Lab"


class Commands:
    """For somebody who stands in `here`. From outside of the repository, `git -C` leads into the package."""

    def __init__(self, state: State, here: Path) -> None:
        inside = here.resolve().is_relative_to(state.top.resolve())
        self._base = here.resolve() if inside else state.package
        self._package = state.package
        self._git = ("git",) if inside else ("git", "-C", _relative(state.package, here.resolve()))

    def git(self, *words: str) -> str:
        """`git` with these words."""
        return _line((*self._git, *words))

    def commit(self) -> str:
        return self.git("commit", "-m", _MESSAGE)

    def add_and_commit(self, paths: Sequence[str], *, force: bool = False) -> str:
        """Of more than a few, or of what nobody can type, the package's folder is named."""
        few = 0 < len(paths) <= _NAMED_AT_MOST or force
        few = few and all(map(_can_be_typed, paths[:_NAMED_AT_MOST]))
        named = self._paths(paths[:_NAMED_AT_MOST]) if few else [_relative(self._package, self._base)]
        options = ("-f",) if force else ()
        return f"{self.git('add', *options, *named)} && {self.commit()}"

    def chmod(self, paths: Sequence[str]) -> str:
        """The executable bit, where the disk's is not heeded (`core.fileMode=false`) too."""
        return f"{self.git('update-index', '--chmod=+x', *self._paths(paths[:_NAMED_AT_MOST]))} && {self.commit()}"

    def rename(self, in_git: str, on_disk: str) -> str:
        """As the disk has it."""
        return f"{self.git('mv', '-f', *self._paths((in_git, on_disk)))} && {self.commit()}"

    def look(self, paths: Sequence[str]) -> str:
        options = ("--no-assume-unchanged", "--no-skip-worktree")
        named = self._paths(paths[:_NAMED_AT_MOST])
        return " && ".join(self.git("update-index", option, *named) for option in options)

    @staticmethod
    def trust(top: Path) -> str:
        return _line(("git", "config", "--global", "--add", "safe.directory", str(top)))

    @staticmethod
    def status_of(around: Path, top: Path) -> str:
        return _line(("git", "-C", str(around), "status", _relative(top, around)))

    def _paths(self, paths: Iterable[str]) -> list[str]:
        return [_relative(self._package / path, self._base) for path in paths]


def _relative(path: Path, base: Path) -> str:
    try:
        return os.path.relpath(path, base)
    except ValueError:  # another drive of Windows
        return str(path)


def _can_be_typed(path: str) -> bool:
    return path.isprintable() and encodable(path)


def _line(words: Iterable[str]) -> str:
    """For a shell; a name that cannot be typed is shown as it is elsewhere."""
    return " ".join(shlex.quote(printable(word)) for word in words)
