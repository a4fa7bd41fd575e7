"""Files that appear whole or not at all, and folders that are known to be writable before anything is run."""

from __future__ import annotations

import os
import secrets
import tempfile
from contextlib import suppress
from pathlib import Path

from grader.errors import OutputError


def atomic_write(path: Path, data: bytes) -> None:
    """Write `data` beside `path`, flush it to the disk, and rename it into place.

    A link stays a link, and what is no file (`/dev/null`, a pipe) is written to and stays what it is.
    Raises OutputError; then `path` is as it was before, and nothing is left beside it.
    """
    path = path.resolve() if path.is_symlink() else path
    if path.exists() and not path.is_file():
        _write_into(path, data)
        return
    beside = path.with_name(f".{path.name[:80]}.{secrets.token_hex(6)}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with beside.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise unwritable(path, error) from error
        raise


def _write_into(path: Path, data: bytes) -> None:
    try:
        with path.open("wb") as file:
            file.write(data)
    except OSError as error:
        raise unwritable(path, error) from error


def check_writable(folder: Path) -> None:
    """Raise OutputError where `folder` (which need not exist yet) cannot be written. Leaves nothing."""
    try:
        place = next(p for p in (folder, *folder.absolute().parents) if os.path.lexists(p))
        Path(tempfile.mkdtemp(prefix=".grader-", dir=place)).rmdir()
    except OSError as error:
        raise unwritable(folder, error) from error


def unwritable(path: Path, error: OSError) -> OutputError:
    """The one line for a file or folder that cannot be written."""
    reason = error.strerror or type(error).__name__
    return OutputError(f"cannot write {path}: {reason}", hint="choose another folder with --out")
