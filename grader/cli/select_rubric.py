"""Which package and which lab a command is about, where the command line does not say.

A path comes in, and a rubric with the folder to grade goes out; or an error that says what is there.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from grader.errors import UsageError
from grader.intake.candidates import (
    WORKSPACE_MARKS,
    Candidate,
    enclosing_package,
    find_nearest,
    find_packages,
    manifest_name,
)
from grader.intake.choose import is_slip
from grader.intake.gitdir import repository_around
from grader.intake.names import is_archive_name, listing, printable
from grader.intake.open import is_recording
from grader.intake.tree import is_file, is_there
from grader.model.package import BUILD_SPACES, CMAKE, MANIFEST
from grader.model.result import GradingResult
from grader.model.verdict import FileCitation
from grader.rubric.load import LoadedRubric, find_rubric_for_package, load_rubric, packages_of_labs
from grader.rubric.model import Rubric
from grader.rubric.scenario import Scenario, Start, Until
from grader.wording import closest, name_package

ALIKE = 0.75
"""How alike a package's name and a lab's must be to suggest the lab."""
MAX_SECONDS = 3600


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """What to check: `source` by `rubric`. `package` is the folder of the package if that is known already. `words`
    say what was chosen and why, or are "" if the command line says it all."""

    rubric: LoadedRubric
    source: str
    package: Path | None = None
    words: str = ""


def only(chosen: Sequence[Chosen]) -> Chosen:
    """Return the one that was chosen. Raises UsageError if there are several."""
    if len(chosen) > 1:
        named = ", ".join(one.rubric.rubric.id for one in chosen)
        raise UsageError(
            f"there are packages of {len(chosen)} labs here: {named}",
            hint="go to the folder of one of them, or give the lab with --rubric",
        )
    return chosen[0]


def choose_all(path: Path, rubric: str | None, package: str = "") -> tuple[Chosen, ...]:
    """Return what to check at `path`: one package, or one for each lab that has a package there. With `package`, that
    of this name alone.

    Raises UsageError if that is unclear, RubricError for a faulty rubric.
    """
    if not path.is_dir():
        folder = _around_file(path, rubric)
        if folder is None:
            return (Chosen(rubric=load_rubric(rubric or ""), source=str(path)),)
        path = folder
    found = find(path)
    if package:
        named = tuple(c for c in found.candidates if c.name == package)
        # without one of that name, the intake says which there are
        found = replace(found, candidates=named or found.candidates)
    if rubric is not None:
        return (_choose_named(path, found, load_rubric(rubric)),)
    return tuple(_choose_lab(path, found, lab) for lab in labs_of(found))


def only_package(source: str) -> str:
    """Return the name of the only package in a folder. Raises UsageError if there is none or more than one."""
    path = Path(source)
    if not path.is_dir():
        raise UsageError("it is unclear which package to record", hint="give its name with --package")
    try:
        names = [name for name, _ in find_packages(path)]
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}", hint="give a package's folder") from error
    if len(names) != 1:
        found = ", ".join(names) or "no package.xml"
        raise UsageError(f"{source} contains {found}", hint="give one package with --package")
    return names[0]


def _around_file(path: Path, rubric: str | None) -> Path | None:
    """Return the package that a file is part of. None for an archive or a recording, whose lab has to be given, and for
    what does not exist here and may be an address."""
    if not path.exists():
        if rubric is not None:
            return None
        raise UsageError(f"{path} does not exist", hint="give your package's folder")
    handed_in = is_archive_name(path.name) or is_recording(path)
    around = None if handed_in else enclosing_package(path.parent)
    if around is None and rubric is None:
        what = "is not a folder" if handed_in else "is a file outside any package"
        raise UsageError(f"{path} {what}", hint="give your package's folder, or the lab with --rubric")
    return around


def _choose_named(path: Path, found: FoundPackages, rubric: LoadedRubric) -> Chosen:
    """Choose by the lab that was given. Of several packages the intake takes the lab's."""
    fitting = [c for c in found.packages if c.name.lower() == rubric.rubric.package.lower()]
    package = next(iter([*fitting, *found.packages]), None)
    if package is None:
        return Chosen(rubric=rubric, source=str(path))
    where = f" in {short_path(package.folder)}" if found.moved else ""
    words = f"Checking {package.name}{where} against {rubric.rubric.id}{f' ({found.moved})' if found.moved else ''}"
    source = _source(path, found, package, rubric.rubric)
    return Chosen(rubric=rubric, source=source, package=package.folder, words=words)


def _choose_lab(path: Path, found: FoundPackages, lab: Lab) -> Chosen:
    folder = short_path(lab.package.folder)
    where = f" in {folder}" if folder != "." else ""
    words = f"Checking {lab.package.name}{where} against {lab.rubric}{f', {lab.why}' if lab.why else ''}"
    rubric = load_rubric(lab.rubric)
    return Chosen(
        rubric=rubric,
        source=_source(path, found, lab.package, rubric.rubric),
        package=lab.package.folder,
        words=words + (f" ({found.moved})" if found.moved else ""),
    )


