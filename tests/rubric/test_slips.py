"""Slips in the examples' rubrics: each is refused with its line and what to write, before any student is graded."""

from __future__ import annotations

import ast
import math
import random
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import yaml

from grader.errors import RubricError
from grader.ros_env import STANDINS
from grader.rubric import validation_warnings
from grader.rubric.find import rubrics_folder
from grader.rubric.load import load_rubric, warnings_of
from grader.rubric.simulators import FIELD_M, ROBOTS
from grader.rubric.simulators import PROGRAMS as PROGRAMS_KNOWN
from grader.rubric.step_faults import step_faults
from grader.rubric.yaml_lines import WrittenRubric
from tests.rubric.samples import faults

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
SLIPS = Path(__file__).with_name("slips.yaml")


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the examples, with what lies beside them, and a lab with a package of the course's."""
    folder = shutil.copytree(rubrics_folder() / "examples", tmp_path_factory.mktemp("rubrics") / "examples")
    return shutil.copytree(Path(__file__).with_name("rover"), folder, dirs_exist_ok=True)


def _spoiled(examples: Path, name: str, old: str, new: str) -> Path:
    text = (examples / f"{name}.yaml").read_text(encoding="utf-8")
    assert old in text
    path = examples / "spoiled.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


COUNTERS = [
    ("maximum: 127, wraps: 2", "maximum: 300, wraps: 2",
     "151: criteria[12].with.maximum: data of std_msgs/Int8 is int8, -128 to 127, and never 300"),
    ("minimum: 0, maximum: 127", "minimum: 127, maximum: 0",
     "151: criteria[12].with: minimum, 127, is not less than maximum, 0"),
    ("wraps: 2", "wraps: 5", "151: criteria[12].with.wraps: wraps ends after 258 messages, and 5 wraps take 641"),
    ("258", "100", "151: criteria[12].with.wraps: wraps ends after 100 messages, and 2 wraps take 257"),
    ("maximum: 127, rate_hz: 10}\n    scenario: wraps", "maximum: 127, rate_hz: 1}\n    scenario: talker",
     "142: criteria[11].with.rate_hz: at 1 Hz 10 steps take 10 s, and window_s is 6 s"),
]  # fmt: skip
"""Slips in the rubric of a lab with a counter."""
NAMES = [
    ("record-and-replay", "topics: {/steps", "topics: {/step", "38: criteria[3].with.topics./step", "/step", "/steps"),
    ("turtle-square", "publisher: square", "publisher: sqare", "75: criteria[2].with.publisher", "sqare", "square"),
    ("turtle-square", "with: {name: /square/side", "with: {name: /sqare/side", "111: criteria[6].with.name",
     "/sqare/side", "/square/side"),
    ("cpp-and-python", "script: average", "script: averge", "22: scenarios.tests.start[0].script", "averge", "average"),
    ("own-message", "names: [sensor]", "names: [senor]", "31: criteria[2].with.names[0]", "senor", "sensor"),
    ("own-message", "frame_id: thermometer", "frame_id: thermomter", "37: criteria[5].with.frame_id", "thermomter",
     "thermometer"),
    ("scan-to-cmd-vel", "package: scan_to_cmd_vel", "package: scan_to_cmd_ve", "8: package", "scan_to_cmd_ve",
     "scan_to_cmd_vel"),
    ("params-and-namespaces", "field: data, value: white", "field: daat, value: white", "50: criteria[4].with.field",
     "daat", "data"),
    ("go-to-goal", 'text: "goal reached', 'text: "goal reched', "45: criteria[7].with.text", "reched", "reached"),
    ("cpp-and-python", "path: scripts/alarm.py", "path: script/alarm.py", "35: criteria[2].with.path",
     "script/alarm.py", "scripts/alarm.py"),
    ("record-and-replay", "columns: [step, distance]", "columns: [step, distanc]",
     "50: criteria[6].with.columns[1]",
     "distanc", "distance"),
    ("service-client", "file: srv/Add.srv", "file: srv/Adds.srv", "38: criteria[1].with.file", "srv/Adds.srv", "Add"),
]  # fmt: skip
"""Names that one line alone has, and that are a letter off."""


