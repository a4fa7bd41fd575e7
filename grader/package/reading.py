"""Reading files that someone else wrote: nothing outside the package's folder, nothing without a limit."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from grader.model.file_fault import Fault

MARKUP_LIMIT_BYTES = 1_000_000
SOURCE_LIMIT_BYTES = 2_000_000
LEFT_OUT = frozenset(
    {"build", "devel", "install", ".git", ".hg", ".svn", ".catkin_tools", "__pycache__"},
)


class Unreadable(Exception):
    """Why a path gives no file. `kind` goes into a Fault, the text into its message."""

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind
        self.message = message


def printable(text: str) -> str:
    """Return a file name or other foreign text as valid Unicode: what is none becomes `\\udce9`."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def regular_file(folder: Path, path: str) -> Path:
    """Return the regular file that `path` leads to, links followed as long as they stay inside `folder`.

    Raises Unreadable.
    """
    try:
        (folder / path).stat()  # before realpath, which follows chains of links that no system follows
        real = os.path.realpath(folder / path, strict=True)
        mode = Path(real).stat().st_mode
    except OSError as error:
        raise _translate(error) from error
    if not Path(real).is_relative_to(os.path.realpath(folder)):
        raise Unreadable("OutsideLink", "is a link to a place outside the package")
    if not stat.S_ISREG(mode):
        raise Unreadable("NotAFile", "is a folder" if stat.S_ISDIR(mode) else "is not a regular file")
    return Path(real)


def _translate(error: OSError) -> Unreadable:
    if error.errno == errno.ELOOP:
        return Unreadable("LinkLoop", "is a link that leads back to itself")
    if error.errno in {errno.ENOENT, errno.ENOTDIR}:
        return Unreadable("Missing", "does not exist")
    return Unreadable(type(error).__name__, f"cannot be read: {error.strerror or error}")


def read_markup(folder: Path, path: str, limit_bytes: int = MARKUP_LIMIT_BYTES) -> bytes | Fault:
    """Return the bytes of a file of at most that size (1 MB), or the fault that keeps it from being read."""
    try:
        file = regular_file(folder, path)
        with file.open("rb") as stream:
            data = stream.read(limit_bytes + 1)
    except Unreadable as error:
        return _unread(folder, path, error)
    except OSError as error:
        return _unread(folder, path, _translate(error))
    if len(data) > limit_bytes:
        size = f"{limit_bytes // 1_000_000} MB" if limit_bytes >= 1_000_000 else f"{limit_bytes // 1_000} kB"
        return _unread(folder, path, Unreadable("TooLarge", f"is larger than {size} and was not read"))
    return data


def _unread(folder: Path, path: str, error: Unreadable) -> Fault:
    message = error.message
    if error.kind == "Missing" and (folder / path).is_symlink():
        message = "is a link to a file that does not exist"
    return Fault(
        file=printable(path),
        line=None,
        kind=error.kind,
        message=message,
        cause=f"`{printable(path)}` {message}",
    )
