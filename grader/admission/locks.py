"""Locked files: shared by many or held by one, and free again when their holder ends (flock(2))."""

from __future__ import annotations

import os
from pathlib import Path

from typing_extensions import Self

from grader.files import lock


class FileLock:
    """An open file that can be locked. Each object is a holder of its own, within one process too.

    Raises OSError where the file cannot be opened or its file system knows no locks.
    """

    def __init__(self, path: Path) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        self._descriptor = os.open(path, flags, 0o600)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def take(self, *, shared: bool = False) -> bool:
        """Lock it, or change how it is locked; False, and not locked, where somebody else's lock is in the way."""
        return lock(self._descriptor, shared=shared)

    def close(self) -> None:
        """Give it free; a second time without effect."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