LISTED = LOADER(SLIPS.read_text(encoding="utf-8")).get_single_data()


@pytest.mark.parametrize("slip", [slip for slip in LISTED if "fault" in slip], ids=lambda slip: slip["fault"])
def test_a_slip_is_refused(examples: Path, slip: dict[str, str]) -> None:
    path = _spoiled(examples, slip["lab"], slip["old"], slip["new"])
    assert faults(path) == [f"spoiled.yaml:{slip['fault']}"]


@pytest.mark.parametrize(
    "slip", [slip for slip in LISTED if "warning" in slip], ids=lambda slip: slip["warning"]
)
def test_what_may_be_a_slip_is_a_warning(examples: Path, slip: dict[str, str]) -> None:
    path = _spoiled(examples, slip["lab"], slip["old"], slip["new"])
    assert warnings_of(load_rubric(str(path)), path.name) == [f"spoiled.yaml:{slip['warning']}"]


@pytest.mark.parametrize(
    ("name", "text", "new", "why"),
    [
        ("battery", "battery low,", '"battery low.*",', "it is no pattern"),
        ("service-own-type", '"refused:"', '"^refused:$"', "it is no pattern"),
        ("battery", "battery low,", '"battery low: {number}",', "prints has {number}, logs has not"),
    ],
)
def test_a_text_is_no_pattern(examples: Path, name: str, text: str, new: str, why: str) -> None:
    path = _spoiled(examples, name, f"text: {text}", f"text: {new}")
    assert f"text: is compared letter by letter: {why}" in "".join(warnings_of(load_rubric(str(path)), ""))


def test_calls_of_one_service_have_one_type(examples: Path) -> None:
    old = "type: own_service/Clamp, request: {value: -3"
    path = _spoiled(examples, "service-own-type", old, old.replace("Clamp", "Clip"))
    fault = "scenarios.server.calls[1].type: an earlier call of /clamp has own_service/Clamp: a service has one type"
    assert f"spoiled.yaml:21: {fault}" in faults(path)


def test_a_topic_and_a_service_may_have_one_name() -> None:
    publish = {"topic": "/reset", "type": "std_msgs/Empty", "value": {}}
    call = {"service": "/reset", "type": "std_srvs/Empty", "request": {}}
    assert not [*step_faults((), {"steps": [{"publish": publish}, {"call": call}]})]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        # odometry does not begin at the robot's place in the world
        ("follow-wall", "/base_pose_ground_truth, goal: [3.4, 1.8]", "/odom, goal: [1.2, 0.6]"),
        ("battery", "on `/heartbeat` at 1 Hz", "on `/heartbeat` once a second"),
        # values that are nearly equal do not repeat each other
        ("battery", "values: [false, true, false]", "values: [1, 1], tolerance: 0.1"),
    ],
)
def test_what_a_right_node_can_do_is_asked_without_a_warning(
    examples: Path, name: str, old: str, new: str
) -> None:
    found = warnings_of(load_rubric(str(_spoiled(examples, name, old, new))), "x")
    assert not [one for one in found if "never moves" in one or "repeats" in one]


@pytest.mark.parametrize("path", sorted(rubrics_folder().rglob("*.yaml")), ids=lambda path: path.stem)
def test_a_rubric_of_the_graders_own_loads_without_a_word(path: Path) -> None:
    assert warnings_of(load_rubric(str(path)), path.name) == []


