"""The files of a package: which are read, which are left out (giants, what may not be read), and how they are stored.

Whether a file is executable, and how its lines end: git's index, the archive or else the disk may say.
"""

from __future__ import annotations

import os
import re
import shlex
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path, PurePosixPath

from grader.errors import SubmissionError
from grader.intake.git import Git, GitFailed, GitMissing, Repository
from grader.intake.gitdir import Repositories, Unfit, link_repository, repository_around
from grader.intake.limits import NO_CODE, IntakeLimits, too_much
from grader.intake.names import DEVICE, brief, encodable, listing, printable
from grader.intake.source import GivenModes
from grader.intake.tree import Entry, list_entries, read_file
from grader.model.package import BUILD_SPACES
from grader.model.submission import ModeSource, chmod_hint
from grader.portable import MODES_ON_DISK, system

# What a build or an editor leaves in a package; it is copied nowhere, so it counts for nothing.
_MADE = frozenset({"build", "devel", "install", ".catkin_tools"})
_ODD_NAMES_SHOWN = 3
_LFS = b"version https://git-lfs.github.com/spec/"
_LFS_BYTES = 1024
_FORBIDDEN = re.compile(r'[<>:"|?*\\\x00-\x1f]|[. ]$')


@dataclass(frozen=True, kw_only=True)
class Content:
    """`entries` is everything but folders, `left_out` the paths of those that are not opened, `hints` say why."""

    entries: list[Entry]
    left_out: frozenset[str]
    hints: tuple[str, ...]


def package_content(
    folder: Path, *, limits: IntakeLimits, leave_out: Path | None = None, tolerant: bool = False
) -> Content:
    """Return the content of a package's folder.

    Raises OSError and SubmissionError as `walk` does, SubmissionError for more files than a package has, and for a
    file that may not be read and could be one that matters; `tolerant` leaves that one out.
    """
    entries = list_entries(folder, leave_out=leave_out, tolerant=tolerant, max_folders=limits.package_files)
    files = [e for e in entries if e.kind == "file"]
    own = [e for e in files if e.path.partition("/")[0] not in _MADE]
    if len(own) > limits.package_files:
        raise too_much(brief(folder.name), f"holds more than {limits.package_files} files")
    closed = [e.path for e in files if not os.access(folder / e.path, os.R_OK, effective_ids=True)]
    for path in () if tolerant else closed:
        hidden = any(part.startswith(".") for part in path.split("/"))
        if not hidden and PurePosixPath(path).suffix.lower() not in NO_CODE:
            raise SubmissionError(
                f"{brief(path)} cannot be read: Permission denied", hint="Check its permissions (`ls -l`)."
            )
    large = _too_large(own, limits)
    others = [e.path for e in entries if e.kind == "other"]
    # what a build left counts for nothing, but no giant among it is read either
    giants = (e.path for e in files if e.size_bytes > limits.file_bytes)
    left_out = frozenset((*closed, *large, *others, *giants))
    return Content(entries=entries, left_out=left_out, hints=tuple(_hints(closed, large, others)))


def _too_large(files: list[Entry], limits: IntakeLimits) -> list[str]:
    """Return each that is too large by itself, then the largest, until the rest is no more than a package may be."""
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


def remarks(folder: Path, entries: list[Entry], left_out: Collection[str]) -> tuple[str, ...]:
    """Return what is worth saying of the files' names, and of those whose content is somewhere else."""
    paths = [entry.path for entry in entries]
    small = [e.path for e in entries if e.kind == "file" and 0 < e.size_bytes <= _LFS_BYTES]
    pointers = [path for path in small if path not in left_out and _is_pointer(folder / path)]
    odd = [brief(path) for path in paths if not encodable(path)]
    return (
        *(f"a file's name is not UTF-8, so it is left out: {name}" for name in odd[:_ODD_NAMES_SHOWN]),
        *(*_clashes(paths), *_foreign(paths), *_pointers(pointers)),
    )


def _with_folders(paths: Iterable[str]) -> set[str]:
    """Return the paths, and those of all folders on the way to them."""
    found: set[str] = set()
    for path in paths:
        while path and path not in found:
            found.add(path)
            path = path.rpartition("/")[0]  # noqa: PLW2901 - up, as long as there is something new
    return found


def _clashes(paths: Iterable[str]) -> Iterator[str]:
    alike: dict[str, list[str]] = defaultdict(list)
    for path in _with_folders(paths):
        folder, _, name = path.rpartition("/")
        alike[f"{folder}/{name.casefold()}"].append(path)
    clashing = sorted(name for names in alike.values() if len(names) > 1 for name in names)
    if clashing:
        yield f"names that differ in capitals only, of which Windows and macOS keep one: {listing(clashing)}"


