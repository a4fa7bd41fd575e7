"""What a rubric names is there: each slip of an instructor's is refused with file, line and suggestion."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.checks import CHECKS
from grader.ros_env import RosInstallation, RosPackages
from grader.rubric import references
from grader.rubric.load import load_rubric
from grader.rubric.spelling import names_seen_once
from grader.rubric.yaml_lines import WrittenRubric
from tests.rubric.samples import faults, spoiled

LAB = """\
schema: grader.rubric/1
id: sample
title: A sample
version: "1"
package: lab1
scenarios:
  real:
    title: The talker
    start:
      - {name: talker, script: src/talker.py}
    until: {window_s: 5, topics: [/chatter]}
  listener:
    title: The listener
    params:
      - {name: /side, made_up: number}
    start:
      - {name: listener, script: src/listener.py}
    probes:
      - {topic: /chatter, type: std_msgs/String, text: 8}
    calls:
      - {service: /reset, type: std_srvs/Trigger}
    until: {heard: true}
  launch:
    title: Launched
    start:
      - {name: turtlesim, program: turtlesim/turtlesim_node}
      - {name: roslaunch, launch: lab1.launch}
    until: {connected: [/chatter], alive_s: 3}
criteria:
"""
ONE = "  - {{id: c{0}, title: One, points: {1}, check: {2}, with: {3}, scenario: {4}}}\n"
SOUND = (
    ("node-lives", "{process: talker}", "real"),
    ("rate", "{topic: /chatter, rate_hz: 10}", "real"),
    ("topic-type", "{topic: /chatter, type: std_msgs/String}", "real"),
    ("hears", "{topic: /chatter}", "listener"),
    ("params-read", "{names: [/side]}", "listener"),
    ("service", "{service: /reset, type: std_srvs/Trigger}", "listener"),
    ("launch-runs", "{launch: lab1.launch, programs: [turtlesim/turtlesim_node]}", "launch"),
    ("path", "{topic: /turtle1/pose, points: [[1, 0]], tolerance_m: 0.1}", "launch"),
    ("connected", "{topic: /chatter}", "launch"),
    ("logs", "{text: a}", "launch"),
)

FOLLOWED = {"window_s: 5", "launch: lab1.launch}\n", "until: {window_s: 5, topics: [/chatter]}"}
"""Slips that two criteria notice, or the scenario and a criterion."""


@pytest.fixture(autouse=True)
def _stand_ins_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with ROS, and with no packages but the stand-ins."""
    ros = RosInstallation(
        kind="debian", where="x", distro="x", python="python3", prefixes=(), env={"PATH": ""}
    )
    monkeypatch.setattr(references, "ros_packages", lambda: RosPackages(ros))


def _written(folder: Path, old: str = "", new: str = "") -> Path:
    rows = [ONE.format(n, 100 / len(SOUND), *row) for n, row in enumerate(SOUND)]
    text = LAB + "".join(rows)
    assert old in text
    path = folder / "lab.yaml"
    path.write_text(text.replace(old, new, 1) if old else text, encoding="utf-8")
    return path


