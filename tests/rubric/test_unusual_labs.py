"""Rubrics of unusual labs: they are right, and load without a warning."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.rubric.load import load_rubric, warnings_of
from tests.rubric.samples import faults

RUNS = """\
schema: grader.rubric/1
id: sample
title: A sample
version: "1"
package: lab1
handout: {handout}
scenarios:
{scenarios}
criteria:
{criteria}
"""
RELAY = """\
  alone: {title: Alone, start: [{name: relay, script: relay.py}], until: {window_s: 5, topics: [/said]}}
  both:
    title: Both
    start: [{name: relay, script: relay.py}, {name: listen, script: listen.py}]
    steps: [publish: {topic: /said, type: std_msgs/String, value: hello}, wait: {topic: /said}]
    until: {quiet_s: 2}"""
PAIR = """\
  pair: {title: Pair, start: [{name: all, launch: pair.launch}], until: {nodes: 2}}"""
GROWS = """\
  grows: {title: Grows, start: [{name: maps, script: maps.py}], until: {window_s: 5, topics: [/map]}}"""
CLIENT = """\
  four:
    title: Four
    start: [{name: client, script: client.py}]
    serves: [{service: /get, type: rospy_tutorials/AddTwoInts, answer: {sum: 4}}]
    until: {ended: [client]}
  eight:
    title: Eight
    start: [{name: client, script: client.py}]
    serves: [{service: /get, type: rospy_tutorials/AddTwoInts, answer: {sum: 8}}]
    until: {ended: [client]}"""

AFTER_THREE = (
    "check: reacts, scenario: turns, requires: [c0],"
    " with: {cause: {topic: /level, field: data, min: 3}, effect: {topic: /clean}, within_s: 3}"
)
TELLS = """\
  tells:
    title: Tells
    start: [{name: client, script: client.py}]
    serves: [{action: /count, type: lab1/Count, feedback: [{count: 1}, {count: 2}]}]
    steps: [publish: {topic: /go, type: std_msgs/Empty, value: {}}, wait: {topic: /told, messages: 2}]"""
WHEELS = """\
  turns:
    title: Turns
    start: [{name: wheels, script: wheels.py}]
    steps: [publish: {topic: /turn, type: std_msgs/Float64, value: {made_up: turn}}, wait: {topic: /right}]