@pytest.mark.parametrize(
    "name", ["tf-broadcaster", "turtle-square", "scan-to-cmd-vel", "battery", "action-server"]
)
def test_any_value_of_a_criterion_may_be_made_up(examples: Path, name: str) -> None:
    """It is a map then, where a text or a number was."""
    written = (examples / f"{name}.yaml").read_text(encoding="utf-8")
    for index, criterion in enumerate(LOADER(written).get_single_data()["criteria"]):
        for key in criterion.get("with", ()):
            data: Any = LOADER(written).get_single_data()
            data["criteria"][index]["with"][key] = {"made_up": "number"}
            for _, fault in validation_warnings.warnings(WrittenRubric(data)):
                assert isinstance(fault, str)


def test_a_service_that_is_asked_nothing_changes_a_rate_from_its_call_on(examples: Path) -> None:
    step = "      - call: {service: /slower, type: std_srvs/Trigger}\n      - publish:"
    path = _spoiled(examples, "battery", "      - publish:", step)
    text, cause = (
        path.read_text(encoding="utf-8"),
        "cause: {topic: /battery_state, field: percentage, max: 0.2}",
    )
    path.write_text(text.replace(cause, "cause: {topic: /slower}"), encoding="utf-8")
    assert load_rubric(str(path)).rubric.criteria


@pytest.mark.parametrize(
    "path",
    # turtle-square shows every kind of criterion of its simulator, and is no lab to copy from
    sorted(
        set((rubrics_folder() / "examples").glob("*.yaml"))
        - {rubrics_folder() / "examples/turtle-square.yaml"}
    ),
    ids=lambda path: path.stem,
)
def test_an_example_has_sixty_lines_at_most(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        # the package is one letter off from a topic, and types are in it
        ("service-client", "adder", "adds"),
        # the handout has two messages of almost one name
        ("own-message", "file: msg/Reading.msg", "file: msg/Reading2.msg"),
        # which goal it is has nothing to do with the handout's numbers
        ("action-server", "A target below 0 is", "A target below 20 is"),
        # a folder of the package may be called like the program that runs its scripts
        ("own-message", "scripts/sensor.py", "python/sensor.py"),
        # a word of capitals in braces may be printed
        ("go-to-goal", 'text: "goal reached', 'text: "{INFO} goal reached'),
        # the field has another unit than the handout's range, or the handout has its range, too
        ("own-message", "10 to 30", "1 to 3 % of the temperature"),
        ("own-message", "10 to 30", "1 to 3 by the temperature; it is 10 to 30"),
        # a simulator has topics that only students use
        ("follow-wall", "looks at /scan", "looks at `/scan`"),
        # points and dashes are in many texts, and a parameter is no plain argument
        ("go-to-goal", "goal reached:", "goal... [reached] - "),
        ("service-client", '["1", "2"]', '["1", "2", "_wait:=true"]'),
    ],
)
def test_what_looks_like_a_slip_and_is_none_is_accepted(
    examples: Path, name: str, old: str, new: str
) -> None:
    path = examples / "spoiled.yaml"
    path.write_text((examples / f"{name}.yaml").read_text(encoding="utf-8").replace(old, new))
    found = warnings_of(load_rubric(str(path)), path.name)
    assert not [one for one in found if "did you mean" in one or "has 20" in one or "to max is" in one]


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        # a value that is a little too large tests what the node does with it
        ("battery", "value: {percentage: 0.9}", "value: {percentage: 1.5}"),
        # a robot that may move sideways
        ("scan-to-cmd-vel", "forward at 0.2 m/s, or 0", "sideways at 0.2 m/s (linear.y), or 0"),
        # the student publishes where the grader does
        ("latched-map", "{topic: /map, limit_s: 8}", "{topic: /obstacle, limit_s: 8}"),
        # the answers have numbers of their own, and those of another call
        ("service-own-type", "{result: -2.25, changed: true}", "{result: -1, changed: true}"),
    ],
)
def test_what_was_meant_is_accepted(examples: Path, name: str, old: str, new: str) -> None:
    path = _spoiled(examples, name, old, new)
    text = path.read_text(encoding="utf-8").replace("linear.x, value: 0.2", "linear.y, value: 0.2")
    text = text.replace("messages: {/map: 3}", "messages: {/map: 3, /obstacle: 9}")
    path.write_text(text, encoding="utf-8")
    found = warnings_of(load_rubric(str(path)), path.name)
    assert not [one for one in found if "never" in one or "two wheels" in one or "swapped" in one]


