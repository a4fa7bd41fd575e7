"""The rubric of the Leeds lab: its fixed ids and points, and two whole submissions as evidence."""

from __future__ import annotations

from typing import Any

import pytest

from grader.judging import judge, reached_pass_mark, total_points
from tests.judging.labs import SHEBANG, STOPPED, assert_sound, lost_of, rubric_of
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
RUBRIC = rubric_of("leeds-comp3631-lab1")
NUMBERS = {"topic": "/numeric_chatter", "type": "std_msgs/Int8", "callerid": "/numeric_talker"}

PACKAGE = {
    "manifest": {
        "dependencies": [["buildtool_depend", "catkin"], ["depend", "rospy"], ["depend", "std_msgs"]]
    },
    "cmake": {"calls": [["project", "lab1"], ["find_package", "catkin"], ["catkin_package"]]},
    "files": [{"path": f"src/numeric_{n}.py", "shebang": SHEBANG} for n in ("talker", "listener")],
    "launch_files": [{"path": "launch/lab1.launch"}],
}


def submission(last: int = 127, **numbers: Any) -> dict[str, Any]:
    values = {"count_from": 0, "wrap_after": last}
    counter = {**NUMBERS, "values": values, **numbers}
    return {"runs": _runs(counter), "package": PACKAGE}


def _runs(counter: dict[str, Any]) -> dict[str, Any]:
    return {
        "talker": {
            "topics": [
                {"topic": "/chatter", "callerid": "/numeric_talker", "count": 61},
                {**counter, "count": 61},
            ],
            "processes": [{"name": "talker", "script": "src/numeric_talker.py", "exit_s": 6.9, **STOPPED}],
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
    }


def test_ids_and_points() -> None:
    assert_sound(RUBRIC, POINTS | ADVICE)


@pytest.mark.parametrize("last", [127, 126])
def test_both_readings_get_full_marks(last: int) -> None:
    results = judge(RUBRIC, build_runs(submission(last)))
    assert {r.id: r.status.value for r in results} == dict.fromkeys(POINTS | ADVICE, "pass")
    assert total_points(RUBRIC, results) == 100
    assert reached_pass_mark(RUBRIC, results)


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
def test_one_fault_costs_its_own_criterion(numbers: dict[str, Any], lost: dict[str, str]) -> None:
    results = judge(RUBRIC, build_runs(submission(**numbers)))
    assert lost_of(RUBRIC, results) == lost
    blocked = [one.message for one in results if one.status.value == "blocked"]
    assert all(message.startswith("blocked by numeric-type: ") for message in blocked)
