"""Finds packages as catkin does, in any tree, however its neighbours are broken, and chooses the lab's among them."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from grader.errors import PackageNotFound, SubmissionError
from grader.intake.names import encodable, is_archive_name, listing, printable
from grader.intake.tree import NO_CONTENT, Folder, is_file, is_there, read_file, walk

# Where catkin puts what it makes: a copy of a package in there is none.
BUILD_SPACES = frozenset({"build", "devel", "install"})
FOLDERS_LOOKED_AT, ENTRIES_LOOKED_AT, SECONDS_LOOKED = 3000, 300_000, 3.0
IGNORE_MARKERS = frozenset({"CATKIN_IGNORE", "AMENT_IGNORE", "COLCON_IGNORE"})
MANIFEST = "package.xml"
_LARGEST_BYTES = 1 << 20
_LONGEST_NAME = 255


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
    """Each folder that catkin would look into, with the candidate that it is."""
    ignored: dict[str, str] = {}
    for folder in walk(root, tolerant=True):
        hidden = ignored.get(folder.path) or _marker(folder)
        candidate = _candidate(root, folder, hidden)
        yield folder, candidate
        folder.folders[:] = [] if candidate and candidate.has_manifest else _entered(root, folder, leave_out)
        if hidden:
            ignored.update({folder.inside(name): hidden for name in folder.folders})


def linked_candidate(root: Path, wanted: str) -> Candidate | None:
    """Return a package of that name behind a link of that name, if the link stays inside of `root`; catkin follows
    such."""
    real_root = root.resolve()
    for folder in walk(root, tolerant=True):
        folder.folders[:] = [name for name in folder.folders if name not in NO_CONTENT]
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
    has_cmake = "CMakeLists.txt" in files
    if not has_cmake and "src" not in folder.folders:
        return None
    return Candidate(
        path=folder.path,
        folder=place,
        manifest=None,
        has_manifest=False,
        has_cmake=has_cmake,
        ignored_by=ignored_by,
    )


def _entered(root: Path, folder: Folder, leave_out: Path | None) -> list[str]:
    return [
        name
        for name in folder.folders
        if name not in BUILD_SPACES
        and name not in NO_CONTENT
        and not name.startswith(".")
        and root / folder.inside(name) != leave_out
    ]


def manifest_name(folder: Path, *, root: Path) -> str | None:
    """`<name>` in the folder's `package.xml`, as far as it can be read; None where it cannot.

    A manifest that is not well-formed still gives its name where that comes before the fault. One that is a
    link out of `root` is not read.
    """
    path = folder / MANIFEST
    try:
        path.stat()  # before realpath, which follows chains of links that no system follows
        if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root)):
            return None
        data = read_file(path, _LARGEST_BYTES + 1)
    except OSError:
        return None
    return None if data is None or len(data) > _LARGEST_BYTES else _name(data)


def _name(data: bytes) -> str | None:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, recover=True)
    try:
        root = etree.fromstring(data.lstrip(), parser)
    except (etree.XMLSyntaxError, ValueError):
        return None
    # An empty document gives no root at all in this mode.
    for child in root if root is not None else ():
        if isinstance(child.tag, str) and child.tag.rpartition("}")[2] == "name":
            text = [child.text or "", *(part.tail or "" for part in child)]
            name = " ".join("".join(text).split())
            return name if 0 < len(name) <= _LONGEST_NAME else None
    return None


@dataclass(frozen=True, kw_only=True)
class Choice:
    package: Candidate
    hints: tuple[str, ...]


def choose(candidates: list[Candidate], wanted: str) -> Choice | None:
    """Return the lab's package: by its manifest's name, by that in other case, by its folder's name, in this order.

    What catkin does not see (a marker file, no manifest) comes after all that it does see.
    """
    packages = [c for c in candidates if c.has_manifest]
    seen = [c for c in packages if c.ignored_by is None]
    ignored = [c for c in packages if c.ignored_by is not None]
    for group in (seen, ignored):
        for fits in (_named, _named_alike, _in_folder):
            matches = [c for c in group if fits(c, wanted)]
            if matches:
                return _nearest(matches, wanted)
    bare = [c for c in candidates if not c.has_manifest and _in_folder(c, wanted)]
    bare = [c for c in bare if not any(_below(p, c) for p in packages)]
    # A workspace of the lab's name has `src/` too; the package in it has the CMakeLists.txt.
    return _nearest([c for c in bare if c.has_cmake] or bare, wanted) if bare else None


def _named(candidate: Candidate, wanted: str) -> bool:
    return candidate.manifest == wanted


def _named_alike(candidate: Candidate, wanted: str) -> bool:
    return candidate.manifest is not None and candidate.manifest.casefold() == wanted.casefold()


def _in_folder(candidate: Candidate, wanted: str) -> bool:
    """By the folder's name; a repository that was downloaded as a zip adds its branch."""
    folder = candidate.folder.name.casefold()
    return wanted.casefold() in (folder, re.sub(r"-(main|master)$", "", folder))


