"""Files that are written piece by piece, and appear whole or not at all."""

from __future__ import annotations

import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from grader.files import make_folder, new_file, unwritable


@contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """A new file to write to, beside `target`; it takes its place in the end, flushed to the disk.

    It is for its owner alone, whatever the umask. A link stays a link, and what is no file (`/dev/stdout`, a pipe) gets
    a copy. Raises OutputError, or HostError where the disk gives out; then `target` is as it was before, and nothing is
    left beside it.
    """
    target = target.resolve() if target.is_symlink() else target
    special = target.exists() and not target.is_file()
    folder = Path(tempfile.gettempdir()) if special else target.parent
    beside = folder / f".{target.name[:80]}.{secrets.token_hex(6)}"
    try:
        make_folder(folder)
        new_file(beside).close()
        yield beside
        _placed(beside, target, special=special)
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        with suppress(OSError):
            beside.unlink()


def _placed(beside: Path, target: Path, *, special: bool) -> None:
    if special:
        with beside.open("rb") as source, target.open("wb") as place:
            shutil.copyfileobj(source, place)
        return
    with beside.open("rb") as written:
        os.fsync(written.fileno())
    beside.replace(target)
