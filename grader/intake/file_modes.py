"""Whether a file is executable, and how its lines end: git's index, the archive or else the disk may say."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from grader.intake.find import BUILD_SPACES
from grader.intake.git import Git, GitFailed, GitMissing, Repository
from grader.intake.gitdir import Repositories, Unfit, link_repository, repository_around
from grader.intake.names import brief, listing, printable
from grader.intake.source import GivenModes
from grader.intake.tree import Entry, read_file
from grader.model.submission import ModeSource
from grader.portable import MODES_ON_DISK, system

_SCRIPTS = (".py", ".sh", ".bash")
_MAX_TRACKED = 200_000
_DIFFERENCES_SHOWN = 50
_FIRST_LINE_BYTES = 4096
_AT_MOST = 200


@dataclass(frozen=True, kw_only=True)
class Modes:
    """`executable` maps every regular file's path below the package to its bit, None where it is not known."""

    source: ModeSource
    executable: dict[str, bool | None]
    hints: tuple[str, ...] = ()


def archive_modes(entries: Iterable[Entry], known: Mapping[str, bool | None], *, path: str) -> Modes:
    """Return the modes that the archive gives. `path` is the package's folder in the archive."""
    prefix = "" if path == "." else f"{path}/"
    executable = {entry.path: known.get(prefix + entry.path) for entry in entries if entry.kind == "file"}
    carried = any(bit is not None for bit in executable.values())
    return Modes(source="archive" if carried else "none", executable=executable)


def folder_modes(entries: Iterable[Entry], folder: Path, repositories: Repositories) -> Modes:
    """git's word where the folder has tracked files, the disk's for the rest and where there is no git. No one's where
    the disk knows no modes."""
    on_disk = {e.path: e.executable if MODES_ON_DISK else None for e in entries if e.kind == "file"}
    index, hints = _index(folder, repositories)
    tracked = {path: bit for path, bit in index.items() if path in on_disk}
    if not tracked:
        return Modes(source="disk" if MODES_ON_DISK else "none", executable=dict(on_disk), hints=hints)
    hints = (*hints, *_differences(folder, on_disk, tracked), *_untracked(folder, on_disk, tracked))
    return Modes(source="git", executable={**on_disk, **tracked}, hints=hints)


def uploaded_modes(modes: Modes, given: GivenModes) -> Modes:
    """Return what is known where an upload may have lost the modes: git and an archive that carries them are believed,
    and a disk on which some files are executable and others are not."""
    mixed = len(set(modes.executable.values())) > 1
    if given == "kept" or modes.source in {"git", "archive"} or (modes.source == "disk" and mixed):
        return modes
    if given == "lost":
        return replace(modes, source="none", executable=dict.fromkeys(modes.executable))
    hint = "the upload carries no file modes: every file counts as executable here"
    return Modes(source="none", executable=dict.fromkeys(modes.executable, True), hints=(*modes.hints, hint))


def _index(folder: Path, repositories: Repositories) -> tuple[dict[str, bool], tuple[str, ...]]:
    """The tracked files below the folder with git's executable bit, and a hint where git cannot be asked."""
    try:
        repository = repositories.around(folder)
        return ({}, ()) if repository is None else (_tracked(folder, repository, repositories.git), ())
    except GitMissing:
        return {}, ("git is not installed here: executable bits were read from the disk",)
    except Unfit as unfit:
        said = str(unfit)
    except GitFailed as failure:
        said = brief((failure.stderr.strip().splitlines() or [""])[-1])
    return {}, (f"git cannot read this repository ({said}): executable bits were read from the disk",)


def _tracked(folder: Path, repository: Repository, git: Git) -> dict[str, bool]:
    index: dict[str, bool] = {}
    listing_args = ("ls-files", "--stage", "-z")
    with closing(git.records(*listing_args, cwd=folder, repository=repository)) as records:
        for record in records:
            meta, _, path = record.partition(b"\t")
            if not meta.startswith(b"160000"):
                index[os.fsdecode(path)] = meta.startswith(b"100755")
            if len(index) > _MAX_TRACKED:
                raise GitFailed(f"its index lists more than {_MAX_TRACKED} files")
    return index


def is_script(folder: Path, path: str) -> bool:
    """Hints are for scripts of the student's own: on a disk of Windows every file is executable."""
    if any(part in BUILD_SPACES or part.startswith((".", "__")) for part in path.split("/")[:-1]):
        return False
    if path.endswith(_SCRIPTS):
        return True
    try:
        return read_file(folder / path, 2) == b"#!"
    except OSError:
        return False


def _differences(folder: Path, on_disk: Mapping[str, bool | None], tracked: Mapping[str, bool]) -> list[str]:
    hints: list[str] = []
    differing = (path for path, in_git in sorted(tracked.items()) if on_disk[path] not in (None, in_git))
    for path in differing:
        if len(hints) == _DIFFERENCES_SHOWN:
            break
        if not is_script(folder, path):
            continue
        shown = printable(path)
        if tracked[path]:
            hints.append(f"{shown} is executable in git but not on this disk: chmod +x {shlex.quote(shown)}")
        else:
            hints.append(
                f"{shown} is executable on this disk but not in git: "
                f"git update-index --chmod=+x {shlex.quote(shown)}; git commit -m 'Executable'; git push"
            )
    return hints


def _untracked(folder: Path, on_disk: Mapping[str, bool | None], tracked: Mapping[str, bool]) -> list[str]:
    new = sorted(path for path in on_disk.keys() - tracked.keys() if is_script(folder, path))
    return (
        [f"not in git yet, so not handed in by a push: {listing(new)} (git add, git commit)"] if new else []
    )


def right_in_git(folder: Path, entries: Iterable[Entry], git: Git, base: Path) -> frozenset[str]:
    """Return the paths, below the package's folder, of scripts that have CRLF here and LF in git's index.

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
