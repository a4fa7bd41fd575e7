"""What launch files and CMakeLists.txt show of criteria that were not reached is named with what hides them."""

from __future__ import annotations

from grader.judging import judge
from grader.package.launch import parse_launch_files
from tests.support.rubrics import PACKAGE, SCENARIO, SCRIPT, rubric
from tests.support.timeline import build_runs

FILE = SCRIPT["path"]


def test_arguments_without_a_value_are_named_behind_what_roslaunch_says_first() -> None:
    """roslaunch names the package that it does not find, and comes to the arguments only then."""
    text = """<launch>
      <include file="$(find elsewhere)/launch/a.launch"/>
      <arg name="rate"/>
      <node pkg="lab1" type="numeric_talker.py" name="talker" args="$(arg rate) $(arg speed)"/>
    </launch>"""
    launch = parse_launch_files({"launch/a.launch": text.encode()}, ["lab1"])
    lab = {
        "id": "launch",
        "check": "launch-runs",
        "with": {"launch": "a.launch", "scripts": [FILE]},
        "scenario": "talker",
    }
    run = {
        "processes": [{"name": "roslaunch", "exit_s": 0.5, "exit_code": 1}],
        "console": [{"process": "roslaunch", "stream": "stderr", "lines": ["Resource not found: elsewhere"]}],
        "outcome": "ended",
    }
    package = {**PACKAGE, "launch_files": [one.model_dump() for one in launch]}
    scenarios = {"talker": {**SCENARIO, "start": [{"name": "roslaunch", "launch": "a.launch"}]}}
    runs = build_runs({"runs": {"talker": run}, "package": package})
    (found,) = judge(rubric(lab, scenarios=scenarios), runs)
    assert "there is no package elsewhere" in found.message
    assert found.hint.endswith(
        '; then on line 3 of launch/a.launch write <arg name="rate" default="…"/> and '
        'below <launch> in launch/a.launch add <arg name="speed" default="…"/>'
    )


def test_messages_that_are_not_there_are_named_where_catkin_sees_no_package() -> None:
    cmake = {"calls": [["add_message_files", "FILES", "Note.msg"], ["catkin_package"]]}
    built = {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0, "exit_s": 2}]}
    named = {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}}
    asked = rubric(named, {"id": "build", "check": "build", "requires": ["manifest"]})
    beside = [{"path": "lab1/msg/Note.msg"}, {"path": "lab1/scripts/a.py"}]
    for files, told in (([], True), ([{"path": "msg/Note.msg"}], False), (beside, False)):
        runs = build_runs({"runs": {"package": built}, "package": {"cmake": cmake, "files": files}})
        hint = judge(asked, runs)[0].hint
        assert ("; then add msg/Note.msg, which is not there, and push it" in hint) == told
        assert "instead of msg/Note.msg" not in hint
