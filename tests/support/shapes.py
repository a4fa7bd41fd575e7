"""Packages with two or three faults at once: operators combined at places of the reference solutions, by code."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path

from fixtures.make import rubric_of
from fixtures.make import solution_of as reference_of
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Site, Solution, Tree, TreeFile
from grader.authoring.mutation.source_edits import TextEdit, apply_edits
from grader.model.repair import Repair, RepairKind
from grader.package.repairs import apply_repair, find_repairs, wanted_of
from tests.package.trees import facts_of

COMBINATIONS = (
    ("bit-removed", "tabs-and-spaces", "no-catkin-package"),
    ("topic-misspelt", "sleep-without-brackets"),
    ("python2-print", "syntax-error"),
    ("bit-removed", "launch-type-without-py"),
    ("dependency-dropped", "crlf"),
    ("topic-capital", "byte-order-mark"),
    ("install-commented", "topic-misspelt"),
    ("manifest-malformed", "no-shebang"),
    ("project-renamed", "typographic-quote"),
    ("manifest-renamed", "launch-type-without-py"),
    ("cmake-malformed", "topic-capital", "crlf"),
    ("private-topic", "no-break-space"),
    ("buildtool-dropped", "shebang-typo"),
    ("yaml-key-misspelt", "bit-removed"),
    ("parameter-misspelt", "syntax-error"),
    ("parameter-set-elsewhere", "no-find-package"),
    ("launch-pkg-misspelt", "manifest-malformed"),
    ("syntax-error", "shebang-commented", "install-dropped"),
    ("bit-removed", "crlf"),
    ("never-reset", "topic-misspelt"),
    ("other-rate", "python2-print"),
    ("dependency-dropped", "cmake-malformed"),
)
"""Faults that do not hide each other, and faults that do."""
REPAIRED_AS: dict[str, RepairKind] = {
    "bit-removed": "executable-bit",
    "byte-order-mark": "byte-order-mark",
    "crlf": "line-ends",
    "no-shebang": "shebang",
    "shebang-typo": "shebang",
    "shebang-commented": "shebang",
    "tabs-and-spaces": "python-syntax",
    "python2-print": "python-syntax",
    "syntax-error": "python-syntax",
    "typographic-quote": "python-syntax",
    "no-break-space": "python-syntax",
    "dependency-dropped": "manifest-line",
    "manifest-malformed": "manifest-line",
    "buildtool-dropped": "manifest-line",
    "no-catkin-package": "build-line",
    "no-find-package": "build-line",
    "cmake-malformed": "build-line",
    "install-commented": "build-line",
    "install-dropped": "build-line",
    "project-renamed": "build-line",
    "manifest-renamed": "package-name",
    "launch-pkg-misspelt": "package-name",
    "launch-type-without-py": "launch-type",
    "sleep-without-brackets": "missing-call",
    "topic-misspelt": "topic-name",
    "topic-capital": "topic-name",
    "private-topic": "topic-name",
    "parameter-misspelt": "parameter-name",
    "parameter-set-elsewhere": "parameter-name",
    "yaml-key-misspelt": "parameter-name",
}
LOGIC = ("never-reset", "other-rate")
"""No repair undoes these."""
REWORDED = (
    *("python2-print", "dependency-dropped", "buildtool-dropped", "no-catkin-package", "install-dropped"),
    "private-topic",
)
"""Those whose repair is right in other words than the reference solution's."""
UNDECIDED = ("turtle-square", ("topic-misspelt", "sleep-without-brackets"))
"""Drives in a flood that ends the recording early, so most criteria stay inconclusive."""
ROUNDS_MAX = 3
"""So often a student may have to follow what the report says."""
LAST = ("crlf", "byte-order-mark")
"""These change lines that others change too, so they come after them."""


@cache
def shapes_of(lab: str) -> dict[str, Tree]:
    """Return every combination that fits the lab, by `lab/operator+operator`: the package's files."""
    found = {}
    for number, operators in enumerate(COMBINATIONS):
        tree = _combined(lab, operators, number)
        if tree is not None and (lab, operators) != UNDECIDED:
            found[f"{lab}/{'+'.join(operators)}"] = tree
    return found


def found_in(folder: Path, lab: str) -> tuple[Repair, ...]:
    """Return what can be repaired in the package below the folder."""
    rubric = rubric_of(lab).rubric
    package = folder / reference_of(lab).folder
    return find_repairs(package, facts_of(package, rubric.package), wanted_of(rubric))


def repair(folder: Path, lab: str, repairs: tuple[Repair, ...]) -> None:
    for one in repairs:
        apply_repair(folder / reference_of(lab).folder, one)


def _combined(lab: str, operators: tuple[str, ...], number: int) -> Tree | None:
    """The first choice of places, another one to begin with for each combination, where all the changes fit."""
    solution = reference_of(lab)
    places = [_sites(lab, solution, name, number) for name in operators if name not in LAST]
    for sites in product(*places):
        tree = _merged(solution.tree, [site.tree for site in sites])
        if tree is None:
            continue
        for name in operators:
            after = _sites(lab, solution.then(tree), name, number) if name in LAST else ()
            tree = after[0].tree if after else tree
        return tree
    return None


def _sites(lab: str, solution: Solution, name: str, number: int) -> list[Site]:
    """The operator's places in what the lab asks for, from another one on for each combination."""
    rubric = rubric_of(lab).rubric
    wanted = wanted_of(rubric)
    asked = {*wanted.scripts, *wanted.dependencies, *wanted.params}
    if name in ("install-dropped", "install-commented"):
        asked = {*wanted.installed}  # a rubric that does not ask for it finds nothing wrong
    own = [
        site
        for site in OPERATORS[name].sites(solution)
        if site.at.get("script", site.at.get("dependency")) in {*asked, None}
        and not _is_of_another_package(solution, name, site)
    ]
    start = number % len(own) if own else 0
    return own[start:] + own[:start]


def _is_of_another_package(solution: Solution, name: str, site: Site) -> bool:
    if name not in ("launch-type-without-py", "launch-pkg-misspelt"):
        return False
    nodes = [
        node
        for launch in solution.launch_files
        if launch.path == site.at["file"]
        for node in launch.elements("node")
        if node.attributes.get("name") == site.at["node"]
    ]
    return any(node.attributes.get("pkg") != solution.name for node in nodes)


def _merged(base: Tree, changed: list[Tree]) -> Tree | None:
    """The tree with the changes of all of the others; None where two of them change one line."""
    merged = dict(base)
    for path, entry in base.items():
        others = [tree[path] for tree in changed if tree[path] != entry]
        try:
            text = apply_edits(_text(entry), [edit for other in others for edit in _edits(entry, other)])
        except ValueError:
            return None
        executable = all(other.executable for other in (entry, *others))
        merged[path] = TreeFile(data=text.encode(errors="surrogateescape"), executable=executable)
    return merged


def _text(entry: TreeFile) -> str:
    return entry.data.decode(errors="surrogateescape")


def _edits(entry: TreeFile, other: TreeFile) -> Iterator[TextEdit]:
    old, new = (_text(one).splitlines(keepends=True) for one in (entry, other))
    starts = [0]
    for line in old:
        starts.append(starts[-1] + len(line))
    for tag, i, j, k, n in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if tag != "equal":
            yield TextEdit(starts[i], starts[j], "".join(new[k:n]))
