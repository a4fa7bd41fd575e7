"""Finds the packages that `grader check` is about from any folder: below it, around it, or beside it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.errors import UsageError
from grader.intake import find_packages
from grader.intake.find import (
    BUILD_SPACES,
    WORKSPACE_MARKS,
    Candidate,
    enclosing_package,
    find_nearest,
    manifest_name,
)
from grader.intake.gitdir import repository_around
from grader.intake.names import printable
from grader.intake.tree import is_file, is_there
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation

_MADE = BUILD_SPACES | {"logs"}
_MADE_MARKS = ("CMakeCache.txt", ".catkin", "setup.sh", ".catkin_tools.yaml", ".built_by")


@dataclass(frozen=True, kw_only=True)
class Found:
    """`candidates` may be packages, nearest first. `root` is the folder that was searched; if that is not the one
    that was given, `moved` says why. `whole` is false if some of it was not searched."""

    root: Path
    candidates: tuple[Candidate, ...]
    moved: str = ""
    whole: bool = True

    @property
    def packages(self) -> tuple[Candidate, ...]:
        """Return those with a manifest, as catkin sees them."""
        return tuple(c for c in self.candidates if c.has_manifest and c.ignored_by is None)


def find(path: Path) -> Found:
    """Find the packages below the folder `path`; else the one around it; else those of its repository or workspace.

    From inside .git or a build's folder, the search starts outside of it. Raises UsageError if `path` cannot be read.
    """
    try:
        return _find(path)
    except OSError as error:
        reason = "does not exist" if not is_there(path) else error.strerror or "cannot be read"
        raise UsageError(f"{path} {reason}", hint="give your package's folder") from error


def _find(path: Path) -> Found:
    here = path.resolve()
    outside, moved = _outside(here)
    root = path if outside == here else outside
    candidates, whole = find_nearest(root)
    found = Found(root=root, candidates=tuple(candidates), moved=moved, whole=whole)
    if found.packages:
        return found
    around = enclosing_package(outside)
    if around is not None:
        return Found(root=around, candidates=(_as_candidate(around),), moved=moved)
    return _beside(outside) or found


def _outside(here: Path) -> tuple[Path, str]:
    """Return the folder to search instead of one with copies of packages, or none, and why."""
    for folder in (*reversed(here.parents), here):
        if folder.name == ".git":
            return folder.parent, "this folder belongs to git"
        if folder.name in _MADE and _is_made(folder):
            return folder.parent, f"{folder.name}/ was made by a build"
    return here, ""


def _is_made(folder: Path) -> bool:
    """Return whether catkin or CMake made it: a package may have a folder of the same name."""
    if any(is_there(folder / mark) for mark in _MADE_MARKS):
        return True
    return any(is_there(folder.parent / mark) for mark in WORKSPACE_MARKS)


def _beside(here: Path) -> Found | None:
    """Search the rest of the repository or workspace that the folder is part of."""
    repository = repository_around(here)
    workspace = next((f for f in here.parents if any(is_there(f / mark) for mark in WORKSPACE_MARKS)), None)
    for root, what in ((workspace, "workspace"), (repository, "repository")):
        if root is not None and root not in (here, Path(root.anchor)):
            candidates, whole = find_nearest(root)
            found = Found(
                root=root,
                candidates=tuple(candidates),
                whole=whole,
                moved=f"there is no package here, but in the {what}",
            )
            if found.packages:
                return found
    return None


def _as_candidate(folder: Path) -> Candidate:
    name = manifest_name(folder, root=folder) or printable(folder.name)
    return Candidate(path=".", folder=folder, manifest=name, has_cmake=is_file(folder / "CMakeLists.txt"))


def shown(folder: Path) -> str:
    """Return the shorter of the relative and the absolute path, as printable text."""
    try:
        near = os.path.relpath(folder.resolve(), Path.cwd())
    except (OSError, ValueError):
        return printable(str(folder))
    whole = str(folder.resolve())
    return printable(near if len(near) < len(whole) else whole)


def package_prefix(result: GradingResult, here: Path) -> str | None:
    """Return the package's folder relative to the repository around `here` (or to `here`), `.` for the root itself.

    Results do not say it: it is the package of that name that has all files that the result cites. None if none has.
    """
    root = _root(here.resolve())
    cited = {
        c.file for criterion in result.criteria for c in criterion.citations if isinstance(c, FileCitation)
    }
    for name, folder in _packages(root):
        if name == result.submission.package and all((folder / file).exists() for file in cited):
            return folder.relative_to(root).as_posix()
    return None


def _root(here: Path) -> Path:
    return next((folder for folder in (here, *here.parents) if (folder / ".git").exists()), here)


def _packages(root: Path) -> Iterator[tuple[str, Path]]:
    try:
        found = find_packages(root)
    except OSError:
        return
    yield from ((name, folder) for name, folder in found if folder.is_relative_to(root))
