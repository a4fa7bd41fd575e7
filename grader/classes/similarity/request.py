"""What the comparing process is asked."""

from __future__ import annotations

from pathlib import Path

from grader.model.record import Record


class Request(Record):
    """`folders` of results by id; `starter` are folders and files on this machine; `threshold` is a share, 0 to 1."""

    folders: dict[str, Path]
    starter: tuple[Path, ...]
    groups: dict[str, str]
    threshold: float
    jobs: int