STOPS = "linear.x, value: 0, tolerance: 0.01}, within_s: 1.5}"


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        # so much may be rounded
        ("battery", "percentage, max: 0.2}", "percentage, min: -0.001, max: 1.001}"),
        # what is never to be need not be possible, and a bound may be left out
        ("avoid-obstacles", STOPS, "linear.y, min: 0.01}, within_s: 1.5, never: true}"),
        ("avoid-obstacles", STOPS, "linear.y, min: null, max: 0.01}, within_s: 1.5}"),
    ],
)
def test_what_is_out_of_reach_may_be_named(examples: Path, name: str, old: str, new: str) -> None:
    found = warnings_of(load_rubric(str(_spoiled(examples, name, old, new))), "spoiled.yaml")
    assert not [one for one in found if "and never" in one or "cannot move" in one]


def test_a_client_may_be_asked_to_cancel_its_goal(examples: Path) -> None:
    served = "serves: [{action: /dock, type: adder/Dock, delay_s: 12}]"
    start = "start: [{name: client, script: scripts/add_client.py}]"
    stuck = f"  stuck:\n    title: Stuck\n    {served}\n    {start}\n    until: {{ended: [client]}}\n"
    asked = "check: reacts, with: {cause: {topic: /dock/goal}, effect: {topic: /dock/cancel}, within_s: 5}"
    criterion = f"  - {{id: stuck, title: stuck, points: 0, scenario: stuck, {asked}}}\n"
    path = _spoiled(examples, "service-client", "\ncriteria:\n", f"{stuck}\ncriteria:\n{criterion}")
    assert warnings_of(load_rubric(str(path)), path.name) == []


def test_a_field_may_be_asked_to_be_infinite(examples: Path) -> None:
    path = _spoiled(examples, "tf-broadcaster", "value: 5, tolerance: 0.01", "value: .inf, tolerance: 0.01")
    assert warnings_of(load_rubric(str(path)), path.name) == []


def test_a_key_that_is_indented_like_the_handout_counts_as_its_text(examples: Path) -> None:
    path = _spoiled(examples, "params-and-namespaces", "\nmade_up:", "\n  made_up:")
    told = '"made_up:" counts as its text: begin that line without blanks'
    assert faults(path)[0] == f"spoiled.yaml:9: handout: {told}"


