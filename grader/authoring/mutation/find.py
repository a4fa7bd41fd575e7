"""Where a lab's correct package is: beside the rubric, or among what comes with the grader."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.authoring.mutation.solution import MANIFEST, Solution
from grader.authoring.mutation.tree import Tree, read_tree
from grader.authoring.mutation.xml import Document
from grader.errors import UsageError
from grader.rubric.find import rubrics_folder
from grader.rubric.load import LoadedRubric

REFERENCES = "reference_solutions"


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A correct package's folder. `modes` is False where its executable bits cannot be trusted."""

    folder: Path
    modes: bool = True


def references_folder() -> Path:
    """The folder of the reference solutions that come with the grader."""
    return rubrics_folder().parent / REFERENCES


def find_reference(rubric: LoadedRubric) -> Reference:
    """The rubric's reference solution. Raises UsageError where there is none.

    A checkout has its executable bits from git. A wheel is unpacked by installers that need not keep them: there,
    what begins with a shebang is executable.
    """
    name = rubric.rubric.id
    own = rubric.path.absolute().parent.parent / REFERENCES / name
    if own.is_dir() and own.parent != references_folder():
        return Reference(folder=own)
    shipped = references_folder() / name
    if shipped.is_dir():
        return Reference(folder=shipped, modes=shipped.parent.parent.name != "_data")
    raise UsageError(
        f"there is no reference solution for {name}",
        hint="give the folder of a correct package with --solution",
    )


def given_reference(folder: Path) -> Reference:
    """The user's own correct package. Raises UsageError where it is no folder."""
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder", hint="--solution takes the folder of a correct package")
    return Reference(folder=folder)


def load_solution(reference: Reference, package: str) -> Solution:
    """The package of that name within the folder. Raises UsageError where it is not there."""
    tree = read_tree(reference.folder, modes=reference.modes)
    manifests = sorted(
        (p for p in tree if PurePosixPath(p).name == MANIFEST), key=lambda p: (p.count("/"), p)
    )
    for path in manifests:
        if _name(tree, path).lower() == package.lower():
            return Solution(tree=tree, folder=path.removesuffix(MANIFEST), name=package)
    raise UsageError(
        f"there is no package {package} in {reference.folder}",
        hint="a solution's package.xml has to name the package of the rubric",
    )


def _name(tree: Tree, path: str) -> str:
    try:
        document = Document(path, tree[path].data)
    except ValueError:
        return ""
    return next((document.content(e) for e in document.elements("name") if e.parent is document.root), "")