def _source(path: Path, found: FoundPackages, package: Candidate, rubric: Rubric) -> str:
    """Return the given folder if the package is in it and all of it was searched, else the package's folder; of a lab
    with several packages the folder above it, if others of them lie there."""
    inside = package.folder.resolve().is_relative_to(path.resolve())
    here = path if inside and found.whole and not found.moved else package.folder
    wanted = set(rubric.package_names)
    if len(wanted) > 1 and not wanted <= {c.name for c in found.packages}:
        beside, whole = find_nearest(package.folder.resolve().parent)
        if whole and len(wanted & {c.name for c in beside if c.has_manifest}) > 1:
            return str(package.folder.resolve().parent)
    return str(here)


@dataclass(frozen=True, kw_only=True)
class Lab:
    """A lab and the package that it is for; `why` says how they were matched, "" where the names are the same."""

    rubric: str
    package: Candidate
    why: str


def labs_of(found: FoundPackages) -> tuple[Lab, ...]:
    """Return the labs of the packages that were found, one package each, nearest first.

    Raises UsageError if there is none: it says what is there, which labs there are, and which is most alike.
    """
    labs: dict[str, Lab] = {}
    # a name in a manifest is surer than that of a folder
    for read in (_by_name, _by_folder):
        for candidate in found.packages:
            lab = read(candidate)
            known = labs.get(lab.rubric) if lab is not None else None
            if lab is not None and (known is None or (_is_main(lab) and not _is_main(known))):
                labs[lab.rubric] = lab
    if not labs:
        bare = (c for c in found.candidates if not c.has_manifest and c.ignored_by is None)
        labs = {lab.rubric: lab for candidate in bare if (lab := _by_folder(candidate)) is not None}
    if not labs:
        labs = {lab.rubric: lab for lab in _by_slip(found)}
    if not labs:
        raise _none(found)
    return tuple(labs.values())


def _is_main(lab: Lab) -> bool:
    """Return whether it was found by the lab's main package, of several."""
    return not lab.why and packages_of_labs()[lab.rubric].lower() == lab.package.name.lower()


def _by_name(candidate: Candidate) -> Lab | None:
    rubric = find_rubric_for_package(candidate.name)
    return Lab(rubric=rubric, package=candidate, why="") if rubric is not None else None


def _by_folder(candidate: Candidate) -> Lab | None:
    # without the branch that GitHub's zip adds to the name
    folder = re.sub(r"-(main|master)$", "", printable(candidate.folder.resolve().name))
    rubric = find_rubric_for_package(folder)
    if rubric is None or (candidate.name.lower() == folder.lower() and candidate.has_manifest):
        return None
    name = f"its {MANIFEST} says {candidate.name}" if candidate.has_manifest else f"it has no {MANIFEST}"
    return Lab(rubric=rubric, package=candidate, why=f"the lab that its folder is named after ({name})")


def _by_slip(found: FoundPackages) -> Iterator[Lab]:
    """Yield the lab whose package's name is all but that of the only package here, if there is just one such lab."""
    names = {c.name for c in found.packages}
    known = packages_of_labs()
    near = {(rubric, name) for name in names for rubric, package in known.items() if is_slip(name, package)}
    if len(names) == 1 and len(near) == 1:
        [(rubric, _)] = near
        why = f"the lab for a package named {known[rubric]}: did you mean that name?"
        yield Lab(rubric=rubric, package=found.packages[0], why=why)


def _none(found: FoundPackages) -> UsageError:
    names = list(dict.fromkeys(c.name for c in found.packages))
    if not names:
        return _no_package(found)
    known = packages_of_labs()
    near = _near(names, known)
    if near is None:
        labs = ", ".join(f"{rubric} (package {package})" for rubric, package in known.items())
        hint = f"give the lab with --rubric: {labs}; or --rubric FILE for a lab of your own"
    else:
        hint = (
            f"{near} is for a package named {known[near]}: {name_package(known[near])}, "
            f"or add --rubric {near} --package NAME; all labs: {', '.join(known)}"
        )
    return UsageError(f"no lab is for the package {listing(names)}", hint=hint)