def test_a_warp_of_nothing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    text = (rubrics_folder() / "leeds-comp3631-lab1.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace("warp: 20", "warp: 0"), encoding="utf-8")
    assert faults(path) == ["lab.yaml:21: scenarios.wraps.warp: must be at least 1, not 0"]


def test_more_rows_than_a_recording_or_the_run_gives_are_refused(examples: Path) -> None:
    path = _spoiled(examples, "record-and-replay", "rows_at_least: 8", "rows_at_least: 8000")
    text, slower = path.read_text(encoding="utf-8"), "walk.bag, speed: 0.01}"
    path.write_text(text.replace("walk.bag}", slower), encoding="utf-8")
    assert load_rubric(str(path)).rubric.id == "record-and-replay", "it plays for more than a minute"
    sent = "{publish: {topic: /steps, type: std_msgs/Float64, values: [1, 2, 0.25]}}"
    path.write_text(text.replace("{play: {bag: bags/walk.bag}}", sent), encoding="utf-8")
    told = "8000 in 40.3 s, which replay lasts at most, are more than 100 a second"
    assert faults(path) == [f"spoiled.yaml:50: criteria[6].with.rows_at_least: {told}"]


def test_a_goal_outside_of_the_box_that_another_criterion_keeps_the_robot_in(examples: Path) -> None:
    path = _spoiled(examples, "go-to-goal", "box: [[0.5, 0.5],", "box: [[6, 6],")
    fault = "is outside of the box that inside keeps it in"
    assert faults(path) == [
        f"spoiled.yaml:{line}.with.goal: {fault}" for line in ("37: criteria[3]", "39: criteria[4]")
    ]
    text = path.read_text(encoding="utf-8").replace("box: [[6, 6],", "share: 0.5, box: [[6, 6],")
    path.write_text(text, encoding="utf-8")
    assert load_rubric(str(path)).rubric.id == "go-to-goal", "for half of the time it may be elsewhere"


def test_lists_of_one_field_that_no_message_can_both_be_are_refused(examples: Path) -> None:
    path = _spoiled(
        examples, "latched-map", "100, 100, 0, 0, 0, 0, 0], when: last", "100, 0, 0, 0, 0, 0, 0], when: first"
    )
    told = "free wants data of /map otherwise in the same run"
    assert faults(path) == [f"spoiled.yaml:47: criteria[7].with: {told}"]


def test_what_is_known_of_the_simulators_is_what_they_are() -> None:
    """They run on ROS's Python alone: their sources are read."""
    source = ast.parse((STANDINS / "robot_world" / "world_node.py").read_text(encoding="utf-8"))
    table = next(
        n.value for n in source.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == "ROBOTS"
    )
    robots = eval(ast.unparse(table), {"math": math})  # noqa: S307 - the grader's own source
    known = {
        name: {key: robot[key] for key in ("max_linear", "samples", "radius")}
        for name, robot in robots.items()
    }
    assert known == ROBOTS
    field = ast.parse((STANDINS / "turtlesim" / "field.py").read_text(encoding="utf-8"))
    pixels = {
        ast.unparse(n.targets[0]): ast.unparse(n.value) for n in field.body if isinstance(n, ast.Assign)
    }
    assert math.isclose(
        (float(pixels["SIZE"]) - 1) / float(pixels["PIXELS_PER_METRE"]), FIELD_M, abs_tol=0.01
    )


@pytest.mark.parametrize(("old", "new", "fault"), COUNTERS)
def test_a_counter_that_no_message_shows_is_refused(old: str, new: str, fault: str, tmp_path: Path) -> None:
    text = (rubrics_folder() / "leeds-comp3631-lab1.yaml").read_text(encoding="utf-8")
    path = tmp_path / "lab.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    assert faults(path)[0] == f"lab.yaml:{fault}"


def test_a_rubric_that_names_no_fields_loads_no_definitions() -> None:
    """They take a quarter of a second, of the second within which a student sees the first verdict."""
    load = "import sys; from grader.rubric.load import load_rubric; load_rubric(sys.argv[1])"
    command = f"{load}; print('numpy' in sys.modules)"
    lab = str(rubrics_folder() / "leeds-comp3631-lab1.yaml")
    done = subprocess.run([sys.executable, "-c", command, lab], capture_output=True, check=True, text=True)
    assert done.stdout == "False\n"


@pytest.mark.parametrize("slip", NAMES, ids=lambda slip: slip[4])
def test_a_name_that_is_a_letter_off_is_refused(examples: Path, slip: tuple[str, ...]) -> None:
    name, old, new, where, word, meant = slip
    fault = f'nothing else in the rubric names {word} (did you mean "{meant}"?): if it is right, say it in the handout'
    path = _spoiled(examples, name, old, new)
    assert faults(path) == [f"spoiled.yaml:{where}: {fault} too"]
    text = path.read_text(encoding="utf-8").replace("handout: >\n", f"handout: >\n  It is called `{word}`.\n")
    path.write_text(text, encoding="utf-8")
    assert load_rubric(str(path)).rubric.id == name, "the handout names it"


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("own-message", "field: temperature", "field: humidity"),
        ("two-packages", "{temperature: 29}", "{temperature: 29, wind: 3}"),
        ("tf-broadcaster", "transforms[*].header", "transforms[*].header.stamp"),
        ("action-server", "result: {total: 5}", "result: {total: 5, seconds: 1}"),
        ("own-message", "temperature: float64", "temperature: thermometer/Pose"),
        ("own-message", "temperature: float64", "temperature: Celsius"),
        ("tf-broadcaster", "rotation_deg: [0, 0, 90]", "rotation_deg: [0, 0, 1.5]"),
        ("params-and-namespaces", '"state:=light"', '"state:=light", "~color:=red"'),
        ("turtle-square", "topic: /turtle1/pose, points", "topic: /turtle2/pose, points"),
        ("avoid-obstacles", "start, value: [0.6, 0.6, 0.0]", "map, value: package://rooms/room.yaml"),
        ("turtle-square", "/square/side, value: 1.0", "/turtlesim/holonomic, value: true"),
        ("turtle-square", "/square/side, value: 1.0", '/square/side, value: "one"'),
        ("turtle-square", "/square/side, value: 1.0", '/square/name, value: "7"'),
        ("scan-to-cmd-vel", '"ranges[*]", max: 0.5', '"ranges[*]", max: 0.3'),
        ("avoid-obstacles", 'field: "ranges[0]"', 'field: "ranges[359]"'),
        ("follow-wall", "least_m: 3}", "least_m: 13}"),
        ("turtle-square", "topics: [/turtle1/cmd_vel,", 'topics: ["/turtle1/*",'),
        ("service-client", '"20000000000", "5"', '"20000000000 or so", "5"'),
        ("record-and-replay", "rows_at_least: 8", "rows_at_least: 80"),
        ("record-and-replay", "walk.bag}}]", "walk.bag, speed: 0.01}}]"),
        ("action-server", "feedback: 5}", "feedback: 50}"),
        ("go-to-goal", "seconds: 9}", "seconds: 2.2}"),
        ("action-server", "within_s: 1.5", "within_s: 5"),
        ("avoid-obstacles", "within_s: 1.5", "within_s: 15"),
        (
            "service-own-type",
            "{start: server}]",
            "{start: server}, {call: {service: /clamp, type: own_service/Clamp, delay_s: 10}}]",
        ),
    ],
)
def test_what_may_be_right_is_taken(examples: Path, name: str, old: str, new: str) -> None:
    assert load_rubric(str(_spoiled(examples, name, old, new))).rubric.id == name


