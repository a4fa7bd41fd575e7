"""The rubric of the Leeds lab: its fixed ids and points, and two whole submissions as evidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from grader.checks import CHECKS
from grader.judging import judge, reached_pass_mark, total_points
from grader.rubric.model import Rubric
from tests.support.timeline import build_runs

POINTS = {
    "manifest": 5,
    "cmake": 5,
    "build": 5,
    "talker-executable": 5,
    "listener-executable": 5,
    "talker-node": 5,
    "chatter": 5,
    "chatter-rate": 10,
    "numeric-type": 10,
    "numeric-rate": 5,
    "counter-start": 5,
    "counter-step": 5,
    "counter-wrap": 15,
    "listener-chatter": 5,
    "listener-numeric": 5,
    "launch": 5,
}
ADVICE = {"dependencies": 0, "talker-name": 0}
FILE = Path(__file__).parents[2] / "rubrics" / "leeds-comp3631-lab1.yaml"
STOPPED = {"stopped_by": "INT", "exit_code": 0}
NUMBERS = {"topic": "/numeric_chatter", "type": "std_msgs/Int8", "callerid": "/numeric_talker"}


@pytest.fixture(scope="module")
def rubric() -> Rubric:
    return Rubric.model_validate(yaml.safe_load(FILE.read_text(encoding="utf-8")))


def submission(last: int = 127, **numbers: Any) -> dict[str, Any]:
    values = {"count_from": 0, "wrap_after": last}
    counter = {**NUMBERS, "values": values, **numbers}
    script = "#!/usr/bin/env python"
    return {
        "runs": {
            "talker": {
                "topics": [
                    {"topic": "/chatter", "callerid": "/numeric_talker", "count": 61},
                    {**counter, "count": 61},
                ],
                "processes": [
                    {"name": "talker", "script": "src/numeric_talker.py", "exit_s": 6.9, **STOPPED}
                ],
                "actors": [{"action": "interrupt", "actor": "grader", "detail": "talker", "at_s": 6.6}],
            },
            "wraps": {
                "clock": "warped",
                "warp": 20,
                "topics": [{**counter, "count": 258, "rate_hz": 200}],
                "processes": [{"name": "talker", **STOPPED}],
            },
            "listener": {
                "processes": [{"name": "listener", **STOPPED}],
                "actors": [
                    {"action": "publish", "topic": "/chatter", "values": ["qwertz", "asdfgh"], "at_s": 1},
                    {
                        "action": "publish",
                        "topic": "/numeric_chatter",
                        "values": [5, -128, 0, 127],
                        "at_s": 2,
                    },
                ],
                "console": [
                    {"process": "listener", "lines": ["I heard qwertz", "I heard asdfgh"], "at_s": 1.01},
                    {"process": "listener", "lines": ["5", "-128", "0", "127"], "at_s": 2.01},
                ],
            },
            "launch": {
                "topics": [{"topic": "/chatter", "callerid": "/talker"}],
                "subscribers": {"/chatter": ["/listener"]},
                "processes": [{"name": "roslaunch", **STOPPED}],
            },
            "package": {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0}]},
        },
        "package": {
            "manifest": {
                "dependencies": [["buildtool_depend", "catkin"], ["depend", "rospy"], ["depend", "std_msgs"]]
            },
            "cmake": {"calls": [["project", "lab1"], ["find_package", "catkin"], ["catkin_package"]]},
            "files": [{"path": f"src/numeric_{n}.py", "shebang": script} for n in ("talker", "listener")],
            "launch_files": [{"path": "launch/lab1.launch"}],
        },
    }


def test_ids_and_points(rubric: Rubric) -> None:
    assert {c.id: c.points for c in rubric.criteria} == POINTS | ADVICE
    assert rubric.max_points == 100


def test_parameters_fit_their_checks(rubric: Rubric) -> None:
    for criterion in rubric.criteria:
        check = CHECKS[criterion.check]
        check.params.model_validate(criterion.parameters)
        assert (criterion.scenario is not None) is check.needs_run
        assert criterion.reproduce


@pytest.mark.parametrize("last", [127, 126])
def test_both_readings_get_full_marks(rubric: Rubric, last: int) -> None:
    results = judge(rubric, build_runs(submission(last)))
    assert {r.id: r.status.value for r in results} == dict.fromkeys(POINTS | ADVICE, "pass")
    assert total_points(rubric, results) == 100
    assert reached_pass_mark(rubric, results)


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ({"type": "std_msgs/Int16"}, {"numeric-type": "fail"}),
        ({"values": {"count_from": 1, "wrap_after": 127}}, {"counter-start": "fail"}),
        ({"values": {"count_from": 0, "wrap_after": 127, "wrap_to": 1}}, {"counter-wrap": "fail"}),
        ({"values": {"count_from": 0, "step": 2, "wrap_after": 126}}, {"counter-step": "fail"}),
        (
            {"topic": "/Numeric_Chatter"},
            {"numeric-type": "fail"}
            | dict.fromkeys(["numeric-rate", "counter-start", "counter-step", "counter-wrap"], "blocked"),
        ),
        (
            {"type": "std_msgs/String", "values": ["0", "1", "2"]},
            {"numeric-type": "fail"}
            | dict.fromkeys(["counter-start", "counter-step", "counter-wrap"], "blocked"),
        ),
    ],
)
def test_one_fault_costs_its_own_criterion(
    rubric: Rubric, numbers: dict[str, Any], lost: dict[str, str]
) -> None:
    results = judge(rubric, build_runs(submission(**numbers)))
    assert {r.id: r.status.value for r in results if r.status.value != "pass"} == lost
    for result in results:
        if result.status.value == "blocked":
            assert result.message.startswith("blocked by numeric-type: ")