def _no_package(found: FoundPackages) -> UsageError:
    folder = short_path(found.root)
    if not found.whole:
        return UsageError(
            f"{folder} has too many files to search it all for a package",
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
    """Return the lab whose package or own name is most like one of these."""
    words = {_plain(word): rubric for rubric, package in known.items() for word in (rubric, package)}
    for name in names:
        # a shorter one is in too many names
        inside = [word for word in words if len(word) >= 4 and word in _plain(name)]
        near = closest(_plain(name), words, cutoff=ALIKE) or max(inside, key=len, default="")
        if near:
            return words[near]
    return None


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def rubric_to_record(
    package: str, scripts: Sequence[str], launches: Sequence[str], seconds: float
) -> LoadedRubric:
    """Return a rubric that runs these files for so long. Raises UsageError."""
    if not 0 < seconds <= MAX_SECONDS:
        raise UsageError(f"--seconds must be more than 0 and at most {MAX_SECONDS}, not {seconds:g}")
    starts = [Start(name=_start_name(i, file), script=file) for i, file in enumerate(scripts, 1)]
    starts += [
        Start(name=_start_name(i, file), launch=file) for i, file in enumerate(launches, len(starts) + 1)
    ]
    until = Until(limit_s=seconds, first_message_s=seconds, silent_s=seconds, messages={})
    scenario = Scenario(title="As asked on the command line", start=tuple(starts), until=until)
    return LoadedRubric.to_record(package, {"record": scenario})


def _start_name(number: int, file: str) -> str:
    """Return a name with a number, so that it is unique: `p1-numeric-talker`."""
    stem = re.sub(r"[^a-z0-9]+", "-", Path(file).stem.lower()).strip("-")
    return f"p{number}-{stem}".rstrip("-")


_MADE = BUILD_SPACES | {"logs"}
_MADE_MARKS = ("CMakeCache.txt", ".catkin", "setup.sh", ".catkin_tools.yaml", ".built_by")


@dataclass(frozen=True, kw_only=True)
class FoundPackages:
    """`candidates` may be packages, nearest first. `root` is the folder that was searched; if that is not the one
    that was given, `moved` says why. `whole` is false if some of it was not searched."""

    root: Path
    candidates: tuple[Candidate, ...]
    moved: str = ""
    whole: bool = True

    @property
    def packages(self) -> tuple[Candidate, ...]:
        """Return those with a manifest, as catkin sees them."""
        return tuple(c for c in self.candidates if c.has_manifest and c.ignored_by is None)


def find(path: Path) -> FoundPackages:
    """Find the packages below the folder `path`; else the one around it; else those of its repository or workspace.

    From inside .git or a build's folder, the search starts outside of it. Raises UsageError if `path` cannot be read.
    """
    try:
        return _find(path)
    except OSError as error:
        reason = "does not exist" if not is_there(path) else error.strerror or "cannot be read"
        raise UsageError(f"{path} {reason}", hint="give your package's folder") from error


def _find(path: Path) -> FoundPackages:
    here = path.resolve()
    outside, moved = _outside(here)
    # as it was given: a path that is relative is shown so
    root = path if outside == here else outside
    candidates, whole = find_nearest(root)
    found = FoundPackages(root=root, candidates=tuple(candidates), moved=moved, whole=whole)
    if found.packages:
        return found
    around = enclosing_package(outside)
    if around is not None:
        return FoundPackages(root=around, candidates=(_as_candidate(around),), moved=moved)
    return _beside(outside) or found


def _outside(here: Path) -> tuple[Path, str]:
    """Return the folder to search instead of one with copies of packages, or none, and why."""
    # the outermost first: a build may have folders of these names within it
    for folder in (*reversed(here.parents), here):
        if folder.name == ".git":
            return folder.parent, "this folder belongs to git"
        if folder.name in _MADE and _is_made(folder):
            return folder.parent, f"{folder.name}/ was made by a build"
    return here, ""


def _is_made(folder: Path) -> bool:
    """Return whether catkin or CMake made it: a package may have a folder of the same name."""
    if any(is_there(folder / mark) for mark in _MADE_MARKS):
        return True
    return any(is_there(folder.parent / mark) for mark in WORKSPACE_MARKS)


def _beside(here: Path) -> FoundPackages | None:
    """Search the rest of the repository or workspace that the folder is part of."""
    repository = repository_around(here)
    workspace = next((f for f in here.parents if any(is_there(f / mark) for mark in WORKSPACE_MARKS)), None)
    for root, what in ((workspace, "workspace"), (repository, "repository")):
        # never a whole disk
        if root is not None and root not in (here, Path(root.anchor)):
            candidates, whole = find_nearest(root)
            found = FoundPackages(
                root=root,
                candidates=tuple(candidates),
                whole=whole,
                moved=f"there is no package here, but in the {what}",
            )
            if found.packages:
                return found
    return None


def _as_candidate(folder: Path) -> Candidate:
    name = manifest_name(folder, root=folder) or printable(folder.name)
    return Candidate(path=".", folder=folder, manifest=name, has_cmake=is_file(folder / CMAKE))


def short_path(folder: Path) -> str:
    """Return the shorter of the relative and the absolute path, as printable text."""
    try:
        near = os.path.relpath(folder.resolve(), Path.cwd())
    except (OSError, ValueError):
        return printable(str(folder))
    whole = str(folder.resolve())
    return printable(near if len(near) < len(whole) else whole)


def package_prefix(result: GradingResult, here: Path) -> str | None:
    """Return the package's folder relative to the repository around `here` (or to `here`), `.` for the root itself.

    Results do not say it: it is the package of that name that has all files that the result cites. None if none has.
    """
    here = here.resolve()
    root = next((folder for folder in (here, *here.parents) if (folder / ".git").exists()), here)
    cited = {
        c.file for criterion in result.criteria for c in criterion.citations if isinstance(c, FileCitation)
    }
    with suppress(OSError):
        # one around `root` is none of its own
        own = ((name, folder) for name, folder in find_packages(root) if folder.is_relative_to(root))
        for name, folder in own:
            if name == result.submission.package and all((folder / file).exists() for file in cited):
                return folder.relative_to(root).as_posix()
    return None
