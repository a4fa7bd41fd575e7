"""Two and three faults at once: each is found and undone, and advice on files alone leads to none of them.

tests/test_shapes_graded.py grades them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fixtures.make import labs, rubric_of, solution_of
from grader.authoring.mutation.solution import read_tree, write_tree
from grader.judging.judge import judge_files
from grader.model.repair import KINDS
from grader.model.result import CriterionResult
from grader.model.verdict import Status
from tests.package.trees import facts_of, plain
from tests.support.advice import apply_advice
from tests.support.shapes import LOGIC, REPAIRED_AS, REWORDED, ROUNDS_MAX, found_in, repair, shapes_of

pytestmark = pytest.mark.usefixtures("without_processes")
SHORTER = "mcr2-basic-comms"
WITHOUT_NODES = {"unit-tests", "two-packages"}
"""Or without any in the package that operators change."""
each_lab = pytest.mark.parametrize(
    "lab",
    [
        pytest.param(lab, marks=[] if lab == SHORTER else pytest.mark.full)
        for lab in labs()
        if lab not in WITHOUT_NODES
    ],
)


@pytest.mark.full
def test_there_are_enough() -> None:
    found = {lab: len(shapes_of(lab)) for lab in labs()}
    assert sum(found.values()) >= 40
    assert {lab for lab, number in found.items() if not number} == WITHOUT_NODES


@each_lab
def test_each_fault_is_found_and_undone(lab: str, tmp_path: Path, subtests: pytest.Subtests) -> None:
    for shape, tree in shapes_of(lab).items():
        with subtests.test(shape):
            folder = tmp_path / shape
            write_tree(tree, folder)
            check_undone(folder, lab, shape.partition("/")[2].split("+"))


def check_undone(folder: Path, lab: str, operators: list[str]) -> None:
    repairs = found_in(folder, lab)
    wanted = [REPAIRED_AS[name] for name in operators if name not in LOGIC]
    assert [one.kind for one in repairs] == sorted(wanted, key=KINDS.index)
    repair(folder, lab, repairs)
    right, now = solution_of(lab).tree, read_tree(folder)
    assert {path: entry.executable for path, entry in now.items()} == {
        path: entry.executable for path, entry in right.items()
    }
    if not set(operators) & {*LOGIC, *REWORDED}:
        assert {p: plain(p, e.data) for p, e in now.items()} == {
            p: plain(p, e.data) for p, e in right.items()
        }


# ---- what the report says, done literally


@each_lab
def test_advice_on_files_is_followed_word_by_word(
    lab: str, tmp_path: Path, subtests: pytest.Subtests
) -> None:
    """Nothing is lost then that the files alone show, and on the way nothing that was not named at first."""
    for shape, tree in shapes_of(lab).items():
        with subtests.test(shape):
            write_tree(tree, tmp_path / shape)
            check_followed(tmp_path / shape / solution_of(lab).folder, lab)


def check_followed(package: Path, lab: str) -> None:
    first = left = lost_by_files(package, lab)
    for _ in range(ROUNDS_MAX):
        for criterion in left.values():
            apply_advice(criterion, package)
        left = lost_by_files(package, lab)
        assert left.keys() <= first.keys()
    assert {name: criterion.hint for name, criterion in left.items()} == {}


def lost_by_files(package: Path, lab: str) -> dict[str, CriterionResult]:
    loaded = rubric_of(lab)
    found = judge_files(loaded.rubric, facts_of(package, loaded.rubric.package), loaded.checks)
    lost = [verdict.criterion for verdict in found if verdict.criterion.status.is_lost]
    return {c.id: c for c in lost if c.status is not Status.BLOCKED}
