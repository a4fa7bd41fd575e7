"""Archives that take long to make are kept for a day, in the cache folder of the user who tests."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

KEPT_S = 24 * 3600


def kept(name: str, make: Callable[[Path], None]) -> Path:
    """The archive of that name, made by `make` where there is none of today. Who tests beside it waits for it."""
    folder = _folder()
    with _locked(folder / f"{name.partition('-')[0]}.lock"):
        target = folder / name
        if not (target.exists() and time.time() - target.stat().st_mtime < KEPT_S):
            part = folder / f".{os.getpid()}.{name}"
            try:
                make(part)
                part.replace(target)
            finally:
                part.unlink(missing_ok=True)
    return target


def sweep(pattern: str, *, but: str) -> None:
    """Remove other archives of these names: nobody asks for them any more."""
    for path in _folder().glob(pattern):
        if path.name != but:
            path.unlink(missing_ok=True)


def _folder() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(home) / "ros-lab-grader-tests"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    with file.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
