"""Where the package lies in its repository, which results do not say: looked for around the current folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from grader.intake import find_packages
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation


def package_prefix(result: GradingResult, here: Path) -> str | None:
    """The package's folder relative to the repository around `here` (or to `here`), `.` for the root itself.

    It is the one of that name in which all files are that the result cites. None where there is none.
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
