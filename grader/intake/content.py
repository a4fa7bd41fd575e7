"""Which files of a package are read, which are left out (giants, what may not be read), and remarks on their names."""

from __future__ import annotations

import os
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.errors import SubmissionError
from grader.intake.limits import NO_CODE, IntakeLimits, too_much
from grader.intake.names import brief, encodable, listing
from grader.intake.tree import Entry, list_entries

# What a build or an editor leaves in a package; it is copied nowhere, so it counts for nothing.
_MADE = frozenset({"build", "devel", "install", ".catkin_tools"})
_ODD_NAMES_SHOWN = 3
_LFS = b"version https://git-lfs.github.com/spec/"
_LFS_BYTES = 1024
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
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
    if not tolerant:
        _refuse_closed(closed)
    large = _too_large(own, limits)
    others = [e.path for e in entries if e.kind == "other"]
    giants = (e.path for e in files if e.size_bytes > limits.file_bytes)
    left_out = frozenset((*closed, *large, *others, *giants))
    return Content(entries=entries, left_out=left_out, hints=tuple(_hints(closed, large, others)))


def _refuse_closed(paths: Iterable[str]) -> None:
    for path in paths:
        hidden = any(part.startswith(".") for part in path.split("/"))
        if not hidden and PurePosixPath(path).suffix.lower() not in NO_CODE:
            raise SubmissionError(
                f"{brief(path)} cannot be read: Permission denied", hint="Check its permissions (`ls -l`)."
            )


def _too_large(files: list[Entry], limits: IntakeLimits) -> list[str]:
    """Each that is too large by itself, then the largest, until the rest is no more than a package may be."""
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
    return (*_odd(paths), *_clashes(paths), *_foreign(paths), *_pointers(pointers))


def _odd(paths: Iterable[str]) -> list[str]:
    odd = [brief(path) for path in paths if not encodable(path)]
    return [f"a file's name is not UTF-8, so it is left out: {name}" for name in odd[:_ODD_NAMES_SHOWN]]


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
    found = sorted(path for path, name in names if _FORBIDDEN.search(name) or _DEVICES.match(name))
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