made_up: {turn: {from: 1, to: 3}, right: {product: [turn, 0.5]}}"""

DISHES = """\
  goals:
    title: A goal
    start: [{name: dishes, script: dishes.py}]
    steps: [action: {name: /dishes, type: lab1/WashAction, goal: {minutes: 3}, limit_s: 5}]"""
SUM = """\
  client:
    title: The client
    serves: [{service: /add, type: rospy_tutorials/AddTwoInts, answer: {sum: 77}}]
    start: [{name: client, script: client.py, args: ["-i", "31", "-4"]}]
    until: {ended: [client]}"""
FRAMES = """\
  frames:
    title: In a namespace
    start: [{name: frames, script: frames.py, args: ["__ns:=left"]}]
    steps:
      - publish:
          topic: /left/odom
          type: nav_msgs/Odometry
          value: {header: {stamp: now, frame_id: odom}, child_frame_id: base_link, pose: {pose: {orientation: {w: 1}}}}
      - wait: {seconds: 1}"""
TURNS = """\
  turns:
    title: Turns
    start: [{name: clean, script: clean.py}]
    steps:
      - publish: {topic: /level, type: std_msgs/Float64, value: {each: [1, .nan, 3, 2]}, count: 4, rate_hz: 2}
      - wait: {seconds: 1}"""


@pytest.mark.parametrize(
    ("handout", "scenarios", "asked"),
    [
        # another run judges what the script itself sends on the topic
        ("the relay hears /said and publishes on it; listen prints hello", RELAY,
         ["check: rate, with: {topic: /said, rate_hz: 1}, scenario: alone",
          "check: prints, with: {process: listen, text: hello}, scenario: both"]),
        # the launch file is watched for longer than until both nodes are there
        ("a talker and a listener on /said", PAIR,
         ["check: node-lives, with: {process: all, min_s: 5, names: [talker]}, scenario: pair",
          "check: launch-connects, with: {launch: pair.launch, topic: /said}, scenario: pair"]),
        # names of nodes that are no words of prose
        ("pair.launch starts s_server and s_talk", PAIR,
         ["check: launch-runs, scenario: pair, with: {launch: pair.launch, nodes: {/s_server: lab1, /s_talk: lab1}}"]),
        # a map that grows has two sizes
        ("a nav_msgs/OccupancyGrid on /map, of 2 by 1 cells and then of 2 by 2", GROWS,
         ["check: field-equals, with: {topic: /map, field: info.width, value: 2}, scenario: grows",
          "check: field-equals, with: {topic: /map, field: info.height, value: 1, when: first}, scenario: grows",
          "check: field-equals, with: {topic: /map, field: info.height, value: 2, when: last}, scenario: grows",
          "check: field-equals, with: {topic: /map, field: data, value: [0, 0], when: first}, scenario: grows",
          "check: field-equals, with: {topic: /map, field: data, value: [0, 0, 0, 0], when: last}, scenario: grows"]),
        # a client that prints twice of what it gets
        ("asks /get and prints twice the sum", CLIENT,
         ["check: prints, with: {process: client, text: '{number}', numbers: [8]}, scenario: four",
          "check: prints, with: {process: client, text: '{number}', numbers: [16]}, scenario: eight"]),
        # the run goes on after its steps for as long as the node is watched
        ("clean answers 3 on /level, a std_msgs/Float64, with one on /clean; NaN is left out", TURNS,
         ["check: node-lives, with: {process: clean, min_s: 3}, scenario: turns",
          AFTER_THREE]),
        # an action's feedback sets off messages too
        ("tells each feedback of /count on /told, and each order on /go", TELLS,
         ["check: field-equals, with: {topic: /told, field: data, values: [1, 2]}, scenario: tells"]),
        # a factor of a formula is no value that a node may always use
        ("wheels hears /turn, in radians a second, and publishes turn / 2 on /right", WHEELS,
         ["check: field-equals, with: {topic: /right, field: data, value: {made_up: right}}, scenario: turns"]),
        # each message of a step is a cause of its own
        ("clean answers each reading on /level, a std_msgs/Float64, with one on /clean; NaN is left out", TURNS,
         ["check: field-equals, with: {topic: /clean, field: data, values: [1, 3, 2]}, scenario: turns",
          "check: reacts, scenario: turns, with: {cause: {topic: /level}, effect: {topic: /clean}, within_s: 0.5}"]),
        # a counter begins with 0 where nothing else is said
        ("maps counts on /map, a std_msgs/Int8", GROWS,
         ["check: counter-start, with: {topic: /map}, scenario: grows"]),
        # a robot without wheels
        ("a quadrotor starts: the node maps publishes geometry_msgs/Twist on /cmd_vel",
         GROWS.replace("/map", "/cmd_vel"),
         ["check: field-equals, with: {topic: /cmd_vel, field: linear.z, value: 0.5}, scenario: grows"]),
        # an action whose file is called so, and texts that are counted up
        ("/dishes (action/WashAction.action, goal minutes, result done) washes `bowl-1`, `bowl-2` and so on", DISHES,
         ["check: action-result, with: {action: /dishes, result: {done: [bowl-1, bowl-2, bowl-3]}}, scenario: goals"]),
        # a number that a script gets as an argument, and an example without a letter
        ("client.py asks /add for a sum, as in `-i 3 4`, and prints `-> 7`", SUM,
         ["check: calls, with: {service: /add, expect: {a: 31, b: -4}}, scenario: client",
          "check: prints, with: {process: client, text: the sum is}, scenario: client"]),
        # a node that names its frames by its namespace
        ("follows /left/odom (from odom to base_link) with the transform from world to left", FRAMES,
         ["check: transform, with: {parent: world, child: left, pose_of: /left/odom}, scenario: frames"]),
    ],
)  # fmt: skip
def test_a_rubric_of_an_unusual_lab_loads_without_a_word(
    handout: str, scenarios: str, asked: list[str], tmp_path: Path
) -> None:
    assert _warnings(tmp_path, handout, scenarios, asked) == []


def _warnings(tmp_path: Path, handout: str, scenarios: str, asked: list[str]) -> list[str]:
    share = [100 - 10 * len(asked[1:]), *(10 for _ in asked[1:])]
    criteria = [
        f"  - {{id: c{n}, title: Part {chr(97 + n)}{' of 0' * ('counter-start' in one)}, points: {points}, {one}}}"
        for n, (one, points) in enumerate(zip(asked, share, strict=True))
    ]
    path = tmp_path / "lab.yaml"
    text = RUNS.format(handout=f'"{handout}"', scenarios=scenarios, criteria="\n".join(criteria))
    path.write_text(text, encoding="utf-8")
    return warnings_of(load_rubric(str(path)), path.name)


SWITCH = """\
  turns:
    title: Turns
    start: [{name: lamp, script: lamp.py}]
    steps:
      - publish: {topic: /turn, type: std_msgs/String, values: ["on", strat, dance]}
      - wait: {seconds: 3}"""


@pytest.mark.parametrize(
    ("handout", "scenarios", "asked", "warning"),
    [
        # a command that the grader sends
        ("lamp hears `on`, `start` and `stop` on /turn, and publishes a std_msgs/Bool on /lit", SWITCH,
         ["check: field-equals, with: {topic: /lit, field: data, value: true, when: last}, scenario: turns"],
         "turns.steps[0].publish.values[1]: nothing else in the rubric has the word strat: is `start` meant"),
        # odometry that a script works out begins at the origin
        ("clean hears a std_msgs/Float64 on /level, and drives; its odometry is on /odom", TURNS,
         ["check: ends-at, with: {topic: /odom, goal: [0.3, 0], tolerance_m: 0.4}, scenario: turns"],
         "with.tolerance_m: the robot starts 0.3 m from the goal: one that never moves passes"),
        # all of them are near to one value
        ("clean answers each reading on /level, a std_msgs/Float64, with one on /clean; NaN is left out", TURNS,
         ["check: field-equals, with: {topic: /clean, field: data, values: [1, 3, 2], tolerance: 1}, scenario: turns"],
         "with.tolerance: one message between 1 and 3 is near enough to each of the values"),
    ],
)  # fmt: skip
def test_what_may_be_a_slip_in_one_is_a_warning(
    tmp_path: Path, handout: str, scenarios: str, asked: list[str], warning: str
) -> None:
    (found,) = _warnings(tmp_path, handout, scenarios, asked)
    assert warning in found


KEYS = """\
  keys:
    title: Keys
    start: [{name: drive, script: drive.py}]
    steps:
      - type: {process: drive, line: w}
      - type: {process: drive, line: s}
      - type: {process: drive, line: k}
      - type: {process: drive, line: q}
    until: {ended: [drive]}
  launched:
    title: Launched
    start: [{name: all, launch: all.launch, args: ["robot:=waffle"]}]
    until: {nodes: 1}"""
ASKED = """\
  - {id: says, title: It says so, points: 50, check: prints, with: {process: drive, text: bye}, scenario: keys}
  - {id: up, title: It comes up, points: 50, check: launch-runs, scenario: launched,
     with: {launch: all.launch, nodes: {/waffle/drive: lab1}}}"""
TYPED = "Write `drive` (drive.py), which all.launch starts: `w` drives, `s` stops, and at `q` it prints `bye` and ends."


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ("line: q", "line: quit", "type.line: the handout has `q`"),
        ("text: bye", "text: Goodbye", "text: the handout has `bye`, with another word"),
        (
            "/waffle/",
            "/wafle/",
            '/wafle/drive: wafle is on no other line: did you mean "waffle", as in its run?',
        ),
    ],
)
def test_what_nothing_else_says_is_a_warning(old: str, new: str, warning: str, tmp_path: Path) -> None:
    text = RUNS.format(handout=f"'{TYPED}'", scenarios=KEYS, criteria=ASKED)
    path = tmp_path / "lab.yaml"
    path.write_text(text, encoding="utf-8")
    assert warnings_of(load_rubric(str(path)), path.name) == []
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    (told,) = warnings_of(load_rubric(str(path)), path.name)
    assert told.endswith(warning)


JOYSTICK = """
schema: grader.rubric/1
id: joystick
title: Drive with a joystick
version: "1"
package: joy_drive
handout: >
  Write a node `joy_drive` that hears `joy` (sensor_msgs/Joy) and publishes on `cmd_vel` (geometry_msgs/Twist), within
  -0.6 and 0.6 m/s for `linear.x`. The images on `/image` are of the encoding `mono8`. The launch file remaps to
  `turtle1/cmd_vel`.