def test_a_step_may_send_several_goals(examples: Path) -> None:
    """The third goal is the last of the first step: the last step's wait is none of its own."""
    about, _, rest = (examples / "go-to-goal.yaml").read_text(encoding="utf-8").partition("    steps:\n")
    sent = "values: [{x: 8, y: 8}, {x: 3, y: 8}, {x: 3, y: 2}], rate_hz: 0.1"
    one = "      - publish: {topic: /goal, type: geometry_msgs/Pose2D, %s}\n      - wait: {seconds: 2}\n"
    steps = "".join(one % each for each in (sent, "value: {x: 3, y: 2}", "value: {x: 3, y: 2}"))
    path = examples / "spoiled.yaml"
    path.write_text(f"{about}    steps:\n{steps}\ncriteria{rest.partition('criteria')[2]}", encoding="utf-8")
    assert load_rubric(str(path)).rubric.id == "go-to-goal"


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


def test_a_bag_with_a_topic_that_is_a_letter_off_is_refused(examples: Path) -> None:
    text = (examples / "record-and-replay.yaml").read_text(encoding="utf-8")
    path = examples / "spoiled.yaml"
    path.write_text(text.replace("/steps", "/stepss"), encoding="utf-8")
    (fault,) = faults(path)
    assert fault.startswith(
        "spoiled.yaml:24: scenarios.replay.steps[0].play.bag: walk.bag has /steps, and the rubric"
    )


