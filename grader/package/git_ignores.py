"""Reads the `.gitignore` files of a package and of the folders above it, up to the top of its repository."""

from __future__ import annotations

import posixpath
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from grader.model.git_ignores import IgnoreLine
from grader.model.submission import SourcePackage
from grader.package.repairs.editing import read_data

NAME = ".gitignore"
LINES_MAX = 100
CHARS_MAX = 100


def read_git_ignores(package: SourcePackage, paths: Iterable[str]) -> tuple[IgnoreLine, ...]:
    """Return the lines that count for the package, those of outer folders first; `paths` are the package's files."""
    if package.mode_source != "git":
        return ()
    above = PurePosixPath(package.path_in_git or package.path).parts
    found: list[IgnoreLine] = []
    for depth in range(len(above), 0, -1):
        folder = package.folder.parents[depth - 1] if depth <= len(package.folder.parents) else None
        below = "/".join(above[len(above) - depth :])
        found += _lines(folder, NAME, "../" * depth + NAME, below) if folder is not None else []
    for path in sorted((p for p in paths if posixpath.basename(p) == NAME), key=lambda p: p.count("/")):
        found += _lines(package.folder, path, path, posixpath.dirname(path))
    return tuple(found[:LINES_MAX])


def _lines(folder: Path, path: str, shown: str, below: str) -> Iterator[IgnoreLine]:
    text = (read_data(folder, path) or b"").decode("utf-8", "replace")
    for number, line in enumerate(text.splitlines()[:LINES_MAX], start=1):
        pattern = line.strip()
        if pattern and not pattern.startswith("#") and len(pattern) <= CHARS_MAX:
            yield IgnoreLine(file=shown, line=number, pattern=pattern, below=below)
