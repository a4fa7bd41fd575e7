"""Which package and which rubric a folder is about, where the command line does not say."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader.cli.find_packages import Found, find, shown
from grader.cli.labs import Lab, labs_of
from grader.errors import UsageError
from grader.intake import enclosing_package, find_packages
from grader.intake.find import Candidate
from grader.intake.names import is_archive_name
from grader.intake.open import is_recording
from grader.rubric.load import LoadedRubric, load_rubric

Package = tuple[str, Path]


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """What is to be checked: `source` by `rubric`. `package` is the folder of the package where that is known already,
    `words` say in one line what was chosen and why, "" where the command line says it all."""

    rubric: LoadedRubric
    source: str
    package: Path | None = None
    words: str = ""


def packages_at(path: Path) -> list[Package]:
    """The packages in (or else around) a folder, as name and folder. Raises UsageError."""
    try:
        return find_packages(path)
    except OSError as error:
        reason = "does not exist" if not path.exists() else error.strerror or "cannot be read"
        raise UsageError(f"{path} {reason}", hint="give your package's folder") from error


def choose(path: Path, rubric: str | None) -> tuple[LoadedRubric, str]:
    """The rubric, and what to grade: `path`, or the package around it. Raises UsageError."""
    chosen = only(choose_all(path, rubric))
    return chosen.rubric, chosen.source


def only(chosen: tuple[Chosen, ...]) -> Chosen:
    """The one that was chosen. Raises UsageError where there are several."""
    if len(chosen) > 1:
        named = ", ".join(one.rubric.rubric.id for one in chosen)
        raise UsageError(
            f"packages of {len(chosen)} labs are here: {named}",
            hint="go into one of them, or name the lab with --rubric",
        )
    return chosen[0]


def choose_all(path: Path, rubric: str | None) -> tuple[Chosen, ...]:
    """What to check where `path` is named: one package, or one for each lab of which a package is there.

    Raises UsageError where that cannot be told, RubricError for a rubric that is wrong.
    """
    if not path.is_dir():
        folder = _around_file(path, rubric)
        if folder is None:
            return (Chosen(rubric=load_rubric(rubric or ""), source=str(path)),)
        path = folder
    found = find(path)
    if rubric is not None:
        return (_named(path, found, load_rubric(rubric)),)
    return tuple(_chosen(path, found, lab) for lab in labs_of(found))


def only_package(source: str) -> str:
    """The name of the one package in a folder. Raises UsageError where there is none or more than one."""
    path = Path(source)
    if not path.is_dir():
        raise UsageError("which package is to be recorded?", hint="name it with --package")
    names = [name for name, _ in packages_at(path)]
    if len(names) != 1:
        found = ", ".join(names) or "no package.xml"
        raise UsageError(f"{source} holds {found}", hint="name one package with --package")
    return names[0]


def _around_file(path: Path, rubric: str | None) -> Path | None:
    """The package that a file is part of; None for an archive or a recording, whose lab has to be named, and for what
    is no file and may be an address."""
    if not path.exists():
        if rubric is not None:
            return None
        raise UsageError(f"{path} does not exist", hint="give your package's folder")
    handed_in = is_archive_name(path.name) or is_recording(path)
    around = None if handed_in else enclosing_package(path.parent)
    if around is None and rubric is None:
        what = "is no folder" if handed_in else "is a file, and no package is around it"
        raise UsageError(f"{path} {what}", hint="give your package's folder, or name the lab with --rubric")
    return around


def _named(path: Path, found: Found, rubric: LoadedRubric) -> Chosen:
    """By the lab that was asked for. Of several packages the intake takes the lab's."""
    fitting = [c for c in found.packages if c.name.lower() == rubric.rubric.package.lower()]
    package = next(iter([*fitting, *found.packages]), None)
    if package is None:
        return Chosen(rubric=rubric, source=str(path))
    words = f"checking {package.name} in {shown(package.folder)} ({found.moved})" if found.moved else ""
    return Chosen(rubric=rubric, source=_source(path, found, package), package=package.folder, words=words)


def _chosen(path: Path, found: Found, lab: Lab) -> Chosen:
    words = f"checking {lab.package.name} in {shown(lab.package.folder)} by {lab.rubric}, {lab.why}"
    return Chosen(
        rubric=load_rubric(lab.rubric),
        source=_source(path, found, lab.package),
        package=lab.package.folder,
        words=words + (f" ({found.moved})" if found.moved else ""),
    )


def _source(path: Path, found: Found, package: Candidate) -> str:
    """The folder that was named, with all that is in it, where the package is in there and nothing was left out."""
    inside = package.folder.resolve().is_relative_to(path.resolve())
    return str(path if inside and found.whole and not found.moved else package.folder)