def _below(inner: Candidate, outer: Candidate) -> bool:
    return inner is not outer and (outer.path == "." or inner.path.startswith(f"{outer.path}/"))


def _nearest(matches: list[Candidate], wanted: str) -> Choice:
    """The one nearest to the root; at one depth, a folder that is named like the package goes first."""
    ordered = sorted(matches, key=lambda c: (c.depth, c.folder.name != wanted, os.fsencode(c.path)))
    chosen, *others = ordered
    hints = [hint for hint in (_name_hint(chosen, wanted), _ignored_hint(chosen)) if hint]
    if others:
        rest = listing([c.path for c in others])
        hints.append(f"{wanted} is there more than once: {printable(chosen.path)} is graded, {rest} is not")
    return Choice(package=chosen, hints=tuple(hints))


def _name_hint(chosen: Candidate, wanted: str) -> str:
    folder = printable(chosen.folder.name)
    if not chosen.has_manifest:
        return f"the folder {folder} has no {MANIFEST}: it was taken for the package {wanted} by its name"
    if chosen.manifest is None:
        return f"no name can be read from the {MANIFEST} in {folder}: the folder's name was taken instead"
    if chosen.manifest == wanted:
        return ""
    name = printable(chosen.manifest)
    if _named_alike(chosen, wanted):
        return f"the package is named {name} in its {MANIFEST}, the lab asks for exactly {wanted}"
    return f"the folder {folder} was taken for {wanted}, but its {MANIFEST} names the package {name}"


def _ignored_hint(chosen: Candidate) -> str:
    if chosen.ignored_by is None:
        return ""
    marker = printable(chosen.ignored_by)
    return f"catkin does not see the package, because of the file {marker}: delete that file"


def not_found(
    root: Path, candidates: list[Candidate], wanted: str, git_links: tuple[str, ...]
) -> PackageNotFound:
    """Return the error for a submission without the lab's package; it says what is there instead."""
    names = sorted({c.name for c in candidates if c.has_manifest})
    here = f"packages here: {listing(names)}" if names else f"no {MANIFEST} was found"
    usual = f"It is the folder whose {MANIFEST} says <name>{wanted}</name>: was it handed in (and pushed)?"
    return PackageNotFound(
        f"there is no package {wanted} in this submission; {here}",
        hint=_where_it_went(root, wanted, git_links) or usual,
    )


def _where_it_went(root: Path, wanted: str, git_links: tuple[str, ...]) -> str:
    """What students do to a package so that it is there and cannot be seen."""
    links = [path for path in git_links if path.rpartition("/")[2].casefold() == wanted.casefold()]
    if not links and not _has_files(root):
        links = list(git_links)
    if links:
        path = printable(links[0])
        return (
            f"{path} is only a pointer to another repository, its files are not in this one: "
            f"delete {path}/.git, `git rm --cached {path}`, `git add {path}`, commit and push."
        )
    for folder in walk(root, tolerant=True):
        folder.folders[:] = [name for name in folder.folders if name not in NO_CONTENT]
        files = {entry.name for entry in folder.others}
        if MANIFEST in files and manifest_name(root / folder.path, root=root) == wanted:
            return _hidden_place(folder.path)
        for entry in folder.others:
            if entry.name == wanted and entry.is_symlink():
                return f"{printable(folder.inside(wanted))} is a link: hand in the folder itself."
        packed = [entry.name for entry in folder.others if is_archive_name(entry.name)]
        if packed and folder.path == ".":
            return f"{printable(packed[0])} lies here: unpack it, or give that file."
    return ""


def _hidden_place(path: str) -> str:
    parts = path.split("/")
    made = next((part for part in parts if part in BUILD_SPACES or part.startswith(".")), None)
    if made:
        return (
            f"{printable(path)} is only a copy in {printable(made)}/: hand in the package itself, from src/."
        )
    return f"{printable(path)} lies below another {MANIFEST}, where catkin never looks: move it out."


def _has_files(root: Path) -> bool:
    for folder in walk(root, tolerant=True):
        folder.folders[:] = [name for name in folder.folders if name not in NO_CONTENT]
        if folder.others:
            return True
    return False