ODD = [
    None,
    [],
    {},
    [[1]],
    {"a": {}},
    "",
    "/",
    0,
    1e300,
    True,
    ":=",
    "{number}",
    "a/b",
    [None],
    {"field": [1]},
    {"made_up": "number"},
    [{"made_up": "number"}],
]


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.full) for seed in range(1, 6))])
def test_what_is_no_value_of_its_key_is_refused_and_ends_nothing(examples: Path, seed: int) -> None:
    choice = random.Random(seed).choice  # noqa: S311 - no secret
    files = sorted(path for path in examples.glob("*.yaml") if path.name != "spoiled.yaml")
    for _ in range(20):
        data = yaml.safe_load(choice(files).read_text(encoding="utf-8"))
        part, key = choice(list(_places(data)))
        part[key] = choice(ODD)
        if isinstance(made_up := data.setdefault("made_up", {}), dict):
            made_up["number"] = {"from": 1, "to": 9}
        path = examples / "spoiled.yaml"
        path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        with suppress(RubricError):
            assert isinstance(warnings_of(load_rubric(str(path)), path.name), list)


def _places(value: object) -> Iterator[tuple[Any, Any]]:
    for key in (
        range(len(value)) if isinstance(value, list) else list(value) if isinstance(value, dict) else ()
    ):
        yield value, key
        yield from _places(value[key])


THERMOSTAT = """\
schema: grader.rubric/1
id: thermostat
title: A thermostat
version: "1"
package: heating
handout: >
  Write a node `thermostat` (scripts/control.py). It hears /celsius, a std_msgs/Float32, and publishes after each on
  /heater (std_msgs/Bool) whether the heater is on: below 18 degrees it goes on, above 22 off. The line `quit` ends it.
scenarios:
  warm:
    title: Warm and cold
    start: [{name: control, script: scripts/control.py}]
    steps:
      - publish: {topic: /celsius, type: std_msgs/Float32, values: [20, 17, 23]}
      - type: {process: control, line: quit}
criteria:
  - {id: node, title: The node has its name, points: 50, check: node-name, with: {names: [thermostat]}, scenario: warm}
  - id: heater
    title: The heater goes on and off
    points: 50
    check: field-equals
    with: {topic: /heater, field: data, values: [false, true, false]}
    scenario: warm
    requires: [node]
"""
BY_THE_HANDOUT = [
    ("type: std_msgs/Float32, v", "type: std_msgs/Float64, v",
     "14: scenarios.warm.steps[0].publish.type: the handout says that /celsius carries std_msgs/Float32"),
    ("[20, 17, 23]", "[20, 17]", "22: criteria[1].with.values: are 3, and warm sends 2 messages"),
    ("line: quit", "line: Quit", "15: scenarios.warm.steps[1].type.line: the handout has `quit`"),
    ("names: [thermostat]", "names: [control]",
     "17: criteria[0].with.names[0]: is no node of the handout, which has thermostat"),
    ("    requires: [node]\n", "",
     "18: criteria[1].id: where the node does not start, node explains it: write requires: [node]"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "warning"), BY_THE_HANDOUT)
def test_what_the_handout_says_otherwise_is_a_warning(
    old: str, new: str, warning: str, tmp_path: Path
) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text(THERMOSTAT, encoding="utf-8")
    assert warnings_of(load_rubric(str(path)), path.name) == []
    assert old in THERMOSTAT
    path.write_text(THERMOSTAT.replace(old, new, 1), encoding="utf-8")
    assert warnings_of(load_rubric(str(path)), path.name) == [f"lab.yaml:{warning}"]


