"""Faults of scenarios: what is started, set, sent, called and answered, and when a run has seen enough."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from grader.errors import RubricError
from grader.rubric.find import rubrics_folder
from grader.rubric.load import goals_of, load_rubric, rates_of
from tests.rubric.samples import faults, spoiled


@pytest.mark.parametrize(
    ("probe", "fault"),
    [
        ("{topic: /x, type: std_msgs/Int8}", ": sends nothing: give text, integers, among or values"),
        ("{topic: x, type: std_msgs/String, text: 1}", '.topic: a topic begins with a slash: "/x"'),
        ("{topic: /x, type: std_msgs/String, text: 1, integers: 1}", ".integers: is not for std_msgs/String"),
        (
            "{topic: /x, type: std_msgs/Int8, among: [0, 128]}",
            ".among[1]: an Int8 holds -128 to 127, not 128",
        ),
        ("{topic: /x, type: std_msgs/UInt8, among: [-1]}", ".among[0]: an UInt8 holds 0 to 255, not -1"),
        (
            "{topic: /x, type: std_msgs/Strin, text: 1}",
            '.type: ROS Noetic has no message type std_msgs/Strin (did you mean "std_msgs/String"?)',
        ),
        (
            "{topic: /x, type: Int8, integers: 1}",
            '.type: must be a type like std_msgs/String, not "Int8" (did you mean "std_msgs/Int8"?)',
        ),
        ("{topic: /x, type: std_msgs/String, text: 1, times: 2}", ".times: is for values"),
        (
            "{topic: /x, type: geometry_msgs/Twist, values: [{linear: {x: 1}}, {linear: {w: 1}}]}",
            ".values[1]: geometry_msgs/Vector3 has no field w",
        ),
        ("{topic: /x, type: std_msgs/Int8, values: [200]}", ".values[0]: 200 is out of range for int8"),
        (
            "{topic: /x, type: std_msgs/Float32, values: [1.0e+39]}",
            ".values[0]: 1e+39 is out of range for float32",
        ),
        ("{topic: /x, type: geometry_msgs/Twist, integers: 2}", ".integers: is not for geometry_msgs/Twist"),
    ],
)
def test_probes_that_make_no_sense(probe, fault, tmp_path):
    path = spoiled(tmp_path, ("    until:", f"    probes: [{probe}]\n    until:"))
    assert f"lab.yaml:11: scenarios.real.probes[0]{fault}" in faults(path)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            "script: src/talker.py",
            "program: turtlesim",
            ".start[0].program: must be a program like turtlesim/turtlesim_node",
        ),
        ("script: src/talker.py", "built: false", ".start[0]: give one of"),
        (
            "script: src/talker.py",
            "script: a.py, after: talker",
            '.start[0].after: there is no earlier start "talker"',
        ),
        (
            "window_s: 5",
            'window_s: "5 s"',
            '.until.window_s: must be a number, not "5 s": write 5, the key says seconds',
        ),
        ("window_s: 5", "window_s: soon", '.until.window_s: must be a number, not "soon"'),
        (
            "window_s: 5",
            "ended: [taker]",
            '.until.ended[0]: there is no start "taker" (did you mean "talker"?)',
        ),
        ("window_s: 5", "quiet_s: 90", ".until.quiet_s: 90 s can never pass within limit_s, 60 s"),
        ("window_s: 5", "alive_s: -1", ".until.alive_s: must be at least 0, not -1"),
        (
            "    start:",
            "    params: [{value: 1}]\n    start:",
            ".params[0]: give one of name and file, not neither",
        ),
        (
            "    start:",
            "    params: [{name: a, file: b}]\n    start:",
            ".params[0]: give one of name and file, not both",
        ),
        ("    start:", "    params: [{name: a}]\n    start:", ".params[0]: give one of value and made_up"),
        (
            "    start:",
            "    params: [{file: a, value: 1}]\n    start:",
            ".params[0].value: is for a parameter with",
        ),
        (
            "    start:",
            "    params: [{name: a, value: 1, also: [b]}]\n    start:",
            ".params[0].also: is for a file",
        ),
        (
            "    start:",
            "    calls: [{service: reset, type: std_srvs/Empty}]\n    start:",
            '.calls[0].service: a service begins with a slash: "/reset"',
        ),
    ],
)
def test_what_a_run_does_makes_sense(old, new, fault, tmp_path):
    found = faults(spoiled(tmp_path, (old, new)))
    assert any(f": scenarios.real{fault}" in line for line in found), found


@pytest.mark.parametrize(
    ("old", "new", "goals"),
    [
        ("", "", {1: (2.5, 5, 1.5), 2: (math.inf, 0, math.inf), 3: (1.5, 0, 0.5)}),
        (", within_s: 1.5}", "}", {1: (math.inf, 5, math.inf), 2: (math.inf, 0, math.inf), 3: (1.5, 0, 0.5)}),
        (
            ", goal: 2, status: ABORTED",
            ", goal: 2, within_s: 8, status: ABORTED",
            {1: (2.5, 5, 1.5), 2: (12, 0, 8), 3: (1.5, 0, 0.5)},
        ),
        (
            ", result: {total: 5}, within_s: 1.5}",
            ", feedback: 7}",
            {1: (0, 7, 0), 2: (math.inf, 0, math.inf), 3: (1.5, 0, 0.5)},
        ),
    ],
    ids=["as it is", "no within_s", "half as long again", "of feedback alone"],
)
def test_how_long_the_result_of_a_goal_matters_and_how_much_feedback_it_takes(
    old: str, new: str, goals: dict[int, tuple[float, int, float]], tmp_path: Path
) -> None:
    text = (rubrics_folder() / "examples" / "action-server.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "lab.yaml"
    path.write_text(text.replace(old, new).replace("limit_s: 5}", "limit_s: 20}"), encoding="utf-8")
    found = goals_of(load_rubric(str(path)).rubric)["goals"]
    assert found == {("/count", number): judged for number, judged in goals.items()}


@pytest.mark.parametrize(
    ("old", "new", "ends"),
    [
        ("", "", True),
        ("data, value: {made_up: color}}", "data, value: {made_up: color}, when: first}", True),
        ("data, value: {made_up: color}}", "data, value: {made_up: color}, when: last}", False),
        ("data, value: {made_up: color}}", "data, values: [{made_up: color}, red]}", False),
        ("topic: /state, field", "topic: /lamp/state, field", False),
        ("check: field-equals,\n     with: {topic: /state, field: data, value: {made_up: color}}",
         "check: prints,\n     with: {process: lamp, text: lit}", False),
    ],
)  # fmt: skip
def test_clear_rates_end_a_run_in_which_nothing_is_judged_that_may_come_later(
    old: str, new: str, ends: bool, tmp_path: Path
) -> None:
    text = (rubrics_folder() / "examples" / "params-and-namespaces.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "lab.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    assert ("colored" in rates_of(load_rubric(str(path)).rubric)) == ends


CALL = "{service: /reset, type: std_srvs/Empty}"
CRITERION = """    check: service-answers
    with: {service: /reset, expect: [{}, {}]}
"""


def with_calls(folder: Path, calls: str) -> Path:
    """The sound rubric with a criterion for two answers, and these calls in its scenario."""
    return spoiled(
        folder,
        ("    check: rate\n    with: {topic: /chatter, rate_hz: 10}\n", CRITERION),
        ("    until: {", f"    calls: [{calls}]\n    until: {{"),
    )


@pytest.mark.parametrize("calls", [f"{CALL}, {CALL}", f"{CALL}, {CALL}, {CALL}"])
def test_enough_calls(tmp_path: Path, calls: str) -> None:
    assert load_rubric(str(with_calls(tmp_path, calls))).rubric.criteria[0].check == "service-answers"


@pytest.mark.parametrize(
    ("calls", "made"),
    [
        (CALL, "1 of them"),
        ("", "none"),
        ("{service: /other, type: std_srvs/Empty}", "none"),
    ],
)
def test_too_few_calls_are_a_fault(tmp_path: Path, calls: str, made: str) -> None:
    with pytest.raises(RubricError) as caught:
        load_rubric(str(with_calls(tmp_path, calls)))
    [fault] = caught.value.faults
    assert fault.endswith(
        f"lab.yaml:18: criteria[0].with.expect: asks for 2 calls of /reset; real makes {made}"
    )
