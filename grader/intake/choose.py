"""Which of the packages found is the lab's, and what to say where that is not plain."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from grader.errors import PackageNotFound
from grader.intake.find import BUILD_SPACES, Candidate
from grader.intake.manifest import MANIFEST, manifest_name
from grader.intake.names import is_archive_name, listing, printable
from grader.intake.tree import NO_CONTENT, walk


@dataclass(frozen=True, kw_only=True)
class Choice:
    package: Candidate
    hints: tuple[str, ...]


def choose(candidates: list[Candidate], wanted: str) -> Choice | None:
    """The lab's package: by its manifest's name, by that in other case, by its folder's name, in this order.

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
    """The error for a submission without the lab's package; it says what is there instead."""
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