def test_what_names_only_what_is_there_loads(tmp_path: Path) -> None:
    other = "package: lab1\nhandout: Look at rospy_tutorials/talker.py first.\n"
    for path in (_written(tmp_path), _written(tmp_path, "package: lab1\n", other)):
        assert len(load_rubric(str(path)).rubric.criteria) == len(SOUND)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        pytest.param(
            "{process: talker}",
            "{process: taker}",
            '30: criteria[0].with.process: real starts no process "taker" of the student\'s (did you mean "talker"?)',
            id="process",
        ),
        pytest.param(
            "check: logs, with: {text: a}, scenario: launch",
            "check: manifest, with: {name: lab2}",
            '39: criteria[9].with.name: the lab has no package "lab2" (did you mean "lab1"?)',
            id="package",
        ),
        pytest.param(
            "script: src/listener.py}",
            'script: src/listener.py, args: ["_rate=5"]}',
            "17: scenarios.listener.start[0].args[0]: ROS reads _rate:=5, with a colon, and not _rate=5",
            id="argument-without-its-colon",
        ),
        pytest.param(
            "roslaunch, launch: lab1.launch}",
            "roslaunch, launch: lab1.launch, args: ['gui=false']}",
            "27: scenarios.launch.start[1].args[0]: ROS reads gui:=false, with a colon, and not gui=false",
            id="argument-of-a-launch-file",
        ),
        pytest.param(
            "    calls:\n      - {service: /reset, type: std_srvs/Trigger}\n",
            "    steps:\n      - call: {service: /reset, type: std_srvs/Triger}\n",
            '21: scenarios.listener.steps[0].call.type: std_srvs has no service type "Triger" '
            '(did you mean "Trigger"?)',
            id="type-of-a-service-in-a-step",
        ),
        pytest.param(
            "service: /reset, type: std_srvs/Trigger}, scenario",
            "service: /reset, type: std_srvs/Empty}, scenario",
            "35: criteria[5].with.type: listener has /reset as std_srvs/Trigger, not as std_srvs/Empty",
            id="type-of-the-service-that-is-called",
        ),
        pytest.param(
            "    calls:\n",
            "    steps: [{wait: {topic: /chater}}]\n    calls:\n",
            '20: scenarios.listener.steps[0].wait.topic: no criterion names /chater (did you mean "/chatter"?)',
            id="topic-of-a-wait",
        ),
        pytest.param(
            "programs: [turtlesim/turtlesim_node]}",
            "nodes: {/recorder: rosbags}}",
            '36: criteria[6].with.nodes./recorder: there is no ROS package "rosbags" (did you mean "rosbag"?)',
            id="package-of-a-node",
        ),
        pytest.param(
            "{process: talker}",
            "{process: talker, names: [talker.py]}",
            "30: criteria[0].with.names[0]: is the name of a node, not of its file: write talker",
            id="file-for-a-node",
        ),
        pytest.param(
            "{text: a}",
            "{text: a, process: turtlesim}",
            '39: criteria[9].with.process: launch starts no process "turtlesim" of the student\'s: there is roslaunch',
            id="process-of-the-grader",
        ),
        pytest.param(
            "check: logs, with: {text: a}",
            "check: action-result, with: {action: /count}",
            "39: criteria[9].with.action: no step of launch sends a goal to /count: there is none",
            id="action",
        ),
        pytest.param(
            "check: logs, with: {text: a}",
            "check: rostest, with: {process: turtlesim}",
            '39: criteria[9].with.process: launch starts no .test file as "turtlesim": there is none',
            id="tests-that-are-no-tests",
        ),
        pytest.param(
            "check: logs, with: {text: a}",
            "check: file-left, with: {file: run.bag}",
            '39: criteria[9].with.file: launch keeps no file "run.bag": there is none; add it to its keeps',
            id="file-that-is-not-kept",
        ),
        pytest.param(
            "check: logs, with: {text: a}, scenario: launch",
            'check: definition, with: {file: msg/A.msg, fields: {a: "std_msgs/Strin[]"}}',
            '39: criteria[9].with.fields.a: std_msgs has no message type "Strin" (did you mean "String"?)',
            id="type-of-a-field",
        ),
        pytest.param(
            "program: turtlesim/turtlesim_node",
            "program: turtlesim/turtlesim",
            '26: scenarios.launch.start[0].program: turtlesim has no program "turtlesim" '
            '(did you mean "turtlesim_node"?)',
            id="program",
        ),
        pytest.param(
            "program: turtlesim/turtlesim_node",
            "program: turtle_sim/turtlesim_node",
            '26: scenarios.launch.start[0].program: this machine has no ROS package "turtle_sim" '
            '(did you mean "turtlesim"?)',
            id="package-of-program",
        ),
        pytest.param(
            "launch: lab1.launch}\n",
            "launch: lab1}\n",
            "27: scenarios.launch.start[1].launch: roslaunch takes the file's whole name: \"lab1.launch\"",
            id="launch-without-ending",
        ),
        pytest.param(
            "{process: talker}",
            "{process: talker, min_s: 8}",
            "30: criteria[0].with.min_s: 8 s is more than the scenario lasts: window_s, 5 s",
            id="min_s",
        ),
        pytest.param(
            "window_s: 5",
            "window_s: 4.9",
            "31: criteria[1].with.min_window_s: 5 s is more than the scenario lasts: window_s, 4.9 s",
            id="min_window_s-by-default",
        ),
        pytest.param(
            "until: {window_s: 5, topics: [/chatter]}",
            "steps: [{wait: {seconds: 4.95}}]",
            "31: criteria[1].with.min_window_s: 5 s is more than the scenario lasts: its steps, 4.95 s",
            id="min_window_s-of-steps",
        ),
        pytest.param(
            "until: {window_s: 5, topics: [/chatter]}",
            "until: {topics: [/chatter], window_s: 3}\n    steps: [{wait: {seconds: 4}}]",
            "",
            id="steps-and-window",
        ),
        pytest.param(
            "until: {window_s: 5, topics: [/chatter]}",
            "steps: [{wait: {node: /talker}}, {wait: {seconds: 1}}]",
            "",
            id="steps-that-wait",
        ),
        pytest.param(
            "{heard: true}",
            "{heard: true, limit_s: 0.5}",
            "",
            id="nothing-judges-its-length",
        ),
        pytest.param(
            "check: hears, with: {topic: /chatter}",
            "check: hears, with: {topic: /chater}",
            '33: criteria[3].with.topic: no probe of listener sends on /chater (did you mean "/chatter"?)',
            id="hears",
        ),
        pytest.param(
            "topics: [/chatter]",
            "topics: [/chatter, /cheater]",
            '11: scenarios.real.until.topics[1]: no criterion and no probe names /cheater (did you mean "/chatter"?)',
            id="until-topics",
        ),
        pytest.param(
            "script: src/listener.py",
            "script: /home/me/src/listener.py",
            "17: scenarios.listener.start[0].script: is a path in the student's package, from its folder: "
            "scripts/listener.py, not /home/me/src/listener.py",
            id="absolute-script",
        ),
        pytest.param(
            "window_s: 5, topics: [/chatter]",
            "messages: {/chatter: 700}",
            "11: scenarios.real.until.messages./chatter: 700 messages at 10 Hz take 70 s, and limit_s is 60 s",
            id="count-that-never-comes",
        ),
        pytest.param(
            "topics: [/chatter]",
            "topics: [/chatter, /tf]",
            "11: scenarios.real.until.topics[1]: no criterion and no probe names /tf",
            id="until-tf-that-nobody-judges",
        ),
        pytest.param(
            "window_s: 5, topics: [/chatter]",
            "messages: {/odometry: 3}",
            "11: scenarios.real.until.messages./odometry: no criterion and no probe names /odometry",
            id="until-messages",
        ),
        pytest.param(
            "connected: [/chatter]",
            "connected: [/chater]",
            "28: scenarios.launch.until.connected[0]: no criterion and no probe names /chater "
            '(did you mean "/chatter"?)',
            id="until-connected",
        ),
        pytest.param("connected: [/chatter]", "connected: [/odometry]", "", id="a-launch-file-may-know-it"),
        pytest.param("connected: [/chatter]", "connected: [/turtle2/pose]", "", id="another-number"),
        pytest.param(
            "check: launch-runs, with: {launch: lab1.launch",
            "check: launch-runs, with: {launch: lab.launch",
            '36: criteria[6].with.launch: launch does not start "lab.launch" (did you mean "lab1.launch"?)',
            id="launch",
        ),
        pytest.param(
            "scenario: launch}",
            "scenario: real}",
            '36: criteria[6].with.launch: real does not start "lab1.launch": there is none',
            id="launch-in-another-scenario",
        ),
        pytest.param(
            "type: std_msgs/String}, scenario",
            "type: std_msgs/Strng}, scenario",
            '32: criteria[2].with.type: std_msgs has no message type "Strng" (did you mean "String"?)',
            id="message-type",
        ),
        pytest.param(
            "type: std_msgs/String}, scenario",
            "type: lab/Count}, scenario",
            '32: criteria[2].with.type: this machine has no ROS package "lab" (did you mean "lab1"?)',
            id="package-of-type",
        ),
        pytest.param(
            "type: std_msgs/String}, scenario",
            "type: lab1/Count}, scenario",
            "32: criteria[2].with.type: elsewhere in the rubric /chatter carries std_msgs/String, not lab1/Count",
            id="two-types-on-one-topic",
        ),
        pytest.param("/chatter, type: std_msgs/String}, s", "/odd, type: lab1/Count}, s", "", id="own-type"),
        pytest.param("/chatter, type: std_msgs/String}, s", "/odd, type: gazebo_msgs/LinkState}, s", "", id="not-here"),
        pytest.param(
            "type: std_srvs/Trigger}\n",
            "type: std_srvs/Triger}\n",
            '21: scenarios.listener.calls[0].type: std_srvs has no service type "Triger" (did you mean "Trigger"?)',
            id="type-of-a-call",
        ),
        pytest.param(
            "check: logs, with: {text: a}, scenario: launch",
            "check: logs, with: {text: a}, scenario: real",
            "",
            id="still-used",
        ),
        pytest.param(
            "programs: [turtlesim/turtlesim_node]",
            "programs: [talker]",
            '36: criteria[6].with.programs[0]: name its package too, like turtlesim/turtlesim_node, not "talker"; '
            "programs of the students' own go under scripts",
            id="program-without-a-package",
        ),
        pytest.param(
            "check: path, with: {topic: /turtle1/pose, points: [[1, 0]], tolerance_m: 0.1}",
            "check: field-bounds, with: {topic: /turtle1/pose, field: x, min: 0}",
            "37: criteria[7].with.topic: turtlesim/turtlesim_node publishes on /turtle1/pose, "
            "and field-bounds judges the student's messages: give it of: program",
            id="topic-of-a-program",
        ),
        pytest.param(
            "check: path, with: {topic: /turtle1/pose, points: [[1, 0]], tolerance_m: 0.1}",
            "check: field-bounds, with: {topic: /turtle1/pose, field: x, min: 0, of: program}",
            "",
            id="topic-of-a-program-and-its-messages",
        ),
        pytest.param(
            "{topic: /chatter, rate_hz: 10}",
            "{topic: /chatter, rate_hz: 10, of: program}",
            "31: criteria[1].with.topic: the scenario starts no program, "
            "and rate judges the messages of one (of: program)",
            id="messages-of-no-program",
        ),
        pytest.param(
            "{topic: /chatter, rate_hz: 10}",
            "{topic: chatter, rate_hz: 10}",
            '31: criteria[1].with.topic: a name of the graph begins with a slash: "/chatter"',
            id="topic-without-a-slash",
        ),
        pytest.param(
            "    start:\n      - {name: talker",
            "    clock: warped\n    start:\n      - {name: talker",
            "32: criteria[1].with.min_window_s: rates are judged in real time, "
            "and a fast clock goes in steps of 0.05 s: give the criterion a scenario with clock: real",
            id="rate-with-a-fast-clock",
        ),
        pytest.param(
            "check: logs, with: {text: a}, scenario: launch",
            "check: reacts, with: {cause: {topic: /chater}, effect: {topic: /pong}, within_s: 1}, scenario: listener",
            "39: criteria[9].with.cause.topic: nothing in listener sends on /chater, and no other criterion names it "
            '(did you mean "/chatter"?)',
            id="cause-that-never-comes",
        ),
        pytest.param(
            "check: logs, with: {text: a}, scenario: launch",
            "check: reacts, with: {cause: {topic: /chatter}, effect: {topic: /chatter, field: text, value: a}, "
            "within_s: 1}, scenario: real",
            "39: criteria[9].with.effect.field: std_msgs/String has no field text: there is data",
            id="field-that-the-type-lacks",
        ),
        pytest.param(
            "check: logs, with: {text: a}",
            "check: field-bounds, with: {topic: /scan, field: 'ranges[3]', min: 0}",
            "",
            id="field-of-a-type-that-is-not-known",
        ),
        pytest.param(
            "check: logs, with: {text: a}",
            "check: manifest, with: {name: lab1, dependencies: [rospy, std_msg, python3-serial]}",
            '39: criteria[9].with.dependencies[1]: there is no ROS package "std_msg" (did you mean "std_msgs"?)',
            id="dependency",
        ),
        pytest.param(
            "check: node-lives, with: {process: talker}",
            "check: executable, with: {path: src/talkr.py}",
            '30: criteria[0].with.path: no scenario starts talkr.py (did you mean "talker.py"?)',
            id="script-of-another-name",
        ),
        pytest.param(
            "{names: [/side]}",
            "{names: [/sides]}",
            '34: criteria[4].with.names[0]: listener sets no parameter /sides (did you mean "/side"?): '
            "add it to its params",
            id="parameter-that-nothing-sets",
        ),
    ],
)  # fmt: skip
def test_a_slip_is_refused(old: str, new: str, fault: str, tmp_path: Path) -> None:
    path = _written(tmp_path, old, new)
    if fault:
        assert f"lab.yaml:{fault}" in faults(path)
        assert len(faults(path)) == (2 if old in FOLLOWED else 1)
    else:
        assert load_rubric(str(path)).rubric.id == "sample"


