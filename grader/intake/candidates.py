"""Finds packages as catkin does, in any tree, however its neighbours are broken."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from grader.errors import SubmissionError
from grader.intake.names import LONGEST_PACKAGE_NAME, encodable, printable
from grader.intake.tree import Folder, is_file, is_there, read_file, walk
from grader.model.package import BUILD_SPACES, CMAKE, MANIFEST

FOLDERS_LOOKED_AT, ENTRIES_LOOKED_AT, SECONDS_LOOKED = 3000, 300_000, 3.0
IGNORE_MARKERS = frozenset({"CATKIN_IGNORE", "AMENT_IGNORE", "COLCON_IGNORE"})
WORKSPACE_MARKS = (".catkin_workspace", ".catkin_tools", "src/CMakeLists.txt")
LARGEST_BYTES = 1 << 20
"""Of a file that is read while a package is looked for."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A folder that is, or could be, a package. `path` is relative to the root, `.` for that itself.

    `manifest` is the name that its `package.xml` gives, None where none can be read. `ignored_by` is the
    marker file that hides it from catkin. `has_manifest` is false for what only looks like a package.
    """

    path: str
    folder: Path
    manifest: str | None
    has_manifest: bool = True
    has_cmake: bool = False
    ignored_by: str | None = None

    @property
    def name(self) -> str:
        """What ROS calls it, or the folder's name where nothing better is known."""
        return self.manifest if self.manifest and encodable(self.manifest) else printable(self.folder.name)

    @property
    def depth(self) -> int:
        return 0 if self.path == "." else self.path.count("/") + 1


def find_candidates(root: Path, *, leave_out: Path | None = None) -> list[Candidate]:
    """Return the packages below `root`, nearest first, and each folder that has only a `CMakeLists.txt` or `src/`.

    Not entered: packages, `build/`, `devel/`, `install/`, hidden folders, links, `leave_out`.
    Raises OSError where `root` itself cannot be read.
    """
    return [candidate for _, candidate in _looked_at(root, leave_out) if candidate is not None]


def find_nearest(root: Path) -> tuple[list[Candidate], bool]:
    """As `find_candidates`, in a folder of any size (a home, a whole disk): what is found within FOLDERS_LOOKED_AT
    folders, ENTRIES_LOOKED_AT entries and SECONDS_LOOKED seconds, nearest first, and whether that was everything.

    Raises OSError where `root` itself cannot be read.
    """
    found: list[Candidate] = []
    end, entries = time.monotonic() + SECONDS_LOOKED, 0
    try:
        for number, (folder, candidate) in enumerate(_looked_at(root, None)):
            found += [candidate] if candidate is not None else []
            entries += len(folder.others) + len(folder.folders)
            spent = number >= FOLDERS_LOOKED_AT or entries >= ENTRIES_LOOKED_AT
            if spent or time.monotonic() > end:
                return found, False
    except SubmissionError:  # more in one folder than anybody looks at
        return found, False
    return found, True


def _looked_at(root: Path, leave_out: Path | None) -> Iterator[tuple[Folder, Candidate | None]]:
    """Yield each folder that catkin would look into, with the candidate that it is, or None."""
    ignored: dict[str, str] = {}
    for folder in walk(root, tolerant=True):
        hidden = ignored.get(folder.path) or _marker(folder)
        candidate = _candidate(root, folder, hidden)
        yield folder, candidate
        folder.folders[:] = (
            [] if candidate and candidate.has_manifest else _folders_to_enter(root, folder, leave_out)
        )
        if hidden:
            ignored.update({folder.inside(name): hidden for name in folder.folders})


def linked_candidate(root: Path, wanted: str) -> Candidate | None:
    """Return a package of that name behind a link of that name, if the link stays inside of `root`; catkin follows
    such."""
    real_root = root.resolve()
    for folder in walk(root, tolerant=True):
        for entry in folder.others:
            named = entry.name.casefold() == wanted.casefold() and entry.is_symlink()
            if named and is_file(Path(entry.path, MANIFEST)):
                place = Path(os.path.realpath(entry.path))
                if place.is_relative_to(real_root):
                    path = place.relative_to(real_root).as_posix()
                    if manifest_name(place, root=real_root) == wanted:
                        return Candidate(path=path, folder=place, manifest=wanted)
    return None


