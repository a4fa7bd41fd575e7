"""Slips in the examples' rubrics: each is refused with its line and what to write, before any student is graded."""

from __future__ import annotations

import ast
import re
import shutil
from pathlib import Path

import pytest

from grader.ros_packages import STANDINS
from grader.rubric.find import rubrics_folder
from grader.rubric.load import load_rubric
from grader.rubric.standins import PROGRAMS as PROGRAMS_KNOWN
from tests.rubric.samples import faults


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the examples, with what lies beside them."""
    return shutil.copytree(rubrics_folder() / "examples", tmp_path_factory.mktemp("rubrics") / "examples")


def _spoiled(examples: Path, name: str, old: str, new: str) -> Path:
    text = (examples / f"{name}.yaml").read_text(encoding="utf-8")
    assert old in text
    path = examples / "spoiled.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


FIELDS = [
    ("tf-broadcaster", "transforms[*].header", "transforms.header",
     ("47: criteria[4].with.field: tf2_msgs/TFMessage: transforms is a list: write transforms[0].header, or "
     "transforms[*].header")),
    ("tf-broadcaster", "topic: /distance, field: data", 'topic: /tf, field: "transforms[0].translation.x"',
     ("51: criteria[6].with.field: transforms[0] of tf2_msgs/TFMessage has no field translation "
     '(did you mean "transform"?)')),
    ("scan-to-cmd-vel", "field: linear.x, value: 0.2", "field: linear.X, value: 0.2",
     '33: criteria[2].with.field: linear of geometry_msgs/Twist has no field X (did you mean "x"?)'),
    ("avoid-obstacles", 'field: "ranges[0]"', 'field: "range[0]"',
     '47: criteria[4].with.cause.field: sensor_msgs/LaserScan has no field range (did you mean "ranges"?)'),
    ("own-message", "field: temperature", "field: temprature",
     '39: criteria[6].with.field: thermometer/Reading has no field temprature (did you mean "temperature"?)'),
    ("own-message", "within_s: 0.1", "within_s: 0.1, field: temperature",
     "37: criteria[5].with.field: temperature of thermometer/Reading is float64, no Header and no time"),
    ("own-message", "field: temperature, min: 10, max: 30", "field: state, min: 256",
     "39: criteria[6].with.field: state of thermometer/Reading is uint8, 0 to 255: none of these is within the bounds"),
    ("own-message", "field: temperature", "field: header.frame_id",
     "39: criteria[6].with.field: header.frame_id of thermometer/Reading is string, and bounds are for numbers"),
    ("two-packages", "{temperature: 29}", "{temprature: 29}",
     ("24: scenarios.alarm.steps[0].publish.values[0]: weather_msgs/Reading has no field temprature "
     '(did you mean "temperature"?)')),
    ("two-packages", "{temperature: 29}", "{temperature: warm}",
     "24: scenarios.alarm.steps[0].publish.values[0]: temperature of weather_msgs/Reading is a number, not 'warm'"),
    ("action-server", "goal: {target: 5}", "goal: {tagret: 5}",
     ("21: scenarios.goals.steps[0].action.goal: the goal of counting/Count has no field tagret "
     '(did you mean "target"?)')),
    ("action-server", "result: {total: 5}", "result: {totl: 5}",
     '33: criteria[3].with.result: the result of counting/Count has no field totl (did you mean "total"?)'),
    ("action-server", "result: {total: 5}", "result: {total: 3000000000}",
     ("33: criteria[3].with.result: total of the result of counting/Count is int32, -2147483648 to 2147483647, "
     "and never 3e+09")),
    ("service-client", "response.sum", "response.total",
     ("38: criteria[1].with.fields.response.total: the rubric's definition of adder/Add has no response.total "
     '(did you mean "response.sum"?)')),
    ("service-client", "response.sum: int64", "response.sum: int32",
     "38: criteria[1].with.fields.response.sum: is int64 in the rubric's definition of adder/Add, not int32"),
    ("service-own-type", "{result: 0.5, changed: false}", "{result: 0.5, changed: 0}",
     "48: criteria[3].with.expect[2]: changed of the response of own_service/Clamp is true or false, not 0"),
    ("latched-map", "value: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]", "value: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 200]",
     "45: criteria[6].with.field: data[11] of nav_msgs/OccupancyGrid is int8, -128 to 127, and never 200"),
]  # fmt: skip
"""Fields that a message does not have, and values that a field never has."""
PROGRAMS = [
    ("avoid-obstacles", "/robot_world/walls", "/robot_world/wall",
     '19: scenarios.room.params[0].name: robot_world has no parameter wall (did you mean "walls"?)'),
    ("avoid-obstacles", "/robot_world/boxes", "/boxes",
     "20: scenarios.room.params[1].name: robot_world reads private parameters: write /robot_world/boxes"),
    ("avoid-obstacles", "[1.8, 1.2, 2.3, 1.7]", "[1.8, 1.2]",
     "20: scenarios.room.params[1].value: boxes is [[x0, y0, x1, y1], …]"),
    ("avoid-obstacles", "start, value: [0.6, 0.6, 0.0]", "robot, value: turtlebot",
     "21: scenarios.room.params[2].value: robot is turtlebot3 or stage"),
    ("avoid-obstacles", "robot_world/robot_world}", 'robot_world/robot_world, args: ["_radus:=0.2"]}',
     '23: scenarios.room.start[0].args[0]: robot_world has no parameter radus (did you mean "radius"?)'),
    ("avoid-obstacles", "steps: [wait", "steps: [set_param: {name: /robot_world/nois, value: 0.1}, wait",
     '25: scenarios.room.steps[0].set_param.name: robot_world has no parameter nois (did you mean "noise"?)'),
    ("avoid-obstacles", "cause: {topic: /scan", "cause: {topic: /base_scan",
     '47: criteria[4].with.cause.topic: no program of the scenario has /base_scan (did you mean "/scan"?)'),
    ("avoid-obstacles", "/base_pose_ground_truth", "/base_pose_groundtruth",
     ("45: criteria[3].with.topic: no program of the scenario has /base_pose_groundtruth "
      '(did you mean "/base_pose_ground_truth"?)')),
    ("turtle-square", "/square/side, value: 1.0", "/turtlesim/backgroud_r, value: 9",
     '28: scenarios.restart.params[0].name: turtlesim has no parameter backgroud_r (did you mean "background_r"?)'),
    ("turtle-square",
     "check: path\n    with: {topic: /turtle1/pose, points: [[0, 0], [2, 0], [2, 1]], tolerance_m: 0.3}",
     ("check: launch-runs\n    "
      "with: {launch: turtle.launch, programs: [turtlesim/turtlesim_node], params: {bckground_r: 9}}"),
     ("170: criteria[12].with.params.bckground_r: turtlesim/turtlesim_node has no parameter bckground_r "
      '(did you mean "background_r"?)')),
]  # fmt: skip
"""Parameters and topics that the grader's programs do not have."""


