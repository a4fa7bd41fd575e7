"""A hint is in the language of the node that it is for, in packages of one language and of both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.checks.support.text import LOOP, in_language, init, publisher, set_param
from grader.judging.annotate import said_for_node
from grader.judging.facts import Facts
from grader.model.verdict import failed
from grader.package.facts import read_package
from tests.judging.rubrics import rubric
from tests.package.trees import CMAKE, MANIFEST, make_package
from tests.support.timeline import build_runs

CMAKE_CPP = CMAKE + "\nadd_executable(talker src/talker.cpp)\n"
LAUNCH = (
    '<launch>\n<node pkg="lab1" type="talker" name="sender"/>\n'
    '<node pkg="lab1" type="listener.py" name="hearer"/>\n</launch>\n'
)
MIXED = {
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE_CPP,
    "src/talker.cpp": "int main() {}\n",
    "src/listener.py": "#!/usr/bin/env python3\n",
    "launch/both.launch": LAUNCH,
}
PYTHON = MIXED | {"CMakeLists.txt": CMAKE, "src/talker.py": ""}
del PYTHON["src/talker.cpp"]
STARTS = [{"name": "talker", "script": "src/talker"}, {"name": "listener", "script": "src/listener.py"}]
GRAPH = {
    "nodes": ["/sender", "/hearer"],
    "topic_types": {"/numbers": "std_msgs/Int8"},
    "publishers": {"/numbers": ["/sender"]},
    "subscribers": {"/numbers": ["/hearer"]},
    "services": {},
}


def hint(
    folder: Path,
    files: dict[str, str],
    starts: list[dict[str, str]],
    message: str = "",
    processes: dict[str, str] | None = None,
    **asked: str,
) -> str:
    """What a student reads of `LOOP`, in a criterion with these parameters."""
    package = read_package(make_package(folder / "lab1", files))
    scenario = {"title": "t", "start": starts, "until": {"window_s": 6, "topics": ["/numbers"]}}
    criterion: dict[str, Any] = {"id": "c", "check": "some", "with": asked, "scenario": "run"}
    known = rubric(criterion, scenarios={"run": scenario})
    runs = build_runs({"runs": {"run": {"graph": [{"at_s": 0, **GRAPH, "processes": processes or {}}]}}})
    facts = Facts(rubric=known, runs=runs, package=package)
    return said_for_node(failed(message, hint=LOOP), known.criteria[0], facts).hint


ROSPY, ROSCPP = "while not rospy.is_shutdown():", "while (ros::ok())"
OF_SCRIPTS = {"/sender": "talker", "/hearer": "listener"}


@pytest.mark.parametrize(
    ("said", "asked", "wanted"),
    [
        ("", {"process": "talker"}, ROSCPP),
        ("", {"process": "listener"}, ROSPY),
        ("", {"topic": "/numbers"}, ROSCPP),
        ("/hearer never subscribes to /numbers", {"topic": "/numbers"}, ROSPY),
        ("/sender ended", {"publisher": "sender", "subscriber": "hearer"}, ROSCPP),
        ("nothing was published", {"topic": "/other"}, f"{ROSPY} (in C++: {ROSCPP})"),
    ],
)
@pytest.mark.parametrize("launched", [False, True])
def test_each_node_of_a_mixed_package(tmp_path, said, asked, wanted, launched) -> None:
    starts = [{"name": "both", "launch": "both.launch"}] if launched else STARTS
    if launched and asked.get("process"):
        asked, said = {}, f"/{'sender' if asked['process'] == 'talker' else 'hearer'} ended"
    processes = dict.fromkeys(OF_SCRIPTS, "both") if launched else OF_SCRIPTS
    assert hint(tmp_path, MIXED, starts, said, processes, **asked) == wanted


@pytest.mark.parametrize(
    ("files", "starts", "wanted"),
    [
        (PYTHON, STARTS[1:], ROSPY),
        (PYTHON, [{"name": "both", "launch": "both.launch"}], ROSPY),
        (MIXED, STARTS[:1], ROSCPP),
        (MIXED, [{"name": "all", "built": True}], ROSCPP),
        (MIXED, [{"name": "talker", "script": "src/absent.py"}], ROSPY),
    ],
)
def test_what_a_scenario_starts_says_it_alone(tmp_path, files, starts, wanted) -> None:
    assert hint(tmp_path, files, starts, topic="/nothing") == wanted


@pytest.mark.parametrize(
    ("said", "python", "cpp"),
    [
        (init("a"), "rospy.init_node('a')", 'ros::init(argc, argv, "a")'),
        (
            init("a", anonymous=True),
            "rospy.init_node('a', anonymous=True)",
            'ros::init(argc, argv, "a", ros::init_options::AnonymousName)',
        ),
        (
            publisher("/n", "Int8, queue_size=10", type="std_msgs::Int8"),
            "rospy.Publisher('/n', Int8, queue_size=10)",
            'nh.advertise<std_msgs::Int8>("/n", 10)',
        ),
        (set_param("/on", True), "rospy.set_param('/on', True)", 'ros::param::set("/on", true)'),
        ("nothing of code", "nothing of code", "nothing of code"),
    ],
)
def test_what_is_written_in_each(said, python, cpp) -> None:
    assert in_language(said, "python") == python
    assert in_language(said, "cpp") == cpp
    assert in_language(said, None) == (python if python == cpp else f"{python} (in C++: {cpp})")
