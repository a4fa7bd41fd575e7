"""Which files are compared: the programs in Python and C++ of a submission's evidence, and of the starter code.

What catkin generates, or everybody has alike, is left out. Sizes are bounded, and no link is followed.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from grader.errors import EvidenceError
from grader.evidence.reader import load_run
from grader.files import open_untrusted
from grader.model.batch import NotCompared

Language = Literal["python", "cpp"]

_CPP: tuple[str, ...] = (".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx")
SUFFIXES: dict[str, Language] = {".py": "python", **dict.fromkeys(_CPP, "cpp")}
GENERATED = frozenset({"build", "devel", "install", "logs", "__pycache__", ".git"})
ALIKE = frozenset({"setup.py", "__init__.py"})
_PYTHON = re.compile(rb"(\xef\xbb\xbf)?#![^\n]{0,200}python")
PLACE = ("evidence", "package.mcap")
EVIDENCE_BYTES_MAX = 128 << 20
FILE_BYTES_MAX = 128 << 10
"""Far more than anyone writes for a lab; what tools generate is larger."""
SUBMISSION_BYTES_MAX = 512 << 10
FILES_MAX = 200
STARTER_FILES_MAX = 2_000


@dataclass(frozen=True, kw_only=True)
class ProgramText:
    """A program's text, at `path` of its package."""

    path: str
    code: str
    language: Language


@dataclass(frozen=True, kw_only=True)
class Sources:
    """A submission's programs, and the files that cannot be compared."""

    files: tuple[ProgramText, ...]
    left_out: tuple[NotCompared, ...]


def read_submission(name: str, folder: Path) -> Sources:
    """Return the programs among the judged files of the package in `folder/evidence/package.mcap`.

    Raises OSError if there is none, or a link is on the way, EvidenceError if it cannot be read.
    """
    with open_untrusted(folder, *PLACE) as file:
        if os.fstat(file.fileno()).st_size > EVIDENCE_BYTES_MAX:
            raise EvidenceError(f"evidence/package.mcap is larger than {EVIDENCE_BYTES_MAX >> 20} MiB")
        attached = load_run(file).attachments
    return _choose(name, sorted(attached.items()))


def read_starter(folder: Path) -> Sources:
    """Return the programs below `folder`, or the one file that it is. Raises OSError."""
    if folder.is_file():
        return _choose("", [(folder.name, _read_head(folder))])
    found = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name not in GENERATED)
        paths = (Path(place, name) for name in sorted(names))
        found += [path for path in paths if stat.S_ISREG(path.lstat().st_mode)]
        if len(found) > STARTER_FILES_MAX:
            break
    return _choose(
        "", [(path.relative_to(folder).as_posix(), _read_head(path)) for path in found[:STARTER_FILES_MAX]]
    )


def _read_head(path: Path) -> bytes:
    """Read what can be compared of a file, and one byte more if there is more."""
    with path.open("rb") as file:
        return file.read(FILE_BYTES_MAX + 1)


def _choose(name: str, files: list[tuple[str, bytes]]) -> Sources:
    """Take small programs first, so that large ones do not take their room."""
    chosen: list[ProgramText] = []
    left_out: list[NotCompared] = []
    room_bytes = SUBMISSION_BYTES_MAX
    for path, data, language in sorted(_programs(files), key=lambda one: len(one[1])):
        reason = _why_not(data, room_bytes, len(chosen))
        if reason:
            left_out.append(NotCompared(id=name, file=path, reason=reason))
            continue
        room_bytes -= len(data)
        chosen.append(ProgramText(path=path, code=data.decode(errors="replace"), language=language))
    chosen.sort(key=lambda one: one.path)
    return Sources(files=tuple(chosen), left_out=tuple(left_out[:FILES_MAX]))


def _programs(files: list[tuple[str, bytes]]) -> Iterator[tuple[str, bytes, Language]]:
    for path, data in files:
        language = language_of(path, data)
        if language is not None:
            yield path, data, language


def _why_not(data: bytes, room_bytes: int, count: int) -> str:
    if len(data) > FILE_BYTES_MAX:
        return f"larger than {FILE_BYTES_MAX >> 10} KiB"
    if b"\0" in data:
        return "not text"
    if len(data) > room_bytes:
        return f"the submission's programs are larger than {SUBMISSION_BYTES_MAX >> 10} KiB together"
    return f"more than {FILES_MAX} programs" if count >= FILES_MAX else ""


def language_of(path: str, data: bytes) -> Language | None:
    """Return the language of a package's file by its suffix, or by its first line; None if it is not compared."""
    name = PurePosixPath(path)
    if name.name in ALIKE or GENERATED.intersection(name.parts[:-1]):
        return None
    if name.suffix:
        return SUFFIXES.get(name.suffix.lower())
    return "python" if _PYTHON.match(data) else None