def find_packages(root: Path) -> list[tuple[str, Path]]:
    """Return the packages that catkin would find below `root`, nearest first, as (name, folder).

    If there are none, but `root` lies inside a package, then that one.
    Raises OSError where `root` cannot be read.
    """
    found = [c for c in find_candidates(root) if c.has_manifest and c.ignored_by is None]
    if found:
        return [(candidate.name, candidate.folder) for candidate in found]
    around = enclosing_package(root)
    return [(manifest_name(around, root=around) or printable(around.name), around)] if around else []


def enclosing_package(path: Path) -> Path | None:
    """Return the package that `path` lies in or is, or None.

    Within a repository the outermost, as catkin looks no further than the first manifest on its way down;
    elsewhere the nearest, as nothing tells where the student's own folders end.
    """
    found: list[Path] = []
    here = path.resolve()
    for folder in (here, *here.parents):
        if is_file(folder / MANIFEST):
            found.append(folder)
        if is_there(folder / ".git"):
            return found[-1] if found else None
    return found[0] if found else None


def _marker(folder: Folder) -> str | None:
    present = {entry.name for entry in folder.others} | set(folder.folders)
    marker = min(IGNORE_MARKERS & present, default=None)
    return folder.inside(marker) if marker else None


def _candidate(root: Path, folder: Folder, ignored_by: str | None) -> Candidate | None:
    files = {entry.name for entry in folder.others}
    place = root / folder.path
    if MANIFEST in files:
        name = manifest_name(place, root=root)
        return Candidate(path=folder.path, folder=place, manifest=name, ignored_by=ignored_by)
    has_cmake = CMAKE in files
    if not has_cmake and {"src", "scripts"}.isdisjoint(folder.folders):
        return None
    return Candidate(
        path=folder.path,
        folder=place,
        manifest=None,
        has_manifest=False,
        has_cmake=has_cmake,
        ignored_by=ignored_by,
    )


def _folders_to_enter(root: Path, folder: Folder, leave_out: Path | None) -> list[str]:
    return [
        name
        for name in folder.folders
        if name not in BUILD_SPACES and not name.startswith(".") and root / folder.inside(name) != leave_out
    ]


def manifest_name(folder: Path, *, root: Path) -> str | None:
    """Return what `named_at` returns, without the line."""
    found = named_at(folder, root=root)
    return found[0] if found else None


def named_at(folder: Path, *, root: Path) -> tuple[str, int] | None:
    """Return `<name>` in the folder's `package.xml` with its line, as far as it can be read; None where it cannot.

    A manifest that is not well-formed still gives its name where that comes before the fault. One that is a
    link out of `root` is not read.
    """
    path = folder / MANIFEST
    try:
        path.stat()  # before realpath, which follows chains of links that no system follows
        if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root)):
            return None
        data = read_file(path, LARGEST_BYTES + 1)
    except OSError:
        return None
    return None if data is None or len(data) > LARGEST_BYTES else _name(data)


def _name(data: bytes) -> tuple[str, int] | None:
    above, first, rest = data.partition(b"<")
    if above.isascii() and re.search(rb"\w", above):  # a browser writes a line above what it shows
        data = b"\n" * above.count(b"\n") + first + rest
    # a student's file may name entities that grow without end, or files and addresses to read
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, recover=True)
    try:
        # an XML declaration must come first; `before` adds the lines again that this takes away
        root = etree.fromstring(data.lstrip(), parser)
    except (etree.XMLSyntaxError, ValueError):
        return None
    # An empty document gives no root at all in this mode.
    for child in root if root is not None else ():
        # a comment has a function in place of a tag; a namespace stands in `{}` before the name
        if isinstance(child.tag, str) and child.tag.rpartition("}")[2] == "name":
            text = [child.text or "", *(part.tail or "" for part in child)]
            name = " ".join("".join(text).split())
            before = data[: len(data) - len(data.lstrip())].count(b"\n")
            line = before + (child.sourceline if isinstance(child.sourceline, int) else 1)
            return (name, line) if 0 < len(name) <= LONGEST_PACKAGE_NAME else None
    return None
