"""A folder of files in memory, the differences between two of them, and the way back to the disk."""

from __future__ import annotations

import difflib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.errors import UsageError

IGNORED = frozenset({"__pycache__", ".git", ".DS_Store", ".vscode", ".idea"})
MAX_FILES = 5_000
MAX_BYTES = 50_000_000
SHEBANG = b"#!"


@dataclass(frozen=True, kw_only=True)
class TreeFile:
    """One file; `link` is the target of a symbolic link, whose `data` is empty."""

    data: bytes
    executable: bool = False
    link: str | None = None


Tree = dict[str, TreeFile]


def read_tree(folder: Path, *, modes: bool = True) -> Tree:
    """Every file below `folder`, by its posix path.

    Without `modes`, the folder cannot be trusted to have kept executable bits (an installed wheel's data): then
    what begins with a shebang is executable. Raises UsageError for a folder that no reference solution would be.
    """
    tree: Tree = {}
    size = 0
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if IGNORED & set(name.parts) or (path.is_dir() and not path.is_symlink()):
            continue
        entry = _entry(path, modes=modes)
        if entry is None:
            continue
        size += len(entry.data)
        tree[name.as_posix()] = entry
        if len(tree) > MAX_FILES or size > MAX_BYTES:
            raise UsageError(
                f"{folder} holds more than a package: over {MAX_FILES} files or {MAX_BYTES // 1_000_000} MB",
                hint="give the folder of the correct package with --solution",
            )
    return tree


def _entry(path: Path, *, modes: bool) -> TreeFile | None:
    try:
        if path.is_symlink():
            return TreeFile(data=b"", link=path.readlink().as_posix())
        if not path.is_file():
            return None
        data = path.read_bytes()
        executable = bool(path.stat().st_mode & 0o100) if modes else data.startswith(SHEBANG)
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    return TreeFile(data=data, executable=executable)


def write_tree(tree: Tree, folder: Path) -> None:
    """Replace `folder` by the tree."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, entry in tree.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if entry.link is not None:
            path.symlink_to(entry.link)
        else:
            path.write_bytes(entry.data)
            path.chmod(0o755 if entry.executable else 0o644)


def unified_diff(before: Tree, after: Tree) -> str:
    """Return the changes as a unified diff; modes, line ends and moves are said in git's words."""
    names = sorted(before.keys() | after.keys())
    return "".join(
        line
        for name in names
        if before.get(name) != after.get(name)
        for line in _file_diff(name, before, after)
    )


def _file_diff(name: str, before: Tree, after: Tree) -> Iterator[str]:
    old, new = before.get(name), after.get(name)
    yield f"diff a/{name} b/{name}\n"
    if old is None or new is None:
        yield "new file\n" if old is None else "deleted file\n"
    elif old.executable != new.executable:
        yield f"old mode {_mode(old)}\nnew mode {_mode(new)}\n"
    yield from difflib.unified_diff(
        _lines(old),
        _lines(new),
        fromfile=f"a/{name}" if old else "/dev/null",
        tofile=f"b/{name}" if new else "/dev/null",
    )


def _mode(entry: TreeFile) -> str:
    return "100755" if entry.executable else "100644"


def _lines(entry: TreeFile | None) -> list[str]:
    """Return the lines, each with one `\\n`; what a reader cannot see is written out."""
    if entry is None:
        return []
    text = entry.data.decode(errors="replace").replace("\r", "^M").replace("\ufeff", "<BOM>")
    return [f"{line}\n" for line in text.removesuffix("\n").split("\n")] if text else []