def _foreign(paths: Iterable[str]) -> Iterator[str]:
    names = ((path, PurePosixPath(path).name) for path in _with_folders(paths) if encodable(path))
    found = sorted(path for path, name in names if _FORBIDDEN.search(name) or DEVICE.match(name))
    if found:
        yield f"names that Windows cannot hold: {listing(found)}"


def _is_pointer(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            return stream.read(len(_LFS)) == _LFS
    except OSError:
        return False


def _pointers(paths: list[str]) -> Iterator[str]:
    if paths:
        yield (
            f"only a pointer of Git LFS, the file itself is not in the submission: {listing(paths)} "
            "(`git lfs pull`, then hand in the folder; or commit it without LFS)"
        )


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
    """Return the modes of a folder's files: git's word where it has tracked files, the disk's for the rest and where
    there is no git. They are unknown where the disk knows no modes."""
    on_disk = {e.path: e.executable if MODES_ON_DISK else None for e in entries if e.kind == "file"}
    index, hints = _index(folder, repositories)
    tracked = {path: bit for path, bit in index.items() if path in on_disk}
    if not tracked:
        return Modes(source="disk" if MODES_ON_DISK else "none", executable=dict(on_disk), hints=hints)
    new = sorted(path for path in on_disk.keys() - tracked.keys() if is_script(folder, path))
    added = (
        [f"not in git yet, so not handed in by a push: {listing(new)} (git add, git commit)"] if new else ()
    )
    hints = (*hints, *_differences(folder, on_disk, tracked), *added)
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
    """Return the tracked files below the folder with git's executable bit, and a hint where git cannot be asked."""
    try:
        repository = repositories.around(folder)
        return ({}, ()) if repository is None else (_tracked_modes(folder, repository, repositories.git), ())
    except GitMissing:
        return {}, ("git is not installed here: executable bits were read from the disk",)
    except Unfit as unfit:
        said = str(unfit)
    except GitFailed as failure:
        said = brief((failure.stderr.strip().splitlines() or [""])[-1])
    return {}, (f"git cannot read this repository ({said}): executable bits were read from the disk",)


def _tracked_modes(folder: Path, repository: Repository, git: Git) -> dict[str, bool]:
    index: dict[str, bool] = {}
    listing_args = ("ls-files", "--stage", "-z")
    with closing(git.records(*listing_args, cwd=folder, repository=repository)) as records:
        for record in records:
            meta, _, path = record.partition(b"\t")
            # 160000 is the mode of a pointer to a submodule's commit, of which nothing is here
            if not meta.startswith(b"160000"):
                index[os.fsdecode(path)] = meta.startswith(b"100755")
            if len(index) > _MAX_TRACKED:
                raise GitFailed(f"its index lists more than {_MAX_TRACKED} files")
    return index


def is_script(folder: Path, path: str) -> bool:
    """Return whether a hint on its bit is for the student: it is a script, and no copy that a build or a tool made."""
    if any(part in BUILD_SPACES or part.startswith((".", "__")) for part in path.split("/")[:-1]):
        return False
    if path.endswith(_SCRIPTS):
        return True
    try:
        return read_file(folder / path, 2) == b"#!"
    except OSError:
        return False


def _differences(
    folder: Path, on_disk: Mapping[str, bool | None], tracked: Mapping[str, bool]
) -> Iterator[str]:
    differing = (path for path, in_git in sorted(tracked.items()) if on_disk[path] not in (None, in_git))
    scripts = (path for path in differing if is_script(folder, path))
    for path in islice(scripts, _DIFFERENCES_SHOWN):
        shown = printable(path)
        if tracked[path]:
            yield f"{shown} is executable in git but not on this disk: chmod +x {shlex.quote(shown)}"
        else:
            how = chmod_hint("git", shown, only_git_lacks_it=True)
            yield f"{shown} is executable on this disk but not in git: {how}"


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
    # `i/` is the index; `w/`, which is the disk, follows
    return frozenset(os.fsdecode(path) for about, _, path in pairs if about.split()[:1] == [b"i/lf"])


def _suspects(folder: Path, entries: Iterable[Entry]) -> Iterator[str]:
    for entry in entries:
        if entry.kind == "file" and is_script(folder, entry.path):
            data = read_file(folder / entry.path, _FIRST_LINE_BYTES) or b""
            if data.partition(b"\n")[0].endswith(b"\r"):
                yield entry.path