scenarios:
  drives:
    title: The button is pressed, then released
    start: [{name: drive, script: scripts/drive.py}]
    steps:
      - publish: {topic: /joy, type: sensor_msgs/Joy, value: {axes: [0, 0.5], buttons: [0]}, count: 10}
      - publish: {topic: /joy, type: sensor_msgs/Joy, value: {axes: [0, 0.5], buttons: [1]}, count: 10}
      - publish:
          topic: /image
          type: sensor_msgs/Image
          value: {height: 2, width: 3, step: 3, encoding: mono8, data: [1, 2, 3, 4, 5, 6]}
      - wait: {seconds: 1}
  launched:
    title: The launch file
    start: [{name: launch, launch: drive.launch}]
    steps: [publish: {topic: /joy, type: sensor_msgs/Joy, value: {axes: [0, 0.5], buttons: [1]}}, wait: {seconds: 1}]
criteria:
  - {id: silent, title: Without the button nothing comes, points: 40, check: reacts, scenario: drives,
     with: {cause: {topic: /joy, field: "buttons[0]", value: 1}, effect: {topic: /cmd_vel}, within_s: 0.4}}
  - {id: speed, title: It drives, points: 20, check: field-equals, scenario: drives, requires: [silent],
     with: {topic: /cmd_vel, field: linear.x, value: 0.25}}
  - {id: launch, title: The launch file remaps, points: 20, check: field-equals, scenario: launched,
     with: {topic: /turtle1/cmd_vel, field: linear.x, value: 0.25}}
  - {id: turned, title: It looks ahead, points: 20, check: field-equals, scenario: drives, requires: [silent],
     with: {topic: /pose, field: pose.orientation.z, value: 0.1, tolerance: 0.01}}
