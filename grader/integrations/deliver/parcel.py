"""Files to hand over, as a zip or as a folder. The same files give the same bytes."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

from grader.files import atomic_write

LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""The first date that a zip can carry: nothing of when it was made is in it."""


class Parcel:
    """Files by their path, posix and relative."""

    def __init__(self) -> None:
        self._files: dict[str, tuple[bytes, bool]] = {}

    def add(self, path: str, data: bytes, *, executable: bool = False) -> None:
        """Add a file, or put it in the place of one of the same path."""
        self._files[path] = (data, executable)

    def add_file(self, path: str, file: Path) -> None:
        """Add a file of the disk, with its executable bit."""
        self.add(path, file.read_bytes(), executable=os.access(file, os.X_OK))

    def entries(self) -> Iterator[tuple[str, bytes, bool]]:
        """Path, content and executable bit of each file, in order of the paths."""
        for path, (data, executable) in sorted(self._files.items()):
            yield path, data, executable

    def zipped(self) -> bytes:
        """A zip with the files' modes in it."""
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for path, data, executable in self.entries():
                about = zipfile.ZipInfo(path, LONG_AGO)
                about.create_system = 3  # Unix, whatever this is: only then do modes count
                about.compress_type = zipfile.ZIP_DEFLATED
                about.external_attr = _mode(executable=executable) << 16
                archive.writestr(about, data)
        return out.getvalue()

    def write(self, folder: Path) -> None:
        """Write the files below `folder`, each whole or not at all. Raises OutputError."""
        for path, data, executable in self.entries():
            target = folder / path
            atomic_write(target, data, public=True)
            target.chmod(_mode(executable=executable) & 0o777)


def _mode(*, executable: bool) -> int:
    return 0o100755 if executable else 0o100644