SERVICE = """\
schema: grader.rubric/1
id: sample
title: A sample
version: "1"
package: lab1
scenarios:
  asks:
    title: The client asks
    params: [{name: /ask/times, value: 3}]
    serves: [{service: /add, type: lab1/Add, answer: {sum: 3}, definition: "int64 a\\n---\\nint64 sum"}]
    calls: [{service: /on, type: std_srvs/SetBool}]
    start: [{name: ask, script: scripts/ask.py}]
    until: {ended: [ask]}
criteria:
  - {id: asks, title: It asks, points: 20, check: calls, with: {service: /add, expect: {a: 1}}, scenario: asks}
  - {id: file, title: A file, points: 20, check: definition, with: {file: msg/Reading.msg, fields: {at: time}}}
  - {id: node, title: A node, points: 20, check: node-lives, with: {process: ask, names: [ask]}, scenario: asks}
  - {id: type, title: A type, points: 20, check: topic-type, with: {topic: /r, type: lab1/Reading}, scenario: asks}
  - {id: answers, title: It answers, points: 20, check: service-answers, scenario: asks,
     with: {service: /on, expect: [{success: true}]}}
"""


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("{a: 1}", "{b: 1}", "15: criteria[0].with.expect: the request of lab1/Add has no field b: there is a"),
        ("{a: 1}", "[{a: 1}, {a: one}]",
         "15: criteria[0].with.expect[1]: a of the request of lab1/Add is a number, not 'one'"),
        ("success: true", "sucess: true",
         ("20: criteria[4].with.expect[0]: the response of std_srvs/SetBool has no field sucess "
          '(did you mean "success"?)')),
        ("type: lab1/Reading", "type: lab1/Readings",
         ('18: criteria[3].with.type: no criterion asks for Readings (did you mean "lab1/Reading"?): '
         "if it is right, say it in the handout too")),
        ("/ask/times", "/asks/times",
         '9: scenarios.asks.params[0].name: the node is called ask, and not asks (did you mean "/ask/times"?)'),
        ("int64 a", "int46 a",
         '10: scenarios.asks.serves[0].definition: there is no type "int46" (did you mean "int64"?)'),
        ("type: std_srvs/SetBool", "type: std_srvs/SetBool, request: {date: true}",
         '11: scenarios.asks.calls[0].request: std_srvs/SetBoolRequest has no field date (did you mean "data"?)'),
        ("definition, with: {file: msg/Reading.msg, fields: {at: time}}}",
         "transform, scenario: asks, with: {parent: odom, child: odom}}",
         "16: criteria[1].with: parent and child are both odom"),
        ("check: topic-type, with: {topic: /r, type: lab1/Reading}",
         "check: field-equals, with: {topic: /r, field: a, value: '2', tolerance: 1}",
         "18: criteria[3].with: tolerance is for numbers, and text has none: write a number without quotes"),
        ("check: topic-type, with: {topic: /r, type: lab1/Reading}",
         "check: field-equals, with: {topic: /tf, field: transforms, value: 2}",
         ("18: criteria[3].with.field: tf2_msgs/TFMessage: transforms is a list: give all its values, "
          "or name transforms[0] or transforms[*]")),
        ("check: topic-type, with: {topic: /r, type: lab1/Reading}",
         "check: manifest, with: {name: lab1, dependencies: [labb1]}",
         '18: criteria[3].with.dependencies[0]: there is no package "labb1" (did you mean "lab1"?)'),
        ("at: time", "at: tme", '16: criteria[1].with: there is no type "tme" (did you mean "time"?)'),
        ("type: lab1/Reading", "type: lab1/Reading, definition: 'tme at'",
         '18: criteria[3].with.definition: there is no type "tme" (did you mean "time"?)'),
    ],
)  # fmt: skip
def test_a_slip_in_own_types_is_refused(old: str, new: str, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "lab.yaml"
    path.write_text(SERVICE)
    assert load_rubric(str(path)).rubric.id == "sample"
    path.write_text(SERVICE.replace(old, new))
    assert faults(path) == [f"lab.yaml:{fault}"]


def test_what_a_map_of_a_checks_parameters_names_is_looked_at(tmp_path: Path) -> None:
    keeps = "alive_s: 3}\n    keeps: ['*.bag']\n"
    left = "check: file-left, with: {file: run.bag, topics: {/chatter: {type: %s}}}"
    for kind, fault in (
        ("String", []),
        ("Strng", ['std_msgs has no message type "Strng" (did you mean "String"?)']),
    ):
        path = _written(tmp_path, "check: logs, with: {text: a}", left % f"std_msgs/{kind}")
        path.write_text(path.read_text().replace("alive_s: 3}\n", keeps))
        where = "lab.yaml:40: criteria[9].with.topics./chatter.type: "
        assert (faults(path) if fault else []) == [where + one for one in fault]
        assert fault or load_rubric(str(path)).rubric.scenarios["launch"].keeps == ("*.bag",)


def test_a_name_that_one_line_alone_has_is_warned_of(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").touch()
    names = {
        "topic": "/stet",
        "file": "walks.csv",
        "child": "laser",
        "parent": "/base",
        "path": "test_it.py",
        "text": "no name",
        "log": "/rosout",
    }
    own = {"check": "topic-type", "with": {"topic": "/own", "type": "lab1/Own"}}
    bounds = {"check": "field-bounds", "with": {"topic": "/own", "field": "a.hight[0]"}}
    run = {"keeps": ["*.csv"], "start": [{"name": "talker", "script": "src/talker.py"}]}
    data = {
        "package": "lab1",
        "handout": "The laser is 0.2 m ahead of `/base`.",
        "scenarios": {"a": run},
        "criteria": [{"with": names}, own, bounds],
    }
    found = {str(path[-1]): why for path, why in names_seen_once(WrittenRubric(data), tmp_path)}
    assert sorted(found) == ["field", "file", "topic"]
    assert found["topic"] == "nothing else in the rubric names /stet: is it spelt as in the handout?"
    renamed = {**data, "scenarios": {"goal": run}}  # no map of fields
    assert {str(path[-1]) for path, _ in names_seen_once(WrittenRubric(renamed), tmp_path)} == set(found)


def test_a_scenario_that_no_criterion_judges_is_refused(tmp_path: Path) -> None:
    idle = "  idle:\n    title: I\n    start: [{name: a, script: a.py}]\n    until: {nodes: 1}\n"
    path = spoiled(tmp_path, ("criteria:\n", f"{idle}criteria:\n"))
    assert faults(path) == [
        "lab.yaml:12: scenarios.idle: no criterion judges this scenario: remove it, or name it in one"
    ]


def test_where_there_is_no_ros_only_a_slip_is_known() -> None:
    here = RosPackages(None)
    assert here.program_fault("stage_ros/stageros") == ""
    assert here.program_fault("turtlsim/turtlesim_node") == (
        'there is no ROS package "turtlsim" (did you mean "turtlesim"?)'
    )
    assert here.type_fault("course_msgs/Lap", "msg") == ""
    assert here.type_fault("course_msgs/Lap", "srv") == ""


def test_packages_of_a_workspace_are_known_with_their_programs_and_types(tmp_path: Path) -> None:
    package = tmp_path / "ws" / "src" / "sim" / "course_sim"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>course_sim</name></package>")
    (package / "msg" / "Lap.msg").write_text("int32 number\n")
    for place in (package / "scripts", tmp_path / "ws" / "devel" / "lib" / "course_sim"):
        place.mkdir(parents=True)
        (place / f"{place.name}_node").write_text("#!/bin/sh\n")
        (place / f"{place.name}_node").chmod(0o755)
    env = {"ROS_PACKAGE_PATH": f"{tmp_path}/ws/src", "CMAKE_PREFIX_PATH": f"{tmp_path}/ws/devel"}
    here = RosPackages(
        RosInstallation(kind="setup", where="x", distro="x", python="python3", prefixes=(), env=env)
    )
    assert set(here.programs("course_sim")) == {"scripts_node", "course_sim_node"}
    assert here.program_fault("course_sim/scripts_node") == ""
    assert here.type_fault("course_sim/Lap", "msg") == ""
    assert here.type_fault("course_sim/Lab", "msg") == (
        'course_sim has no message type "Lab" (did you mean "Lap"?)'
    )
    assert not here.lacks("course_sim")
    assert here.lacks("gazebo_ros")


def test_every_process_topic_and_program_of_a_check_is_known_as_one() -> None:
    """A check that takes a process or a program by name declares it, so that the rubric's loader can look."""
    declared = {
        (check.name, one.path[0])
        for check in CHECKS.values()
        for one in check.references({name: ["a"] for name in check.params.model_fields})
    }
    named = {
        (check.name, name)
        for check in CHECKS.values()
        for name in check.params.model_fields
        if name in {"process", "programs", "launch", "min_s", "min_window_s"}
    }
    assert named <= declared


@pytest.mark.parametrize(
    ("args", "name", "right"),
    [
        ("__ns:=green", "talker", "/green/talker"),
        ("__ns:=/a/b/", "/talker", "/a/b/talker"),
        ("__name:=voice", "talker", "/voice"),
        ("__ns:=green", "/green/talker", ""),
        ("_rate:=5", "talker", ""),
    ],
)
def test_a_node_has_the_name_that_its_start_gives_it(
    args: str, name: str, right: str, tmp_path: Path
) -> None:
    path = _written(tmp_path, "{process: talker}", f"{{process: talker, names: [{name}]}}")
    path.write_text(path.read_text().replace("src/talker.py}", f"src/talker.py, args: ['{args}']}}"))
    fault = f"lab.yaml:30: criteria[0].with.names[0]: the node is started with {args}: write {right}"
    if right:
        assert faults(path) == [fault]
    else:
        assert load_rubric(str(path)).rubric.criteria[0].parameters["names"] == [name]
