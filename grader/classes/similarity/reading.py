"""Each submission is read in a process of its own, with little memory and little time: what a file in it does to the
reader is done to its own submission."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import resource
import signal
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.context import ForkProcess
from pathlib import Path
from types import FrameType

from grader.classes.similarity.sources import Source, read_submission
from grader.classes.similarity.tokens import Text, read_text
from grader.errors import GraderError
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
