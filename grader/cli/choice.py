"""Which package and which rubric a folder is about, where the command line does not say."""

from __future__ import annotations

from pathlib import Path

from grader.errors import UsageError
from grader.intake import find_packages
from grader.rubric.load import LoadedRubric, find_rubric_for_package, load_rubric

Package = tuple[str, Path]


def packages_at(path: Path) -> list[Package]:
    """The packages in (or else around) a folder, as name and folder. Raises UsageError."""
    try:
        return find_packages(path)
    except OSError as error:
        reason = "does not exist" if not path.exists() else error.strerror or "cannot be read"
        raise UsageError(f"{path} {reason}", hint="give your package's folder") from error


def choose(path: Path, rubric: str | None) -> tuple[LoadedRubric, str]:
    """The rubric, and what to grade: `path`, or the package around it. Raises UsageError."""
    if not path.is_dir():
        if rubric is None:
            what = "is no folder" if path.exists() else "does not exist"
            raise UsageError(
                f"{path} {what}", hint="give your package's folder, or name the lab with --rubric"
            )
        return load_rubric(rubric), str(path)
    packages = packages_at(path)
    loaded = load_rubric(rubric or _rubric_for(packages, path))
    return loaded, str(_outermost(path, packages))


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


def _rubric_for(packages: list[Package], path: Path) -> str:
    if not packages:
        raise UsageError(f"there is no package.xml in {path} or above it", hint="go to your package's folder")
    names = list(dict.fromkeys(name for name, _ in packages)) + [folder.name for _, folder in packages]
    found = {rubric: name for name in names if (rubric := find_rubric_for_package(name))}
    if len(found) == 1:
        return next(iter(found))
    shown = ", ".join(dict.fromkeys(name for name, _ in packages))
    if not found:
        raise UsageError(
            f"no lab is for the package {shown}",
            hint="name the lab with --rubric (grader labs lists them), or mend <name> in package.xml",
        )
    raise UsageError(
        f"packages of {len(found)} labs are here: {', '.join(found.values())}",
        hint="go into one of them, or name the lab with --rubric",
    )


def _outermost(path: Path, packages: list[Package]) -> Path:
    """The package's folder where `path` lies inside it, else `path`."""
    here = path.resolve()
    return next((folder for _, folder in packages if folder.resolve() in here.parents), path)
