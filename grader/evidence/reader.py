"""Reads evidence files: our own, and MCAP or bag files that other tools recorded from ROS 1."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from pydantic import ValidationError
from zstandard import ZstdError

from grader.errors import EvidenceError
from grader.evidence.container import MAX_FILE_BYTES, ContainerError
from grader.evidence.loading import Loading
from grader.evidence.memory_budget import LESS, NoRoom, Room
from grader.evidence.run import Run
from grader.model.package import PackageFacts

SUFFIXES = {".mcap", ".bag"}
MAGIC = b"\x89MCAP0\r\n"
BAG_MAGIC = b"#ROSBAG V"
_DAMAGE = (
    McapError,
    ZstdError,
    struct.error,
    ValueError,
    RuntimeError,
    EOFError,
    KeyError,
    OverflowError,
    MemoryError,
)


def load_run(source: Path | BinaryIO, room: Room | None = None) -> Run:
    """One recorded run. A file without the grader's metadata is a real-time run named after the file.

    `room` is shared with what is loaded beside it. Raises EvidenceError, in one line that names the file, for
    whatever cannot be read to its end.
    """
    room = room or Room()
    if not isinstance(source, Path):
        name = Path(str(getattr(source, "name", "evidence.mcap"))).name
        return _load(name, BytesIO(source.read(MAX_FILE_BYTES + 1)), room)
    with _readable(source), source.open("rb") as file:
        head = file.read(len(BAG_MAGIC))
        file.seek(0)
        if head == BAG_MAGIC:
            from grader.evidence.bag import load_bag  # noqa: PLC0415 - few submissions hold a bag

            return load_bag(source, room)
        return _load(source.name, file, room, shown=str(source))


def load_evidence(paths: Sequence[Path]) -> dict[str, Run]:
    """The runs of these files by scenario; a folder stands for its recordings and those of `evidence/` in it.

    Recordings are `*.mcap` and `*.bag`. Raises EvidenceError where nothing is found, a file cannot be read,
    another tool's recording is empty, or two files hold the same scenario.
    """
    runs: dict[str, Run] = {}
    origin: dict[str, Path] = {}
    room = Room()
    for path in _files(paths):
        run = load_run(path, room)
        if run.foreign and not any(channel.messages for channel in run.channels):
            raise EvidenceError(f"{path}: holds no messages", hint="record while the nodes run")
        if run.scenario in runs:
            raise EvidenceError(
                f"{origin[run.scenario]} and {path} both hold the scenario {run.scenario!r}",
                hint="give the evidence of one submission at a time",
            )
        runs[run.scenario], origin[run.scenario] = run, path
    return runs


def package_facts(run: Run) -> PackageFacts:
    """The package facts that the run carries (`package.mcap` does). Raises EvidenceError without any."""
    if run.package_json is None:
        raise EvidenceError(
            f"{run.evidence}: holds no package facts", hint="give package.mcap of the same recording"
        )
    try:
        return PackageFacts.read_json(run.package_json)
    except ValidationError as error:
        raise EvidenceError(f"{run.evidence}: the package facts cannot be read: {_first(error)}") from error


def _load(name: str, stream: BinaryIO, room: Room, *, shown: str = "") -> Run:
    shown = shown or name
    size_bytes = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    if size_bytes > MAX_FILE_BYTES:
        raise EvidenceError(f"{shown}: larger than {MAX_FILE_BYTES >> 20} MiB")
    if not size_bytes:
        raise EvidenceError(f"{shown}: the file is empty")
    try:
        return Loading(name, room, shown).read(stream)
    except ValidationError as error:
        raise EvidenceError(
            f"{shown}: a record of the grader's own cannot be read: {_first(error)}"
        ) from error
    except NoRoom as error:
        raise EvidenceError(f"{shown}: {error}", hint=LESS) from error
    except ContainerError as error:
        raise EvidenceError(f"{shown}: not sound MCAP: {error}") from error
    except _DAMAGE as error:
        wrong, hint = _damage(stream)
        raise EvidenceError(f"{shown}: {wrong}", hint=hint) from error


def _damage(stream: BinaryIO) -> tuple[str, str]:
    """What is wrong, and what to do."""
    stream.seek(0)
    head = stream.read(32)
    stream.seek(-min(stream.seek(0, os.SEEK_END), len(MAGIC)), os.SEEK_END)
    tail = stream.read()
    if head.startswith(b"version https://git-lfs"):
        return "only a pointer of Git LFS, the recording itself is not here", "`git lfs pull` fetches it"
    if head.startswith(b"SQLite format 3"):
        return "a bag of ROS 2, and this grader reads those of ROS 1", "record with ROS 1: `rosbag record`"
    again = "record it again, or copy it again"
    if not head.startswith(MAGIC[:5]):
        return "not an MCAP file and not a bag", again
    return ("damaged" if tail == MAGIC else "cut short: it has no end"), again


def _first(error: ValidationError) -> str:
    """The first of pydantic's complaints in one line."""
    fault = error.errors(include_url=False, include_input=False)[0]
    place = ".".join(str(part) for part in fault["loc"])
    return f"{error.title}{'.' + place if place else ''}: {fault['msg']}"


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        if path.exists() and not path.is_file():
            raise EvidenceError(f"{path}: not a file")
        if path.exists() and path.stat().st_size > MAX_FILE_BYTES:
            raise EvidenceError(f"{path}: larger than {MAX_FILE_BYTES >> 20} MiB")
        yield
    except OSError as error:
        raise EvidenceError(f"{path}: {error.strerror or type(error).__name__}") from error


def _files(paths: Iterable[Path]) -> list[Path]:
    found: dict[Path, Path] = {}
    for path in paths:
        inside = _recordings(path) if path.is_dir() else [path]
        if not inside:
            raise EvidenceError(
                f"{path}: no evidence (*.mcap, *.bag) in this folder or in evidence/ below it"
            )
        for file in inside:
            found.setdefault(file.resolve(), file)
    if not found:
        raise EvidenceError(
            "no evidence given", hint="name evidence files or a folder of a graded submission"
        )
    return list(found.values())


def _recordings(folder: Path) -> list[Path]:
    with _listable(folder):
        places = (folder, folder / "evidence")
        found = [f for p in places for f in sorted(p.glob("*")) if f.suffix in SUFFIXES]
        return [f for f in found if f.is_file() and not f.name.startswith(".")]


@contextmanager
def _listable(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise EvidenceError(f"{folder}: {error.strerror or type(error).__name__}") from error
