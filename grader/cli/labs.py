"""Which lab a package is for, and what to say where none is."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass

from grader.cli.find_packages import Found, shown
from grader.errors import UsageError
from grader.intake.find import MANIFEST, Candidate
from grader.intake.names import listing, printable
from grader.rubric.load import find_rubric_for_package, packages_of_labs

_ALIKE = 0.75


@dataclass(frozen=True, kw_only=True)
class Lab:
    """A lab and the package that it is for; `why` says how the two were brought together."""

    rubric: str
    package: Candidate
    why: str


def labs_of(found: Found) -> tuple[Lab, ...]:
    """The labs of the packages that were found, one package each, nearest first.

    Raises UsageError where there is none: it says what is there, which labs there are, and which comes near.
    """
    labs: dict[str, Lab] = {}
    for read in (_by_name, _by_folder):
        for candidate in found.packages:
            lab = read(candidate)
            if lab is not None:
                labs.setdefault(lab.rubric, lab)
    if not labs:
        bare = (c for c in found.candidates if not c.has_manifest and c.ignored_by is None)
        labs = {lab.rubric: lab for candidate in bare if (lab := _by_folder(candidate)) is not None}
    if not labs:
        raise _none(found)
    return tuple(labs.values())


def _by_name(candidate: Candidate) -> Lab | None:
    rubric = find_rubric_for_package(candidate.name)
    if rubric is None:
        return None
    return Lab(rubric=rubric, package=candidate, why=f"the lab for a package named {candidate.name}")


def _by_folder(candidate: Candidate) -> Lab | None:
    folder = re.sub(
        r"-(main|master)$", "", printable(candidate.folder.resolve().name)
    )  # as GitHub's zip names it
    rubric = find_rubric_for_package(folder)
    if rubric is None or (candidate.name.lower() == folder.lower() and candidate.has_manifest):
        return None
    name = f"its {MANIFEST} says {candidate.name}" if candidate.has_manifest else f"it has no {MANIFEST}"
    return Lab(rubric=rubric, package=candidate, why=f"the lab that its folder is named for ({name})")


def _none(found: Found) -> UsageError:
    names = list(dict.fromkeys(c.name for c in found.packages))
    if not names:
        return _no_package(found)
    known = packages_of_labs()
    near = _near(names, known)
    if near is None:
        hint = f"name the lab with --rubric: {_listed(known)}; or --rubric FILE for one of your own"
    else:
        hint = (
            f"{near} is for a package named {known[near]}: mend <name> in {MANIFEST}, "
            f"or add --rubric {near}; all labs: {', '.join(known)}"
        )
    return UsageError(f"no lab is for the package {listing(names)}", hint=hint)


def _no_package(found: Found) -> UsageError:
    folder = shown(found.root)
    if not found.whole:
        return UsageError(
            f"there is too much in {folder} to look for a package in all of it",
            hint="go to your package's folder, or give it: grader check PATH",
        )
    ignored = next((c for c in found.candidates if c.has_manifest and c.ignored_by), None)
    if ignored is not None:
        return UsageError(
            f"the package {ignored.name} is hidden from catkin by {printable(ignored.ignored_by or '')}",
            hint="delete that file",
        )
    return UsageError(
        f"there is no {MANIFEST} in {folder} or above it",
        hint="go to your package's folder, or give it: grader check PATH",
    )


def _near(names: Iterable[str], known: dict[str, str]) -> str | None:
    """The lab whose package, or whose own name, is nearly one of these."""
    words = {_plain(word): rubric for rubric, package in known.items() for word in (rubric, package)}
    for name in names:
        inside = [word for word in words if len(word) >= 4 and word in _plain(name)]
        close = difflib.get_close_matches(_plain(name), words, n=1, cutoff=_ALIKE)
        if close or inside:
            return words[(close or sorted(inside, key=len, reverse=True))[0]]
    return None


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _listed(known: dict[str, str]) -> str:
    return ", ".join(f"{rubric} (package {package})" for rubric, package in known.items())
