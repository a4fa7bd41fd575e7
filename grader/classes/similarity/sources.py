"""`compare` finds near-identical submissions; `write_similarity` writes them down.

Compared are the programs in Python and C++ of a submission's evidence, without what catkin generates or everybody has
alike: no link is followed, and sizes are bounded.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from grader.errors import EvidenceError, SubmissionError, UsageError
from grader.evidence.reader import load_run
from grader.files import atomic_write, open_untrusted, temporary_folder
from grader.installable import require_extra
from grader.intake.archive import unpack
from grader.intake.limits import IntakeLimits
from grader.model.batch import Lines, NotCompared, Similarity
from grader.report.text import csv_text, json_text

THRESHOLD = 0.8
HEAD = (
    "a", "name_a", "b", "name_b", "similarity_a_percent", "similarity_b_percent", "lines_a", "lines_b", "files"
)  # fmt: skip


def compare(
    folders: Mapping[str, Path],
    *,
    starter: Sequence[Path] = (),
    groups: Mapping[str, str] | None = None,
    threshold: float = THRESHOLD,
    jobs: int = 2,
) -> Similarity:
    """Return which submissions are nearly the same. `folders` are their folders of results, by id.

    What is in `starter` (folders, archives, single files) is no one's own. Two of one group (`groups` by id) are not
    named. `threshold` is the share (0 to 1) of the one's own code that is in the other, `jobs` how many are read side
    by side.

    Raises UsageError without `copydetect` and for starter code that cannot be read.
    """
    require_extra("similarity", "comparing submissions", "copydetect")
    from grader.classes.similarity.comparison import compare_class  # noqa: PLC0415 - of the extra `similarity`

    with temporary_folder("source") as place:
        given = [_unpack(path, place / str(number)) for number, path in enumerate(starter)]
        whole = {name: folder.absolute() for name, folder in folders.items()}
        return compare_class(whole, given, groups or {}, threshold=threshold, jobs=jobs)


def _unpack(path: Path, into: Path) -> Path:
    """Return the folder that an archive becomes; folders and programs stay where they are."""
    if not path.exists():
        raise UsageError(f"--starter {path}: not found", hint="name a folder, an archive or a program")
    if path.is_dir() or path.suffix in {".py", ".cpp", ".cc", ".h", ".hpp"}:
        return path.absolute()
    try:
        unpack(path, into, IntakeLimits())
    except SubmissionError as error:
        raise UsageError(f"--starter {error.message}", hint=error.hint) from error
    except OSError as error:
        raise UsageError(f"--starter {path}: cannot be read: {error.strerror}") from error
    return into


def write_similarity(
    similarity: Similarity, folder: Path, names: Mapping[str, str] | None = None
) -> tuple[Path, ...]:
    """Write `similarity.json` and `similarity.csv` into `folder`; return their paths. `names` are the students', by id.

    Raises OutputError.
    """
    rows = [HEAD, *_rows(similarity, names or {})]
    files = {
        "similarity.json": json_text(similarity.model_dump(mode="json", by_alias=True)),
        # with a byte order mark, by which Excel knows UTF-8
        "similarity.csv": "\ufeff" + csv_text(rows),
    }
    for name, text in files.items():
        atomic_write(folder / name, text.encode())
    return tuple(folder / name for name in files)


def percent(share: float) -> int:
    """Return whole percent, and never 100 if anything is missing."""
    return int(share * 100)


def stretches(lines: Lines) -> str:
    """Return lines as `3-9, 12`."""
    return ", ".join(str(first) if first == last else f"{first}-{last}" for first, last in lines)


def _rows(similarity: Similarity, names: Mapping[str, str]) -> Iterator[tuple[str | float, ...]]:
    for pair in similarity.pairs:
        shares = (percent(pair.similarity_a), percent(pair.similarity_b))
        known = (pair.a, names.get(pair.a, ""), pair.b, names.get(pair.b, ""))
        files = (
            f"{match.file_a}:{stretches(match.lines_a)} ~ {match.file_b}:{stretches(match.lines_b)}"
            for match in pair.files
        )
        yield (*known, *shares, pair.lines_a, pair.lines_b, "; ".join(files))


Language = Literal["python", "cpp"]

_CPP: tuple[str, ...] = (".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx")
SUFFIXES: dict[str, Language] = {".py": "python", **dict.fromkeys(_CPP, "cpp")}
GENERATED = frozenset({"build", "devel", "install", "logs", "__pycache__", ".git"})
ALIKE = frozenset({"setup.py", "__init__.py"})  # what catkin's instructions make alike in every package
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
    programs = [(path, data, found) for path, data in files if (found := language_of(path, data))]
    for path, data, language in sorted(programs, key=lambda one: len(one[1])):
        reason = _why_not(data, room_bytes, len(chosen))
        if reason:
            left_out.append(NotCompared(id=name, file=path, reason=reason))
            continue
        room_bytes -= len(data)
        chosen.append(ProgramText(path=path, code=data.decode(errors="replace"), language=language))
    chosen.sort(key=lambda one: one.path)
    return Sources(files=tuple(chosen), left_out=tuple(left_out[:FILES_MAX]))


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