@pytest.mark.parametrize(("name", "old", "new", "fault"), [*FIELDS, *PROGRAMS])
def test_a_slip_is_refused(examples: Path, name: str, old: str, new: str, fault: str) -> None:
    assert faults(_spoiled(examples, name, old, new)) == [f"spoiled.yaml:{fault}"]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("own-message", "field: temperature", "field: humidity"),
        ("two-packages", "{temperature: 29}", "{temperature: 29, wind: 3}"),
        ("scan-to-cmd-vel", "field: linear.x, value: 0.2", "field: twist.linear.x, value: 0.2"),
        ("tf-broadcaster", "transforms[*].header", "transforms[*].header.stamp"),
        ("action-server", "result: {total: 5}", "result: {total: 5, seconds: 1}"),
        ("avoid-obstacles", "start, value: [0.6, 0.6, 0.0]", "map, value: package://rooms/room.yaml"),
        ("turtle-square", "/square/side, value: 1.0", "/turtlesim/holonomic, value: true"),
    ],
)
def test_what_may_be_right_is_taken(examples: Path, name: str, old: str, new: str) -> None:
    assert load_rubric(str(_spoiled(examples, name, old, new))).rubric.id == name


def test_the_parameters_of_the_robot_world_are_known() -> None:
    """The program itself runs on ROS's Python alone: its source is read."""
    source = (STANDINS / "robot_world" / "world_node.py").read_text(encoding="utf-8")
    tables = [node.value for node in ast.parse(source).body
              if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in {"ROBOTS", "SHARED"}]  # fmt: skip
    keys = [
        key for table in tables for one in ast.walk(table) if isinstance(one, ast.Dict) for key in one.keys
    ]
    named = {key.value for key in keys if isinstance(key, ast.Constant)}
    asked = set(re.findall(r'get_param\("~(\w+)"', source))
    program = PROGRAMS_KNOWN["robot_world/robot_world"]
    assert program.params == (named - {"turtlebot3", "stage"}) | asked
    documented = (Path(__file__).parents[2] / "docs/how-to/robot-world.md").read_text(encoding="utf-8")
    table = documented[documented.index("| parameter |") :]
    rows = "".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| `"))
    assert program.params == set(re.findall(r"`(\w+)`", rows))
