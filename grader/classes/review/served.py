"""Files of a submission that the page may show: known names, opened without following any link."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import BinaryIO

from grader.results import EVIDENCE

REPORTS = {
    "report.html": "text/html",
    "report.md": "text/plain",
    "console.log": "text/plain",
    "junit.xml": "text/plain",
    "result.json": "text/plain",
}
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,150}")
FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
FILE = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
LISTED_MAX = 200


def open_report(folder: Path, name: str) -> BinaryIO | None:
    """One of `REPORTS`; None where there is none, or it is no file."""
    return _open(folder, (), name) if name in REPORTS else None


def open_evidence(folder: Path, name: str) -> BinaryIO | None:
    """A file of the evidence; None where there is none, or it is no file."""
    return _open(folder, (EVIDENCE,), name) if NAME.fullmatch(name) else None


def reports_of(folder: Path) -> list[str]:
    """Those of `REPORTS` that are there."""
    return [name for name in REPORTS if _exists(open_report(folder, name))]


def evidence_of(folder: Path) -> list[tuple[str, int]]:
    """The names and sizes in bytes of what `open_evidence` opens."""
    try:
        entries = [entry for entry in os.scandir(folder / EVIDENCE) if NAME.fullmatch(entry.name)]
        files = [entry for entry in entries if entry.is_file(follow_symlinks=False)]
        return sorted((entry.name, entry.stat(follow_symlinks=False).st_size) for entry in files)[:LISTED_MAX]
    except OSError:
        return []


def _exists(file: BinaryIO | None) -> bool:
    if file is not None:
        file.close()
    return file is not None


def _open(folder: Path, below: tuple[str, ...], name: str) -> BinaryIO | None:
    descriptors: list[int] = []
    try:
        descriptors.append(os.open(folder, FOLDER))
        for part in below:
            descriptors.append(os.open(part, FOLDER, dir_fd=descriptors[-1]))
        file = os.open(name, FILE, dir_fd=descriptors[-1])
    except OSError:
        return None
    finally:
        for descriptor in descriptors:
            os.close(descriptor)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        return None
    return os.fdopen(file, "rb")
