"""Writes an archive's entries below one folder, and refuses an archive that tries to write anywhere else."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import IO

from grader.errors import SubmissionError
from grader.intake.limits import Limits, Meter
from grader.intake.names import listing, printable
from grader.intake.tree import NO_CONTENT

_LONGEST_TARGET = 4096


class Unpacker:
    """`executable` maps each file written to its executable bit, None where the archive does not tell.

    Files come first and links last, so that nothing is ever written through a link.
    """

    def __init__(self, root: Path, *, name: str, limits: Limits, packed_bytes: int) -> None:
        self.executable: dict[str, bool | None] = {}
        self._root = root
        self._name = name
        self._meter = Meter(limits, name=name, packed_bytes=packed_bytes)
        self._links: dict[str, str] = {}

    def admit(self, name: str, size_bytes: int = 0) -> str | None:
        """The path below the root for an entry's name; None for what is not looked at (`.git`, `__MACOSX`).

        Raises SubmissionError for a name that leads outside and for more than the limits allow.
        """
        self._meter.entry(name)
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if name.startswith("/") or ".." in parts or re.match(r"[A-Za-z]:/", name):
            self.refuse(f"the entry {printable(name)!r} leads outside of it")
        if not parts or NO_CONTENT.intersection(parts) or parts[-1].startswith("._"):
            return None
        self._meter.data(size_bytes)
        return "/".join(parts)

    def folder(self, path: str) -> None:
        (self._root / path).mkdir(parents=True, exist_ok=True)

    def file(self, path: str, content: IO[bytes], *, executable: bool | None) -> None:
        target = self._free(path)
        with target.open("xb") as out:
            shutil.copyfileobj(content, out)
        target.chmod(0o755 if executable else 0o644)
        self.executable[path] = executable

    def hard_link(self, path: str, name: str) -> None:
        """A second name for a file that the archive has already brought."""
        first = os.path.normpath(name)
        if first in self._links:
            self.link(path, self._links[first])
            return
        if first not in self.executable:
            self.refuse(f"the entry {printable(path)!r} is a link to what is not in it")
        if first != path:
            os.link(self._root / first, self._free(path))
            self.executable[path] = self.executable[first]

    def link(self, path: str, target: str) -> None:
        if len(target) > _LONGEST_TARGET or "\0" in target:
            self.refuse(f"the link {printable(path)!r} has no usable target")
        self._links[path] = target

    def finish(self) -> list[str]:
        """Makes the links and gives the hints on those that were left out because they point outside.

        A workspace holds such links (`src/CMakeLists.txt` points into `/opt/ros`), so they are no offence.
        """
        for path, target in self._links.items():
            self._make_link(path, target)
        outside: list[str] = []
        while stray := [path for path in self._links if path not in outside and self._leads_out(path)]:
            for path in stray:
                (self._root / path).unlink()
            outside += stray
        if not outside:
            return []
        return [f"links that point outside the archive were left out: {listing(sorted(outside))}"]

    def _make_link(self, path: str, target: str) -> None:
        place = self._root / path
        if place.is_dir() and not place.is_symlink():
            self.refuse(f"the entry {printable(path)!r} is a link and a folder at once")
        place = self._free(path)
        if place.parent.resolve() != self._root.resolve().joinpath(*path.split("/")[:-1]):
            self.refuse(f"the entry {printable(path)!r} lies behind a link")
        place.symlink_to(target)

    def refuse(self, why: str) -> None:
        raise SubmissionError(
            f"{self._name} is not unpacked: {why}",
            hint="Pack the package's folder anew, as a plain .zip or .tar.gz.",
        )

    def _leads_out(self, path: str) -> bool:
        place = self._root / path
        real = Path(os.path.realpath(place))  # Path.resolve raises for a loop, before Python 3.13
        return place.readlink().is_absolute() or not real.is_relative_to(self._root.resolve())

    def _free(self, path: str) -> Path:
        """The place for an entry; a later entry of the same name replaces the one before."""
        target = self._root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.unlink(missing_ok=True)
        self.executable.pop(path, None)
        return target
