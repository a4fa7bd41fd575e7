"""Of the package's files: what is not committed, not in git, hidden from git, or not executable there."""

from __future__ import annotations

import os
import stat
import unicodedata
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

from grader.errors import SubmissionError
from grader.intake.find import BUILD_SPACES
from grader.intake.modes import is_script
from grader.intake.tree import list_entries
from grader.portable import MODES_ON_DISK
from grader.student.git_status.state import Change, Files, What
from grader.student.git_status.view import View

_STATUS = (
    *("status", "--porcelain=v2", "-z", "--branch", "--no-renames", "--ignore-submodules=all"),
    *("--untracked-files=all", "--ignored=matching", "--", "."),
)
_FIELDS = {"1": 8, "u": 10}
_LINK = "160000"
_FILES_IN_IGNORED = 2000
_USED = frozenset(
    {".py", ".cpp", ".cc", ".cxx", ".c", ".h", ".hpp", ".launch", ".xml", ".msg", ".srv", ".action", ".yaml", ".yml"}
    | {".sh", ".bash", ".cfg", ".urdf", ".xacro", ".world", ".sdf"}
)  # fmt: skip
_JUNK = (".pyc", ".pyo", ".o", ".so", ".swp", ".swo", ".orig", ".rej", "~", ".bak", ".tmp", ".log")


def files_of(view: View, package: Path) -> tuple[str | None, str | None, Files]:
    """The branch, the commit and the package's files. Raises GitFailed, OSError."""
    prefix = _prefix(view, package)
    records = [os.fsdecode(record) for record in view.run(*_STATUS, cwd=package).split(b"\0") if record]
    heads = dict(record[2:].split(" ", 1) for record in records if record.startswith("# branch."))
    index = dict(_index(view, package))
    on_disk = _on_disk(package)
    cases = tuple(_cases(index, on_disk))
    taken = {name for pair in cases for name in pair}
    untracked = [_below(r[2:], prefix) for r in records if r.startswith("? ")]
    ignored = [_below(r[2:], prefix) for r in records if r.startswith("! ")]
    files = Files(
        changes=tuple(c for c in _changes(records, prefix) if c.path not in taken),
        untracked=tuple(p for p in untracked if p not in taken and not _is_made(p) and not _is_junk(p)),
        ignored=tuple(sorted(set(_used(package, ignored)))),
        bits=tuple(_bits(package, index)),
        cases=cases,
        unlooked=tuple(p for p, (tag, mode) in index.items() if _unlooked(tag, p, on_disk) and mode != _LINK),
        links=tuple(path for path, (_, mode) in index.items() if mode == _LINK),
    )
    branch, commit = heads.get("branch.head"), heads.get("branch.oid")
    return None if branch == "(detached)" else branch, None if commit == "(initial)" else commit, files


def _prefix(view: View, package: Path) -> str:
    path = package.relative_to(view.repository.top).as_posix()
    return "" if path == "." else f"{path}/"


def _below(path: str, prefix: str) -> str:
    """Relative to the package; "." where all of it, or a folder around it, is meant."""
    return path[len(prefix) :] or "." if path.startswith(prefix) else "."


def _changes(records: Iterable[str], prefix: str) -> Iterator[Change]:
    for record in records:
        fields = _FIELDS.get(record[:1])
        if fields is None:
            continue
        *about, path = record.split(" ", fields)
        staged, here = about[1][:1], about[1][1:]
        yield Change(
            path=_below(path, prefix),
            what="conflict" if record[0] == "u" else _what(about, staged, here),
            staged=here == ".",
        )


def _what(about: list[str], staged: str, here: str) -> What:
    if "D" in (staged, here):
        return "deleted"
    if "A" in (staged, here):
        return "new"
    same_content = about[6] == about[7] and here == "."
    return "bit" if same_content else "modified"


def _index(view: View, package: Path) -> Iterator[tuple[str, tuple[str, str]]]:
    """Each tracked file below the package's folder: how git looks at it, and its mode."""
    for record in view.run("ls-files", "-v", "--stage", "-z", cwd=package).split(b"\0"):
        meta, _, path = record.partition(b"\t")
        if path:
            tag, mode, *_ = meta.decode("ascii", "replace").split(" ")
            yield os.fsdecode(path), (tag, mode)


def _on_disk(package: Path) -> set[str]:
    try:
        return {entry.path for entry in list_entries(package, tolerant=True)}
    except SubmissionError:
        return set()


def _cases(index: Iterable[str], on_disk: set[str]) -> Iterator[tuple[str, str]]:
    """Where a file system knows no case, git keeps the name that it was first given."""
    by_folded = {_folded(path): path for path in on_disk}
    for path in index:
        found = by_folded.get(_folded(path))
        if found is not None and path not in on_disk and _composed(found) != _composed(path):
            yield path, found


def _composed(path: str) -> str:
    return unicodedata.normalize("NFC", path)


def _folded(path: str) -> str:
    return _composed(path).casefold()


def _bits(package: Path, index: dict[str, tuple[str, str]]) -> Iterator[str]:
    """Scripts that may be run here and not where they are marked. A disk on which all may be run says nothing."""
    if not MODES_ON_DISK or _may_run(package / "package.xml"):
        return
    for path, (_, mode) in index.items():
        if mode == "100644" and _may_run(package / path) and is_script(package, path):
            yield path


def _may_run(path: Path) -> bool:
    try:
        mode = path.lstat().st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISREG(mode) and bool(mode & stat.S_IXUSR)


def _unlooked(tag: str, path: str, on_disk: set[str]) -> bool:
    """Left as it is in the index, whatever is on the disk. What a sparse checkout leaves out is not there at all."""
    return (tag.islower() or tag == "S") and path in on_disk


def _used(package: Path, ignored: Iterable[str]) -> Iterator[str]:
    """Of what is ignored, what a package uses: sources, launch files, messages, scripts."""
    for path in ignored:
        found = list(_files_in(package, path)) if path == "." or path.endswith("/") else [path]
        for file in found:
            if not _is_made(file) and not _is_junk(file) and _is_used(package, file):
                yield file


def _files_in(package: Path, path: str) -> Iterator[str]:
    """The files of an ignored folder, as far as they are few; what a build or an editor made is passed over."""
    if _is_made(path):
        return
    start = package if path == "." else package / path.rstrip("/")
    walked = (Path(folder, name) for folder, _, names in _walk(start) for name in names)
    yield from (file.relative_to(package).as_posix() for file in islice(walked, _FILES_IN_IGNORED))


def _walk(start: Path) -> Iterator[tuple[str, list[str], list[str]]]:
    for folder, folders, names in os.walk(start):
        folders[:] = [name for name in folders if not _is_made(f"{name}/")]
        yield folder, folders, names


def _is_made(path: str) -> bool:
    """In a folder that a build or a program keeps for itself."""
    return any(p in BUILD_SPACES or p.startswith((".", "__")) or p == "venv" for p in path.split("/")[:-1])


def _is_junk(path: str) -> bool:
    name = path.rpartition("/")[2]
    return name.startswith(".") or name.endswith(_JUNK)


def _is_used(package: Path, path: str) -> bool:
    name = path.rpartition("/")[2]
    return name == "CMakeLists.txt" or Path(name).suffix in _USED or is_script(package, path)
