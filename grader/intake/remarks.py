"""Remarks on a package's files that cost nothing and explain much: names that clash elsewhere, pointers of Git LFS."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path, PurePosixPath

from grader.intake.names import brief, encodable, listing
from grader.intake.tree import Entry

_ODD_NAMES_SHOWN = 3
_LFS = b"version https://git-lfs.github.com/spec/"
_LFS_BYTES = 1024
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\.|$)", re.IGNORECASE)
_FORBIDDEN = re.compile(r'[<>:"|?*\\\x00-\x1f]|[. ]$')


def remarks(folder: Path, entries: list[Entry], left_out: Collection[str]) -> tuple[str, ...]:
    """What is worth saying of the files' names, and of those whose content is somewhere else."""
    paths = [entry.path for entry in entries]
    small = [e.path for e in entries if e.kind == "file" and 0 < e.size_bytes <= _LFS_BYTES]
    pointers = [path for path in small if path not in left_out and _is_pointer(folder / path)]
    return (*_odd(paths), *_clashes(paths), *_foreign(paths), *_pointers(pointers))


def _odd(paths: Iterable[str]) -> list[str]:
    odd = [brief(path) for path in paths if not encodable(path)]
    return [f"a file's name is not UTF-8, so it is left out: {name}" for name in odd[:_ODD_NAMES_SHOWN]]


def _with_folders(paths: Iterable[str]) -> set[str]:
    """The paths, and those of all folders on the way to them."""
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
