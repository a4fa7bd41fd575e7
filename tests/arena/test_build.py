"""The build in the sandbox, what it leaves, and C++ nodes."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from grader.arena.build import BuildOutcome, build
from grader.arena.process_environment import ProcessEnvironment
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceWriter
from grader.files import READ_MAX
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import CMAKE, SCRIPT, make_place, run

pytestmark = pytest.mark.ros

CPP_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(lab)
find_package(catkin REQUIRED COMPONENTS roscpp std_msgs)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(counter src/counter.cpp)
target_link_libraries(counter ${catkin_LIBRARIES})
"""
CPP = """
#include <ros/ros.h>
#include <std_msgs/Int8.h>
int main(int argc, char** argv) {
  ros::init(argc, argv, "counter");
  ros::NodeHandle node;
  ros::Publisher early = node.advertise<std_msgs::Int8>("/early", 100);
  std_msgs::Int8 message;
  for (int n = 0; n < 20; ++n) { message.data = n; early.publish(message); }
  ros::Publisher late = node.advertise<std_msgs::Int8>("/late", 100);
  for (int n = 0; n < 20; ++n) { message.data = n; late.publish(message); }
  printf("published without a flush\\n");
  ros::spin();
}
"""


def _built(
    place: ProcessEnvironment, tmp_path: Path, answers: tuple[str, ...] = ()
) -> tuple[ProcessEnvironment, BuildOutcome, Run]:
    path = tmp_path / "package.mcap"

    async def work() -> tuple[ProcessEnvironment, BuildOutcome]:
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            return await build(place, writer, ["src/node.py"], answers)

    built, outcome = asyncio.run(work())
    return built, outcome, load_run(path)


@pytest.mark.slow
def test_cpp_node_is_built_run_and_recorded_from_its_first_message(tmp_path: Path) -> None:
    files = {"CMakeLists.txt": CPP_CMAKE, "src/counter.cpp": CPP, "src/node.py": SCRIPT}
    with make_place(files) as place:
        built, outcome, _ = _built(place, tmp_path)
        assert outcome.ok
        for attempt in range(3):
            scenario = Scenario(
                title="C++",
                start=(Start(name="counter", script="counter"),),
                until=Until(messages={"/early": 20, "/late": 20}, silent_s=3),
            )
            seen = run(built, scenario, tmp_path / f"{attempt}.mcap")
            for topic in ("/early", "/late"):
                (channel,) = seen.student_channels(topic)
                assert channel.data == tuple(range(20)), topic
                assert channel.md5sum == "27ffa0c9c4b8fb8492252bcad9e5c57b"
            assert "published without a flush" in [line.line for _, line in seen.lines("counter")]


def test_build_tells_what_cmake_was_told(tmp_path: Path) -> None:
    with make_place({"src/node.py": SCRIPT + "print 'two'\n"}) as place:
        built, outcome, evidence = _built(place, tmp_path)
        assert outcome.ok
        assert outcome.trace is not None
        assert b'"catkin_package"' in outcome.trace.read_bytes()
        assert outcome.syntax is not None
        assert b"SyntaxError" in outcome.syntax.read_bytes()
        assert "devel" in built.env["CMAKE_PREFIX_PATH"]
    names = {event.name: event for _, event in evidence.processes if event.event == "exit"}
    assert names["catkin_make"].exit_code == 0
    assert any("lab" in line.line for _, line in evidence.lines("catkin_make"))


def test_build_that_fails_leaves_the_sources_to_run(tmp_path: Path) -> None:
    node = SCRIPT + "print('run from source')\n"
    with make_place({"CMakeLists.txt": "project(lab\n", "src/node.py": node}) as place:
        built, outcome, evidence = _built(place, tmp_path)
        assert not outcome.ok
        assert any("CMake Error" in line.line for _, line in evidence.lines("catkin_make"))
        scenario = Scenario(
            title="t", start=(Start(name="node", script="src/node.py"),), until=Until(limit_s=5)
        )
        seen = run(built, scenario, tmp_path / "run.mcap")
    assert [line.line for _, line in seen.lines("node")] == ["run from source"]


def test_rosrun_answers_to_the_package_as_handed_in(tmp_path: Path) -> None:
    with make_place({"src/node.py": "print('no shebang')\n"}) as place:
        source = place.workspace.built / "src" / place.workspace.folder / "src" / "node.py"
        source.chmod(0o644)
        _, _, evidence = _built(place, tmp_path, ("node.py",))
    lines = " ".join(line.line for _, line in evidence.lines("rosrun node.py"))
    assert "Couldn't find executable named node.py" in lines


def test_build_reaches_nothing_and_writes_nowhere_else(tmp_path: Path) -> None:
    spy = 'execute_process(COMMAND id -u)\nfile(WRITE "/usr/cmake-was-here" "x")\n'
    with make_place({"CMakeLists.txt": CMAKE + spy, "src/node.py": SCRIPT}) as place:
        _, outcome, evidence = _built(place, tmp_path)
    text = "\n".join(line.line for _, line in evidence.lines("catkin_make"))
    assert not outcome.ok
    assert "1000" in text
    assert not Path("/usr/cmake-was-here").exists()


def test_links_that_the_build_leaves_are_not_followed(tmp_path: Path) -> None:
    with make_place({"src/node.py": SCRIPT}) as place:
        secret = tmp_path / "secret"
        secret.write_text("{}")
        trap = f"file(CREATE_LINK {secret} {place.output}/cmake-trace.json SYMBOLIC)\n"
        listing = place.workspace.built / "src" / place.workspace.folder / "CMakeLists.txt"
        listing.write_text(CMAKE + trap)
        built, outcome, _ = _built(place, tmp_path)
    assert outcome.trace is None
    assert "devel" in built.env["CMAKE_PREFIX_PATH"]
    assert secret.read_text() == "{}"


def test_a_trace_that_is_too_large_is_named(tmp_path: Path) -> None:
    """Calls in a loop: each is a line of the trace."""
    loop = 'foreach(n RANGE 40000)\n  set(x "' + "y" * 200 + '")\nendforeach()\n'
    with make_place({"CMakeLists.txt": CMAKE + loop, "src/node.py": SCRIPT}) as place:
        _, outcome, evidence = _built(place, tmp_path)
    assert outcome.ok
    met = [(e.actor, e.detail) for _, e in evidence.actors if e.action == "limit"]
    assert met == [("catkin_make", f"CMake's trace is more than {READ_MAX >> 20} MB")]
