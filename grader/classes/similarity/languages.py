"""Which files are compared: programs in Python and C++. What catkin generates or everybody has alike is left out."""

from __future__ import annotations

import re
from pathlib import PurePosixPath
from typing import Literal

Language = Literal["python", "cpp"]

_CPP: tuple[str, ...] = (".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx")
SUFFIXES: dict[str, Language] = {".py": "python", **dict.fromkeys(_CPP, "cpp")}
GENERATED = frozenset({"build", "devel", "install", "logs", "__pycache__", ".git"})
ALIKE = frozenset({"setup.py", "__init__.py"})
_PYTHON = re.compile(rb"(\xef\xbb\xbf)?#![^\n]{0,200}python")


def language_of(path: str, data: bytes) -> Language | None:
    """The language of a package's file by its name, without a suffix by its first line; None for all that is not
    compared."""
    name = PurePosixPath(path)
    if name.name in ALIKE or GENERATED.intersection(name.parts[:-1]):
        return None
    if name.suffix:
        return SUFFIXES.get(name.suffix.lower())
    return "python" if _PYTHON.match(data) else None
