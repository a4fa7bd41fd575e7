"""What launch files and CMakeLists.txt show of criteria that were not reached is named with what hides them."""

from __future__ import annotations

import pytest

from grader.judging import judge
from grader.package.launch import parse_launch_files
from tests.support.rubrics import GOOD_RUN, NODE, PACKAGE, SCENARIO, SCRIPT, built, rubric
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


@pytest.mark.parametrize(
    ("topic", "told"), [("/chatter", True), ("/bay/chatter", False), ("/bay/echo", False)]
)
def test_a_namespace_in_which_the_topic_belongs_is_not_told_as_wrong(topic: str, told: bool) -> None:
    text = """<launch>
      <group ns="bay">
        <node pkg="lab1" type="numeric_talker.py" name="a"/>
        <node pkg="other" type="numeric_talker.py" name="b"/>
      </group>
    </launch>"""
    launch = parse_launch_files({"launch/a.launch": text.encode()}, ["lab1"])
    asked = {"launch": "a.launch", "scripts": [FILE, "src/listener.py"]}
    lab = {"id": "xml", "check": "launch-xml", "with": asked}
    runs_it = {
        "id": "launch",
        "check": "launch-runs",
        "with": {**asked, "topic": topic},
        "scenario": "talker",
        "requires": ["xml"],
    }
    package = {**PACKAGE, "launch_files": [one.model_dump() for one in launch]}
    scenarios = {"talker": {**SCENARIO, "start": [{"name": "roslaunch", "launch": "a.launch"}]}}
    run = {"processes": [{"name": "roslaunch", "exit_s": 0.5, "exit_code": 1}], "outcome": "ended"}
    runs = build_runs({"runs": {"talker": run}, "package": package})
    found, blocked = judge(rubric(lab, runs_it, scenarios=scenarios), runs)
    assert blocked.blocked_by == "xml"
    assert ('remove ns="bay" on line 2: then chatter is /chatter' in found.hint) == told
    assert ("remove ns" in found.hint) == told


def test_messages_that_are_not_there_are_named_where_catkin_sees_no_package() -> None:
    target = ["add_executable", "talker.cpp", "src/talker.cpp"]  # the program is called so
    cmake = {"calls": [["add_message_files", "FILES", "Note.msg"], ["catkin_package"], target]}
    built = {"processes": [{"name": "catkin_make", "role": "build", "exit_code": 0, "exit_s": 2}]}
    named = {"id": "manifest", "check": "manifest", "with": {"name": "lab1"}}
    asked = rubric(named, {"id": "build", "check": "build", "requires": ["manifest"]})
    beside = [{"path": "lab1/msg/Note.msg"}, {"path": "lab1/scripts/a.py"}]
    for files, told in (([], True), ([{"path": "msg/Note.msg"}], False), (beside, False)):
        files.append({"path": "src/talker.cpp"})
        runs = build_runs({"runs": {"package": built}, "package": {"cmake": cmake, "files": files}})
        hint = judge(asked, runs)[0].hint
        assert ("; then add msg/Note.msg, which is not there, and push it" in hint) == told
        assert "instead of" not in hint
    runs = build_runs(
        {
            "runs": {"package": built},
            "package": {"cmake": cmake, "files": [{"path": "Note.msg"}, {"path": "src/talker.cpp"}]},
        }
    )
    assert judge(asked, runs)[0].hint.endswith("; then move Note.msg to msg/Note.msg")


@pytest.mark.parametrize(
    ("said", "status", "hint"),
    [
        (
            'CMake Error: Could not find a package configuration file provided by "tf" with any of the following',
            "inconclusive",
            "nothing for you to do: tell your instructor",
        ),
        ("/w/src/lab1/src/mean.cpp:3:1: error: 'x' was not declared", "blocked", "fix build first"),
    ],
)
def test_a_program_that_the_build_did_not_make_is_no_missing_script(
    said: str, status: str, hint: str
) -> None:
    files = [{"path": "src/mean.cpp"}, {"path": "CMakeLists.txt"}]
    package = {
        "name": "lab1",
        "files": files,
        "manifest": {},
        "cmake": {"calls": [["add_executable", "mean", "src/mean.cpp"]]},
    }
    scenario = {**SCENARIO, "start": [{"name": "talker", "script": "mean"}]}
    asked = ({"id": "build", "check": "build"}, {**NODE, "requires": []})
    runs = build_runs({"runs": {"talker": {"outcome": "ended", "graph": []}}, "package": package})
    runs |= built(package, exit_code=1, said=[said])
    found = {c.id: c for c in judge(rubric(*asked, scenarios={"talker": scenario}), runs)}
    told = found["node"].message.removeprefix("blocked by build: ")
    assert told.startswith("talker was not started: the build did not make the program mean")
    assert (found["node"].status.value, found["node"].hint.startswith(hint)) == (status, True)


def test_a_script_that_is_missing_is_named() -> None:
    runs = build_runs(
        {"runs": {"talker": {"outcome": "ended", "graph": []}}, "package": {"name": "lab1", "files": []}}
    )
    (node,) = judge(rubric({**NODE, "requires": []}), runs)
    assert node.message == "talker was not started: there is no src/numeric_talker.py to run"
    assert node.hint == "write src/numeric_talker.py"


def test_what_runs_beside_a_program_that_was_not_built_is_left_open() -> None:
    tf = 'CMake Error: Could not find a package configuration file provided by "tf" with any of the following'
    package = {
        "name": "lab1",
        "files": [SCRIPT, {"path": "src/mean.cpp"}, {"path": "CMakeLists.txt"}],
        "manifest": {},
        "cmake": {"calls": [["add_executable", "mean", "src/mean.cpp"]]},
    }
    scenario = {**SCENARIO, "start": [*SCENARIO["start"], {"name": "mean", "script": "mean"}]}
    text, ends = {"process": "talker", "text": "done"}, {"topic": "/numeric_chatter", "subscriber": "mean"}
    done = {"id": "done", "check": "prints", "with": text, "scenario": "talker"}
    apart = {"id": "apart", "check": "connected", "with": ends, "scenario": "talker"}
    asked = rubric(done, apart, scenarios={"talker": scenario})
    said = [{"process": "talker", "line": "waiting"}]
    runs = build_runs({"runs": {"talker": {**GOOD_RUN, "console": said}}, "package": package})
    for exit_code, status in ((1, "inconclusive"), (0, "fail")):
        runs |= built(package, exit_code=exit_code, said=[tf] if exit_code else [])
        found, connected = judge(asked, runs)
        assert (found.status.value, connected.status.value) == (status, status)
        assert ("did not make the program mean, which runs beside it" in found.message) == bool(exit_code)
        assert ("did not make the program mean;" in connected.message) == bool(exit_code)
