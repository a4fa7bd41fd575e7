"""The programs of a submission, out of its evidence, and those of the starter code: bounded, and no link followed."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.classes.similarity.languages import GENERATED, Language, language_of
from grader.errors import EvidenceError
from grader.evidence.reader import load_run
from grader.files import open_untrusted
from grader.model.similarity import NotCompared

PLACE = ("evidence", "package.mcap")
EVIDENCE_BYTES_MAX = 128 << 20
FILE_BYTES_MAX = 128 << 10
"""Far more than anyone writes for a lab; what tools generate is larger."""
SUBMISSION_BYTES_MAX = 512 << 10
FILES_MAX = 200
STARTER_FILES_MAX = 2_000


@dataclass(frozen=True, kw_only=True)
class Source:
    """A program's text."""

    path: str
    code: str
    language: Language


@dataclass(frozen=True, kw_only=True)
class Sources:
    """A submission's programs, and those files that cannot be compared."""

    files: tuple[Source, ...]
    left_out: tuple[NotCompared, ...]


def read_submission(name: str, folder: Path) -> Sources:
    """The judged files of the package in `folder/evidence/package.mcap`.

    Raises OSError where there is none, it is no file, or a link is on the way, EvidenceError where it cannot be read.
    """
    with open_untrusted(folder, *PLACE) as file:
        if os.fstat(file.fileno()).st_size > EVIDENCE_BYTES_MAX:
            raise EvidenceError(f"evidence/package.mcap is larger than {EVIDENCE_BYTES_MAX >> 20} MiB")
        attached = load_run(file).attachments
    return _chosen(name, sorted(attached.items()))


def read_starter(folder: Path) -> Sources:
    """The programs below `folder`, or the one file that it is. Raises OSError."""
    if folder.is_file():
        return _chosen("", [(folder.name, _head(folder))])
    found = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name not in GENERATED)
        paths = (Path(place, name) for name in sorted(names))
        found += [path for path in paths if stat.S_ISREG(path.lstat().st_mode)]
        if len(found) > STARTER_FILES_MAX:
            break
    return _chosen(
        "", [(path.relative_to(folder).as_posix(), _head(path)) for path in found[:STARTER_FILES_MAX]]
    )


def _head(path: Path) -> bytes:
    """What of a file can be compared, and one byte more where there is more."""
    with path.open("rb") as file:
        return file.read(FILE_BYTES_MAX + 1)


def _chosen(name: str, files: list[tuple[str, bytes]]) -> Sources:
    """Small ones first: large ones take nobody's room."""
    chosen: list[Source] = []
    left_out: list[NotCompared] = []
    room_bytes = SUBMISSION_BYTES_MAX
    for path, data, language in sorted(_programs(files), key=lambda one: len(one[1])):
        reason = _why_not(data, room_bytes, len(chosen))
        if reason:
            left_out.append(NotCompared(id=name, file=path, reason=reason))
            continue
        room_bytes -= len(data)
        chosen.append(Source(path=path, code=data.decode(errors="replace"), language=language))
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
