"""Writes an archive's entries below one folder, and refuses an archive that tries to write anywhere else."""

from __future__ import annotations

import errno
import os
import re
import shutil
from pathlib import Path
from typing import IO

from grader.errors import SubmissionError
from grader.intake.limits import IntakeLimits, Meter
from grader.intake.names import brief, listing
from grader.intake.tree import NO_CONTENT

_LONGEST_TARGET = 4095
_LONGEST_NAME_BYTES = 255
_CHUNK_BYTES = 1 << 16
# As Windows reads a name, whatever the system that packed it.
_OUTSIDE = re.compile(r"^[A-Za-z]:[/\\]|(^|[/\\])\.\.\\|\\\.\.($|[/\\])|^\\")


class Unpacker:
    """`executable` maps each file written to its executable bit, None where the archive does not tell.

    Files come first and links last, so that nothing is ever written through a link.
    """

    def __init__(self, root: Path, *, name: str, limits: IntakeLimits) -> None:
        self.executable: dict[str, bool | None] = {}
        self._root = root
        self._name = name
        self._limits = limits
        self._meter = Meter(limits, name=name)
        self._sizes: dict[str, int] = {}
        self._links: dict[str, str] = {}
        self._large: list[str] = []
        self._unnamed: list[str] = []

    def admit(self, name: str, size_bytes: int = 0) -> str | None:
        """Return the path below the root for an entry's name; None for what is not looked at (`.git`, `__MACOSX`) and
        for what is left out: a file too large, a name that no disk takes.

        Raises SubmissionError for a name that leads outside and for more than the limits allow.
        """
        self._meter.entry(name)
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if name.startswith("/") or ".." in parts or _OUTSIDE.search(name):
            self.refuse(f"the entry '{brief(name)}' leads outside of it")
        if not parts or NO_CONTENT.intersection(parts) or parts[-1].startswith("._"):
            return None
        path = "/".join(parts)
        if "\0" in name or any(len(os.fsencode(part)) > _LONGEST_NAME_BYTES for part in parts):
            self._unnamed.append(path)
            return None
        if not self._meter.has_room(path, size_bytes):
            self._large.append(path)
            return None
        self._meter.folders(path)
        self._meter.data(size_bytes)
        return path

    def folder(self, path: str) -> None:
        """Make a folder, and those on the way to it."""
        self._meter.folders(f"{path}/")
        (self._root / path).mkdir(parents=True, exist_ok=True)

    def file(self, path: str, content: IO[bytes], *, executable: bool | None) -> None:
        """Write a file."""
        target = self._free(path)
        with target.open("xb") as out:
            shutil.copyfileobj(content, out, _CHUNK_BYTES)
            self._sizes[path] = out.tell()
        target.chmod(0o755 if executable else 0o644)
        self.executable[path] = executable

    def hard_link(self, path: str, name: str) -> None:
        """A second name for a file that the archive has already brought."""
        first = os.path.normpath(name)
        if first in self._links:
            self.link(path, self._links[first])
            return
        if first in self._large:
            self._large.append(path)
            return
        if first not in self.executable:
            self.refuse(f"the entry '{brief(path)}' is a link to what is not in it")
        if first != path:
            # Whoever copies the package or reads all of it meets the file once more.
            self._meter.data(self._sizes[first])
            self._sizes[path] = self._sizes[first]
            os.link(self._root / first, self._free(path))
            self.executable[path] = self.executable[first]

    def link(self, path: str, target: str) -> None:
        if len(os.fsencode(target)) > _LONGEST_TARGET or "\0" in target or not target:
            self.refuse(f"the link '{brief(path)}' has no usable target")
        self._links[path] = target

    def finish(self) -> list[str]:
        """Makes the links and gives the hints on all that was left out.

        A workspace holds links that point outside (`src/CMakeLists.txt` leads to `/opt/ros`): they are no offence.
        """
        # A relative target is followed to see where it leads; an absolute one leads outside as it stands.
        if sum(not target.startswith("/") for target in self._links.values()) > self._limits.links:
            self.refuse(f"it holds more than {self._limits.links} links")
        for path, target in self._links.items():
            self._make_link(path, target)
        return [
            f"{why} left out: {listing(sorted(paths))}"
            for why, paths in (
                ("links that point outside the archive were", self._remove_strays()),
                ("files that are too large were", self._large),
                ("files with a name that no disk takes were", self._unnamed),
            )
            if paths
        ]

    def _remove_strays(self) -> set[str]:
        outside: set[str] = set()
        # A link to a link that is removed leads nowhere from then on, or out by another way: look again.
        while stray := [path for path in self._links if path not in outside and self._leads_out(path)]:
            for path in stray:
                (self._root / path).unlink()
            outside.update(stray)
        return outside

    def _make_link(self, path: str, target: str) -> None:
        place = self._root / path
        if place.is_dir() and not place.is_symlink():
            self.refuse(f"the entry '{brief(path)}' is a link and a folder at once")
        place = self._free(path)
        # A link that was made before stands on the way: what is written behind it would be somewhere else.
        if place.parent.resolve() != self._root.resolve().joinpath(*path.split("/")[:-1]):
            self.refuse(f"the entry '{brief(path)}' is behind a link")
        place.symlink_to(target)

    def refuse(self, why: str) -> None:
        raise SubmissionError(
            f"{self._name} is not unpacked: {why}",
            hint="Pack the package's folder again, as a plain .zip or .tar.gz.",
        )

    def _leads_out(self, path: str) -> bool:
        if self._links[path].startswith("/"):
            return True
        place = self._root / path
        try:
            place.stat()
        except OSError as error:
            if error.errno == errno.ELOOP:  # a chain that no system follows leads nowhere
                return False
        # Path.resolve raises for a loop, before Python 3.13
        return not Path(os.path.realpath(place)).is_relative_to(self._root.resolve())

    def _free(self, path: str) -> Path:
        """Return the place for an entry; a later entry of the same name replaces the one before."""
        target = self._root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.unlink(missing_ok=True)
        self.executable.pop(path, None)
        return target