def test_a_text_may_stand_in_the_handout_with_the_place_for_its_number(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    asked = "check: prints, with: {process: control, text: 'is {number} degrees'}, scenario: warm, requires: [node]}"
    rubric = (
        THERMOSTAT.replace("points: 50", "points: 25") + f"  - {{id: said, title: Said, points: 50, {asked}\n"
    )
    for said, warnings in (("is {number} degrees", 0), ("Is {number} degrees", 1)):
        text = rubric.replace("handout:", f"# {said}\nhandout:").replace(
            "`quit`", f"`quit` and prints `{said}`"
        )
        path.write_text(text, encoding="utf-8")
        assert len(warnings_of(load_rubric(str(path)), path.name)) == warnings


def test_the_handout_says_which_type_a_topic_has(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text(THERMOSTAT.replace("[false, true, false]", "[0, 1, 0]"), encoding="utf-8")
    fault = "22: criteria[1].with.field: data of std_msgs/Bool is true or false, not 0"
    assert faults(path) == [f"lab.yaml:{fault}"]


def test_a_name_of_the_handout_or_of_a_made_up_value_is_a_slip(tmp_path: Path) -> None:
    text = THERMOSTAT.replace("[20, 17, 23]", "[20, {made_up: low}, 23]")
    path, made_up = tmp_path / "lab.yaml", "made_up: {low: {from: 1, to: 17}}\n"
    path.write_text(text.replace("{topic: /heater,", "{topic: /heatr,") + made_up, encoding="utf-8")
    fault = 'nothing else in the rubric names /heatr (did you mean "/heater"?)'
    assert faults(path)[0].startswith(f"lab.yaml:22: criteria[1].with.topic: {fault}")
    path.write_text(text.replace("control.py}", 'control.py, args: ["_l:=low"]}') + made_up, encoding="utf-8")
    fault = '"low" is the name of a made-up value: write _l:={made_up: low}'
    assert faults(path) == [f"lab.yaml:12: scenarios.warm.start[0].args[0]: {fault}"]


def test_a_service_of_another_type_than_in_the_handout_is_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    text = THERMOSTAT.replace("ends it.", "ends it. The service /cool, a std_srvs/Trigger, turns it off.")
    for kind, told in (
        ("Trigger", []),
        ("Empty", ["the handout says that /cool is of type std_srvs/Trigger"]),
    ):
        call = f"      - call: {{service: /cool, type: std_srvs/{kind}}}\ncriteria"
        path.write_text(text.replace("criteria", call, 1), encoding="utf-8")
        found = warnings_of(load_rubric(str(path)), path.name)
        assert [one.partition("call.type: ")[2] for one in found] == told


def test_a_title_may_speak_of_an_error_that_is_no_level(examples: Path) -> None:
    title = ("battery", "title: It says that the battery is low", "title: It says how large the error is")
    path = _spoiled(examples, *title)
    assert warnings_of(load_rubric(str(path)), path.name) == []


def test_a_rate_may_be_that_of_a_parameter_which_the_run_sets(examples: Path) -> None:
    path = _spoiled(
        examples,
        "battery",
        "script: scripts/watch_battery.py}",
        'script: scripts/watch_battery.py, args: ["_hz:=4"]}',
    )
    text = path.read_text(encoding="utf-8").replace("rate_hz: 5, cause", "rate_hz: 4, cause")
    path.write_text(text, encoding="utf-8")
    told = warnings_of(load_rubric(str(path)), path.name)
    assert [one for one in told if "rate_hz" in one] == []


def test_a_run_without_the_cause_may_have_another_rate(examples: Path) -> None:
    """The rate before anything is sent, in a run of its own, and those that messages bring about."""
    before = """  before:
    title: Nothing is sent
    start: [{name: monitor, script: scripts/watch_battery.py}]
    until: {topics: [/heartbeat], window_s: 6}
  launched:
"""
    path = _spoiled(examples, "battery", "  launched:\n", before)
    first = (
        "  - {id: first, title: Before, bonus: 5, check: rate, scenario: before, requires: [executable],\n"
    )
    first += "     with: {topic: /heartbeat, rate_hz: 1}}\n"
    path.write_text(path.read_text(encoding="utf-8").replace("  - {id: slow", f"{first}  - {{id: slow"))
    assert not [one for one in warnings_of(load_rubric(str(path)), path.name) if "wants" in one]
