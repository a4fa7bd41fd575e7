"""A file system for tests, in place of a bucket: its names are no paths, and only who registers it knows it."""

from __future__ import annotations

import os
from pathlib import Path

import fsspec
from fsspec.implementations.dirfs import DirFileSystem
from fsspec.implementations.local import LocalFileSystem


class Shelf(DirFileSystem):
    """`shelf://folder` is a folder below `$SHELF`."""

    protocol = "shelf"

    def __init__(self, **options: object) -> None:
        super().__init__(path=os.environ["SHELF"], fs=LocalFileSystem(auto_mkdir=True), **options)

    @classmethod
    def _strip_protocol(cls, path: str) -> str:
        return path.removeprefix("shelf://")


def register() -> None:
    """In this process."""
    fsspec.register_implementation("shelf", Shelf, clobber=True)


def on_shelf(folder: Path) -> list[str]:
    """The names of all files in it."""
    return sorted(path.name for path in folder.rglob("*") if path.is_file())
