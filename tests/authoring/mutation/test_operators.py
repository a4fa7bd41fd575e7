"""What each operator makes of the reference solutions and of a package that is written quite differently.

`GRADER_REGENERATE=1 pytest tests/authoring/mutation` writes golden/<operator>.diff again.
"""

from __future__ import annotations

import ast
import os
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

from fixtures.make import declared, faulty_package, rubric_of
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.registry import Operator, operator
from grader.authoring.mutation.solution import Reference, Site, Solution, Tree, load_solution, unified_diff
from tests.authoring.mutation.samples import EXAMPLES, LABS, other_solution, reference_solution, tree_of

GOLDEN = Path(__file__).parent / "golden"
BREAK_PYTHON = {"python2-print", "tabs-and-spaces", "typographic-quote", "no-break-space", "syntax-error"}
NOT_PLAIN = {"byte-order-mark", "utf-16"}
BREAK_XML = {"launch-malformed", "manifest-malformed"}
BREAK_YAML = {"yaml-tabs", "yaml-malformed"}
WRITTEN_OTHERWISE = [(lab, name) for lab in LABS for name in declared(lab) if name.startswith("ok-")]
NO_PYTHON_3 = ("broken.py", "empty.py")


@pytest.fixture(scope="module")
def solutions() -> dict[str, Solution]:
    return {"other": other_solution(), **{lab: reference_solution(lab) for lab in (*LABS, *EXAMPLES)}}


def changed(solution: Solution, site: Site) -> Tree:
    """The files that are new or other."""
    return {path: e for path, e in site.tree.items() if solution.tree.get(path) != e}


def golden_text(tried: Operator, solutions: dict[str, Solution]) -> str:
    """The diffs on the other package, and on the first reference solution that the operator fits."""
    fitting = [name for name, solution in solutions.items() if tried.sites(solution)]
    references = [name for name in fitting if name != "other"][:1]
    parts = []
    for name in [*(n for n in fitting if n == "other"), *references]:
        for site in tried.sites(solutions[name]):
            at = ", ".join(f"{key}: {value}" for key, value in site.at.items())
            parts.append(f"=== {name} {{{at}}}\n{unified_diff(solutions[name].tree, site.tree)}")
    return "\n".join(parts)


@pytest.mark.parametrize("name", OPERATORS)
def test_edit_is_as_kept(name, solutions):
    made, kept = golden_text(OPERATORS[name], solutions), GOLDEN / f"{name}.diff"
    if os.environ.get("GRADER_REGENERATE"):
        GOLDEN.mkdir(exist_ok=True)
        kept.write_text(made, encoding="utf-8")
    assert made
    assert made == kept.read_text(encoding="utf-8")


def test_no_golden_file_is_left_over():
    assert {path.stem for path in GOLDEN.glob("*")} == set(OPERATORS)


@pytest.fixture(scope="module")
def every_site(solutions) -> list[tuple[str, Solution, Site]]:
    return [
        (name, solution, site)
        for name, tried in OPERATORS.items()
        for solution in solutions.values()
        for site in tried.sites(solution)
    ]


def test_files_stay_sound_but_for_the_mistake(every_site):
    """A mutant has the one mistake that its operator makes, and no syntax error besides."""
    for name, solution, site in every_site:
        for path, entry in changed(solution, site).items():
            sound = not path.endswith(NO_PYTHON_3)
            if path.endswith(".py") and sound and name not in NOT_PLAIN:
                assert compiles(entry.data) is (name not in BREAK_PYTHON), (name, path, site.at)
            if path.endswith((".launch", ".xml")):
                assert is_xml(entry.data) is (name not in BREAK_XML), (name, path, site.at)
            if path.endswith(".yaml"):
                assert is_yaml(entry.data) is (name not in BREAK_YAML), (name, path, site.at)


def compiles(data: bytes) -> bool:
    try:
        ast.parse(data)
    except SyntaxError:
        return False
    return True


def is_xml(data: bytes) -> bool:
    try:
        ET.fromstring(data)  # noqa: S314 - made by ourselves
    except ET.ParseError:
        return False
    return True


def is_yaml(data: bytes) -> bool:
    try:
        yaml.safe_load(data)
    except yaml.YAMLError:
        return False
    return True


@pytest.mark.full
@pytest.mark.parametrize(("lab", "package"), WRITTEN_OTHERWISE)
def test_correct_packages_of_every_kind_stay_sound_python(lab, package):
    """Classes, timers, callbacks, one-liners: whatever is edited still compiles."""
    solution = load_solution(Reference(folder=faulty_package(lab, package)), rubric_of(lab).rubric.package)
    sound = {path for path, e in solution.tree.items() if path.endswith(".py") and compiles(e.data)}
    tried = [o for name, o in OPERATORS.items() if name not in BREAK_PYTHON and name not in NOT_PLAIN]
    for site in (site for one in tried for site in one.sites(solution)):
        changes = changed(solution, site)
        assert [path for path in sound & changes.keys() if not compiles(changes[path].data)] == [], site.at


def test_places_can_be_told_apart(every_site, solutions):
    places = [(name, id(solution), *site.at.items()) for name, solution, site in every_site]
    assert len(set(places)) == len(places)


def test_the_solution_itself_stays_as_it_is(every_site, solutions):
    assert solutions["other"].tree == other_solution().tree
    assert [(name, site.at) for name, solution, site in every_site if site.tree == solution.tree] == []


def test_nothing_fits_a_package_without_content():
    files = {
        "package.xml": "<package",
        "CMakeLists.txt": "project(",
        "a.launch": "",
        "b.py": "def",
        "c.yaml": "{",
        "d.sh": "",
    }
    empty = Solution(tree=tree_of(files), folder="", name="lab")
    fitting = {name for name, tried in OPERATORS.items() if tried.sites(empty)}
    assert fitting == {"file-missing", "file-misnamed", "build-file-missing"}


def test_at_least_15_operators_fit_each_lab(solutions):
    for lab in LABS:
        assert sum(bool(o.sites(solutions[lab])) for o in OPERATORS.values()) >= 15


def new_one():
    return []


def bit_removed():
    """Removes it."""


def test_an_operator_has_to_say_what_it_does():
    with pytest.raises(ValueError, match="twice"):
        operator(each=lambda _: (), fits="every script")(bit_removed)
    with pytest.raises(ValueError, match="no docstring"):
        operator(each=lambda _: (), fits="every script")(new_one)
    assert "new-one" not in OPERATORS


def test_built_files_are_nobodys_mistake():
    tree = tree_of({"scripts/a.py": "#!/usr/bin/env python\n", "devel/lib/a.py": "#!/usr/bin/env python\n"})
    sites = OPERATORS["bit-removed"].sites(Solution(tree=tree, folder="", name="lab"))
    assert [site.at for site in sites] == [{"script": "scripts/a.py"}]
