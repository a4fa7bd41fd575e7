"""Files of a package that nobody looks at: what builds, editors, git and the grader itself leave there. Pure."""

from __future__ import annotations

import re
from pathlib import PurePosixPath

FOLDERS = frozenset(
    {
        "__pycache__", ".git", ".hg", ".svn", ".tox", ".venv", ".idea", ".vscode", "node_modules", ".mypy_cache",
        ".pytest_cache", ".ruff_cache", ".hypothesis", ".catkin_tools", "build", "devel", "install", "logs",
        "grader-results",
    }
)  # fmt: skip
NAMES = re.compile(
    r"""
      \.py[cod]$ | \.log$ | \.active$                       # Python's, what ROS is still writing
    | ~$ | \.sw[a-z]$ | ^4913$ | \.(bak|orig|tmp|part)$     # vim, and many others
    | ^\.?\# | ^flycheck_ | ^flymake_                       # Emacs
    | \.kate-swp$ | ^\.goutputstream- | ^\.~lock | ___jb_\w+___$
    | ^\.DS_Store$ | ^\.nfs | ^\.fuse_hidden
    """,
    re.VERBOSE,
)


def ignored(path: str) -> bool:
    """Whether a path, posix and relative to the package's folder, is of no interest."""
    parts = PurePosixPath(path).parts
    return any(part in FOLDERS for part in parts) or (bool(parts) and NAMES.search(parts[-1]) is not None)
