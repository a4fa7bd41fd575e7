"""Groups, gates, bonuses and penalties: what they are worth, and every fault with its line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.rubric.load import load_rubric
from grader.rubric.model import Rubric
from tests.rubric.samples import faults, spoiled

MORE = """\
  - {id: third, title: Third, points: 30, check: manual}
  - {id: fourth, title: Fourth, points: 30, check: manual}
"""


def with_points(folder: Path, *lines: str, more: str = "") -> Path:
    """The sound rubric (talker-node 40, chatter-rate 60) with these lines at its top, and more criteria."""
    path = spoiled(folder, ("package: lab1\n", "\n".join(["package: lab1", *lines, ""])))
    path.write_text(path.read_text() + more)
    return path


def worth(rubric: Rubric) -> dict[str, float]:
    return {c.id: c.points for c in rubric.criteria}


def test_a_groups_points_are_shared_out_by_weight_and_none_gets_lost(tmp_path):
    more = "  - {id: third, title: Third, points: 2, check: manual}\n"
    path = with_points(
        tmp_path, "groups: {all: {points: 100, criteria: [talker-node, chatter-rate, third]}}", more=more
    )
    path.write_text(re.sub("points: [46]0", "points: 2", path.read_text()))
    rubric = load_rubric(str(path)).rubric
    assert worth(rubric) == {"talker-node": 33.4, "chatter-rate": 33.3, "third": 33.3}
    assert rubric.max_points == 100


def test_the_best_of_a_group_make_the_most_that_can_be_reached(tmp_path):
    path = with_points(
        tmp_path, "groups: {some: {points: 60, best: 2, criteria: [chatter-rate, third, fourth]}}"
    )
    path.write_text(path.read_text().replace("points: 60\n", "points: 30\n") + MORE)
    rubric = load_rubric(str(path)).rubric
    assert worth(rubric) == {"talker-node": 40, "chatter-rate": 30, "third": 30, "fourth": 30}
    assert rubric.max_points == 100


def test_bonus_and_penalty_are_not_of_the_hundred(tmp_path):
    extra = MORE.replace("points: 30", "bonus: 5", 1).replace("points: 30", "penalty: 3")
    rubric = load_rubric(str(with_points(tmp_path, more=extra))).rubric
    assert [c.extra for c in rubric.criteria] == [0, 0, 5, -3]
    assert rubric.max_points == 100


@pytest.mark.parametrize(
    ("line", "more", "fault"),
    [
        (
            "gates: [{criterion: talker-nod, at_most: 20}]",
            "",
            '6: gates[0].criterion: there is no criterion "talker-nod" (did you mean "talker-node"?)',
        ),
        (
            "gates: [{criterion: talker-node, at_most: 100}]",
            "",
            "6: gates[0].at_most: 100 keeps nothing away: the rubric has 100 points",
        ),
        (
            "groups: {nodes: {criteria: [talker-nod]}}",
            "",
            '6: groups.nodes.criteria[0]: there is no criterion "talker-nod" (did you mean "talker-node"?)',
        ),
        (
            "groups: {nodes: {criteria: [talker-node, talker-node]}}",
            "",
            '6: groups.nodes.criteria[1]: "talker-node" is in the group "nodes" already',
        ),
        (
            "groups: {nodes: {criteria: [talker-node, chatter-rate], best: 2}}",
            "",
            "6: groups.nodes.best: 2 of 2 is all of them",
        ),
        (
            "groups: {nodes: {criteria: [talker-node, chatter-rate], best: 1}}",
            "",
            "6: groups.nodes.criteria: need the same points, for only the best of them count",
        ),
        (
            "groups: {nodes: {criteria: [third]}}",
            "  - {id: third, title: Third, bonus: 5, check: manual}\n",
            '6: groups.nodes.criteria[0]: "third" has no points that a group could count',
        ),
        (
            "groups: {nodes: {points: 50, criteria: [talker-node]}}",
            "",
            "13: criteria: the points add up to 110",
        ),
        ("handout: h", "  - {id: third, title: T, check: manual}\n", "29: criteria[2].points: is missing"),
        (
            "handout: h",
            "  - {id: third, title: T, check: manual, points: 0, bonus: 5}\n",
            "29: criteria[2].bonus: give one of points, bonus and penalty, not points and bonus",
        ),
    ],
)
def test_each_fault_with_its_line(tmp_path, line, more, fault):
    found = faults(with_points(tmp_path, line, more=more))
    assert any(one.startswith(f"lab.yaml:{fault}") for one in found), found


def test_shares_that_are_uneven_are_refused(tmp_path):
    path = with_points(
        tmp_path, "digits: 0", "groups: {g: {points: 25, best: 2, criteria: [third, fourth, fifth]}}"
    )
    path.write_text(path.read_text() + MORE + "  - {id: fifth, title: F, points: 30, check: manual}\n")
    assert "lab.yaml:7: groups.g.points: 25 points cannot be shared out evenly to the best 2" in faults(path)
