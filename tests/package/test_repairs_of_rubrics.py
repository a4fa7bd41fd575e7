"""Repairs and rubrics: reference solutions need none, and the mistakes of mutation operators are undone."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Solution, Tree, read_tree, write_tree
from grader.package.repairs import Wanted, find_repairs, wanted_of
from grader.rubric.find import rubric_ids
from grader.rubric.load import load_rubric
from tests.package.repairing import repair_all
from tests.package.trees import facts_of, plain

pytestmark = pytest.mark.usefixtures("without_processes")

SOLUTIONS = Path(__file__).parents[2] / "reference_solutions"
TURTLE = str(Path(__file__).parents[2] / "rubrics" / "examples" / "turtle-square.yaml")
LABS = (*rubric_ids(), TURTLE)


def solution_of(lab: str) -> tuple[Tree, Wanted, str]:
    rubric = load_rubric(lab).rubric
    folder = next((SOLUTIONS / rubric.id).iterdir())
    return read_tree(folder), wanted_of(rubric), rubric.package


@pytest.mark.parametrize("lab", LABS, ids=lambda lab: Path(lab).stem)
def test_a_reference_solution_needs_no_repair(lab: str, tmp_path: Path) -> None:
    tree, wanted, name = solution_of(lab)
    write_tree(tree, tmp_path / name)
    assert find_repairs(tmp_path / name, facts_of(tmp_path / name, name), wanted) == ()


def test_a_rubric_names_what_is_wanted() -> None:
    wanted = wanted_of(load_rubric("leeds-comp3631-lab1").rubric)
    assert wanted.package == "lab1"
    assert wanted.scripts == ("src/numeric_talker.py", "src/numeric_listener.py")
    assert wanted.topics == ("/chatter", "/numeric_chatter")
    assert wanted.nodes == ("numeric_talker", "talker")
    assert wanted.launch_files == ("lab1.launch",)
    assert wanted.types == ("std_msgs/String", "std_msgs/Int8")
    assert wanted_of(load_rubric("mcr2-basic-comms").rubric).installed == (
        "scripts/talker.py",
        "scripts/listener.py",
    )
    avoid = load_rubric(str(Path(TURTLE).with_name("avoid-obstacles.yaml"))).rubric
    assert {"/scan", "/cmd_vel"} <= set(wanted_of(avoid).topics), "what the robot's world has counts too"
    assert "/details/contact/phone" in wanted_of(load_rubric("eyantra-ros-basics").rubric).params


def test_a_message_that_the_grader_sends_is_wanted_as_the_handout_defines_it(tmp_path: Path) -> None:
    text = Path(TURTLE).with_name("two-packages.yaml").read_text(encoding="utf-8")
    about = text.index("  - {id: definition"), text.index("  - {id: manifest")
    sent = 'type: weather_msgs/Reading, definition: "float64 temperature", values'
    text = text[: about[0]] + text[about[1] :].replace("points: 10", "points: 30", 1)
    path = tmp_path / "lab.yaml"
    path.write_text(text.replace("type: weather_msgs/Reading, values", sent), encoding="utf-8")
    rubric = load_rubric(str(path)).rubric
    ((file, fields),) = wanted_of(rubric).definitions
    assert (file, [(one.type, one.name) for one in fields]) == (
        "msg/Reading.msg",
        [("float64", "temperature")],
    )
    alarm = rubric.scenarios["alarm"]
    path.write_text(text, encoding="utf-8")
    plain = load_rubric(str(path)).rubric.scenarios["alarm"]
    assert plain.digest != alarm.digest


SAME = (
    *(
        "bit-removed",
        "crlf",
        "byte-order-mark",
        "no-shebang",
        "shebang-typo",
        "shebang-commented",
        "shebang-python2",
    ),
    *(
        "launch-type-without-py",
        "launch-pkg-misspelt",
        "project-renamed",
        "no-find-package",
        "cmake-malformed",
    ),
    *("install-commented", "install-elsewhere", "manifest-renamed", "manifest-malformed", "topic-misspelt"),
    *(
        "topic-capital",
        "tabs-and-spaces",
        "typographic-quote",
        "no-break-space",
        "syntax-error",
        "yaml-key-misspelt",
    ),
    *("sleep-without-brackets", "parameter-misspelt", "parameter-set-elsewhere"),
)
"""Operators whose mistake is undone: the files are those of the correct package, but for space, quotes and shebangs."""
SOUND = (
    *("no-catkin-package", "install-dropped", "dependency-dropped", "buildtool-dropped", "private-topic"),
    "python2-print",
)
"""Those whose mistake is repaired in other words."""
FOREIGN = ("launch-type-without-py", "launch-pkg-misspelt")
"""Operators that also change the node of another package, of which this package knows nothing."""


def assert_repaired(operator: str, lab: str, folder: Path) -> int:
    tree, wanted, name = solution_of(lab)
    solution = Solution(tree=tree, folder="", name=name)
    repaired = 0
    for site in OPERATORS[operator].sites(solution):
        write_tree(site.tree, folder / name)
        found = repair_all(folder / name, wanted, name)
        unasked = site.at.get("dependency", name) not in (name, *wanted.dependencies)
        if not found and (unasked or operator in FOREIGN):
            continue
        assert found, f"{operator} at {site.at} is not found"
        now = read_tree(folder / name)
        assert {path: entry.executable for path, entry in now.items()} == {
            p: e.executable for p, e in tree.items()
        }
        if operator in SAME:
            assert {p: plain(p, e.data) for p, e in now.items()} == {
                p: plain(p, e.data) for p, e in tree.items()
            }
        assert find_repairs(folder / name, facts_of(folder / name, name), wanted) == ()
        repaired += 1
        shutil.rmtree(folder / name)
    return repaired


@pytest.mark.slow
@pytest.mark.full
@pytest.mark.parametrize("lab", LABS, ids=lambda lab: Path(lab).stem)
@pytest.mark.parametrize("operator", [*SAME, *SOUND])
def test_a_repair_is_the_inverse_of_the_operator(operator: str, lab: str, tmp_path: Path) -> None:
    assert assert_repaired(operator, lab, tmp_path) >= 0


@pytest.mark.parametrize("operator", ["topic-misspelt", "python2-print", "install-dropped"])
def test_a_few_operators_are_undone(operator: str, tmp_path: Path) -> None:
    assert assert_repaired(operator, "mcr2-basic-comms", tmp_path) > 0