"""


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ("encoding: mono8", "encoding: MONO8", "has MONO8, and the handout `mono8`, in another case"),
        ("step: 3", "step: 6", "has 6 items, and height 2 and step 6 make 12: a node that reads all of them fails"),
        ("value: 0.1, tol", "value: 90, tol", "pose.orientation.z of a quaternion is -1 to 1, and never 90"),
        ("topic: /turtle1/cmd_vel", "topic: /turtle/cmd_vel", "names /turtle/cmd_vel: is it /turtle1/cmd_vel, as in"),
        ("linear.x, value: 0.25}}\\n  - {id: launch", "linear.y, value: 0.25}}\\n  - {id: launch", "drives no robot"),
        ("title: It drives", "title: It drives", ""),
    ],
)  # fmt: skip
def test_slips_in_what_is_sent_are_told(tmp_path: Path, old: str, new: str, warning: str) -> None:
    path = tmp_path / "joystick.yaml"
    text = JOYSTICK.replace(old.replace("\\n", "\n"), new.replace("\\n", "\n"), 1)
    path.write_text(text, encoding="utf-8")
    told = warnings_of(load_rubric(str(path)), path.name)
    assert [one for one in told if warning in one] if warning else told == []


def test_an_answer_before_the_silence_ends_is_refused(tmp_path: Path) -> None:
    """The button is up in the first messages, and one criterion wants nothing until it is pressed."""
    path = tmp_path / "joystick.yaml"
    stops = """  - {id: stops, title: It stops, points: 20, check: reacts, scenario: drives, requires: [silent],
     with: {cause: {topic: /joy, field: "buttons[0]", value: 0}, effect: {topic: /cmd_vel, field: linear.x, value: 0},
            within_s: 0.4, not_before: false}}
"""
    path.write_text(JOYSTICK.replace("points: 40", "points: 20") + stops, encoding="utf-8")
    told = "value 1 that drives sends on /joy is a cause already, and silent wants nothing on /cmd_vel before value 2"
    found = f"joystick.yaml:37: criteria[4].with.cause: {told}: ask for one of them in another run"
    assert faults(path)[-1:] == [found]


def test_a_script_with_the_name_of_its_package_hides_its_messages(tmp_path: Path) -> None:
    """`import joy_drive.msg` would find the script; without a type of the package, nothing is hidden."""
    path = tmp_path / "joystick.yaml"
    for typed, count in (("joy_drive/Stick", 1), ("sensor_msgs/Joy", 0)):
        text = JOYSTICK.replace("scripts/drive.py", "scripts/joy_drive.py")
        stick = "value: {axes: [0, 0.5], buttons: [1]}, count: 10}"
        text = text.replace(stick, f"{stick}\n      - wait: {{topic: /stick}}", 1)
        kind = "{id: kind, title: Its own type, points: 20, check: topic-type, scenario: drives, "
        kind += f"requires: [silent], with: {{topic: /stick, type: {typed}}}}}"
        path.write_text(text.replace("points: 40", "points: 20") + f"  - {kind}\n", encoding="utf-8")
        told = [one for one in warnings_of(load_rubric(str(path)), path.name) if "another name" in one]
        assert len(told) == count
