"""Files of a submission that the page may show: known names, opened without following any link."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import BinaryIO

from grader.files import open_untrusted
from grader.results import EVIDENCE

REPORTS = {
    "report.html": "text/html",
    "report.md": "text/plain",
    "console.log": "text/plain",
    "junit.xml": "text/plain",
    "result.json": "text/plain",
}
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,150}")
LISTED_MAX = 200


def open_report(folder: Path, name: str) -> BinaryIO | None:
    """One of `REPORTS`; None where there is none, or it is no file."""
    return _open(folder, name) if name in REPORTS else None


def open_evidence(folder: Path, name: str) -> BinaryIO | None:
    """A file of the evidence; None where there is none, or it is no file."""
    return _open(folder, EVIDENCE, name) if NAME.fullmatch(name) else None


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


def _open(folder: Path, *below: str) -> BinaryIO | None:
    try:
        return open_untrusted(folder, *below)
    except OSError:
        return None
