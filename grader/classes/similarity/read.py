"""Each submission is read in a process of its own, with little memory and little time: what a file in it does to the
reader is done to its own submission."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import re
import resource
import signal
import stat
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.context import ForkProcess
from pathlib import Path, PurePosixPath
from types import FrameType
from typing import Literal

from grader.classes.similarity.tokens import Text, read_text
from grader.errors import EvidenceError, GraderError
from grader.evidence.reader import load_run
from grader.model.similarity import NotCompared

FILE_S = 5.0
"""Of the processor's time, as the next: a busy machine leaves no file out."""
SUBMISSION_S = 30.0
WALL_S = 300.0
MEMORY_BYTES = 2 << 30
"""Of addresses, beside those that the process has from the one that it was forked from."""
ANSWER_BYTES_MAX = 64 << 20


@dataclass(frozen=True, kw_only=True)
class Read:
    """A submission's fingerprints, and what of it could not be read."""

    texts: tuple[Text, ...]
    left_out: tuple[NotCompared, ...]


class _TooLong(Exception):
    """A file took too long."""


def read_all(folders: Mapping[str, Path], jobs: int) -> Iterator[tuple[str, Read]]:
    """Every submission's fingerprints, `jobs` at a time, each as it comes."""
    waiting = list(reversed(tuple(folders.items())))
    running: dict[connection.Connection, tuple[str, ForkProcess, float]] = {}
    while waiting or running:
        while waiting and len(running) < jobs:
            name, folder = waiting.pop()
            answer, process = _start(name, folder)
            running[answer] = (name, process, time.monotonic() + WALL_S)
        for answer in _ready(running):
            name, process, _ = running.pop(answer)
            yield name, _answer(name, answer, process)


def texts_of(name: str, files: tuple[Source, ...]) -> Read:
    """The fingerprints of these files, each within `FILE_S`."""
    tried = [_tried(name, file) for file in files]
    return Read(
        texts=tuple(one for one in tried if isinstance(one, Text)),
        left_out=tuple(one for one in tried if isinstance(one, NotCompared)),
    )


def _tried(name: str, file: Source) -> Text | NotCompared:
    try:
        return _timed(file)
    except _TooLong:
        reason = f"took longer than {FILE_S:g} s to read"
    except MemoryError:
        reason = "takes too much memory to read"
    except Exception as error:  # noqa: BLE001 - whatever a lexer does, the other files are compared
        reason = f"could not be read: {type(error).__name__}"
    return NotCompared(id=name, file=file.path, reason=reason)


def _start(name: str, folder: Path) -> tuple[connection.Connection, ForkProcess]:
    fork = multiprocessing.get_context("fork")
    here, there = fork.Pipe(duplex=False)
    process = fork.Process(target=_work, args=(name, folder, there), daemon=True)
    process.start()
    there.close()
    return here, process


def _work(name: str, folder: Path, answer: connection.Connection) -> None:
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = _addresses_bytes() + MEMORY_BYTES
    most = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (int(SUBMISSION_S), int(SUBMISSION_S) + 1))
    answer.send_bytes(pickle.dumps(_read(name, folder)))
    os._exit(0)


def _addresses_bytes() -> int:
    """What this process has mapped already: proc(5), statm, the first number, in pages."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except OSError:  # no Linux
        return 0


def _read(name: str, folder: Path) -> Read:
    try:
        sources = read_submission(name, folder)
    except GraderError as error:
        return _unread(name, error.message)
    except FileNotFoundError:
        return _unread(name, "no evidence of it is here")
    except OSError as error:
        return _unread(name, f"its evidence cannot be opened: {error.strerror}")
    except MemoryError:
        return _unread(name, "takes too much memory to read")
    except Exception as error:  # noqa: BLE001 - whatever it is, the others are compared
        return _unread(name, f"could not be read: {type(error).__name__}")
    read = texts_of(name, sources.files)
    return Read(texts=read.texts, left_out=sources.left_out + read.left_out)


def _timed(file: Source) -> Text:
    """Regular expressions look out for signals, so that even one that never ends is interrupted."""
    before = signal.signal(signal.SIGVTALRM, _too_long)
    signal.setitimer(signal.ITIMER_VIRTUAL, FILE_S)
    try:
        return read_text(file.path, file.code, file.language)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _too_long(_number: int, _frame: FrameType | None) -> None:
    raise _TooLong


def _ready(
    running: Mapping[connection.Connection, tuple[str, ForkProcess, float]],
) -> list[connection.Connection]:
    """Those that have answered, have ended, or have had their time."""
    soonest = min(until for _, _, until in running.values())
    done = connection.wait(list(running), timeout=max(0.0, soonest - time.monotonic()))
    late = [answer for answer, (_, _, until) in running.items() if until <= time.monotonic()]
    return list(dict.fromkeys([*(one for one in done if isinstance(one, connection.Connection)), *late]))


def _answer(name: str, answer: connection.Connection, process: ForkProcess) -> Read:
    read = None
    with answer, suppress(EOFError, OSError):
        if answer.poll():
            read = pickle.loads(answer.recv_bytes(ANSWER_BYTES_MAX))  # noqa: S301 - from our own process, which runs no code of others
    process.kill()
    process.join()
    if isinstance(read, Read):
        return read
    return _unread(name, "reading it took too long or too much memory")


def _unread(name: str, reason: str) -> Read:
    return Read(texts=(), left_out=(NotCompared(id=name, reason=reason),))


# [classes.similarity.sources] The programs of a submission, out of its evidence, and those of the starter code: bounded, and no link followed.

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

    Raises OSError where there is none, or a link is on the way, EvidenceError where it cannot be read.
    """
    with os.fdopen(_opened(folder), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise EvidenceError("evidence/package.mcap is no file")
        if status.st_size > EVIDENCE_BYTES_MAX:
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


def _opened(folder: Path) -> int:
    """The evidence's descriptor, with no link on the way from the submission's folder on."""
    place = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        for part, kind in zip(PLACE, (os.O_DIRECTORY, os.O_NONBLOCK), strict=True):
            inner = os.open(part, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | kind, dir_fd=place)
            os.close(place)
            place = inner
    except OSError:
        os.close(place)
        raise
    return place


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


# [classes.similarity.languages] Which files are compared: programs in Python and C++. What catkin generates or everybody has alike is left out.

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
