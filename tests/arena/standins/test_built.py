"""Packages that depend on stand-ins are built, and a package of the student's own comes first."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import pytest

from grader.arena.build import BuildOutcome, build
from grader.arena.process_environment import ProcessEnvironment
from grader.evidence.reader import load_run
from grader.evidence.run import Run
from grader.evidence.writer import EvidenceWriter
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import MANIFEST, SCRIPT, make_place, printed, run

pytestmark = pytest.mark.ros

DEPENDS = ("rospy", "std_msgs", "turtlesim", "rospy_tutorials", "std_srvs")
CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(lab)
find_package(catkin REQUIRED COMPONENTS rospy std_msgs turtlesim rospy_tutorials std_srvs)
include(${turtlesim_DIR}/turtlesim-msg-paths.cmake)
if(NOT EXISTS ${turtlesim_MSG_INCLUDE_DIRS}/Pose.msg)
  message(FATAL_ERROR "no definitions in ${turtlesim_MSG_INCLUDE_DIRS}")
endif()
if(COMMAND add_message_files)
  message(FATAL_ERROR "message_generation was not asked for")
endif()
catkin_package(CATKIN_DEPENDS rospy turtlesim)
add_custom_target(mine ALL)
add_dependencies(mine ${catkin_EXPORTED_TARGETS} turtlesim_generate_messages_cpp)
"""
NODE = """
import os
from turtlesim.msg import Pose
print(Pose._md5sum, os.environ["ROS_PACKAGE_PATH"].split(":")[-1])
"""
CPP_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(lab)
find_package(catkin REQUIRED COMPONENTS roscpp turtlesim std_srvs)
catkin_package()
include_directories(${catkin_INCLUDE_DIRS})
add_executable(follow src/follow.cpp)
add_dependencies(follow ${catkin_EXPORTED_TARGETS} turtlesim_gencpp)
target_link_libraries(follow ${catkin_LIBRARIES})
"""
CPP = """
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <turtlesim/Pose.h>
#include <turtlesim/Spawn.h>
int main() {
  std_srvs::Empty empty;
  printf("%s\\n", ros::message_traits::MD5Sum<turtlesim::Pose>::value());
  printf("%s\\n", ros::service_traits::MD5Sum<turtlesim::Spawn>::value());
}
"""
OWN = "from turtlesim.msg import Mine\nprint('imported', Mine)\n"


def _built(place: ProcessEnvironment, tmp_path: Path) -> ProcessEnvironment:
    path = tmp_path / "package.mcap"

    async def work() -> tuple[ProcessEnvironment, BuildOutcome]:
        with EvidenceWriter(path, scenario="package", clock="real", warp=1.0, metadata={}) as writer:
            return await build(place, writer, [], ())

    built, outcome = asyncio.run(work())
    assert outcome.ok, "\n".join(printed(load_run(path), "catkin_make"))
    return built


def _run(place: ProcessEnvironment, tmp_path: Path, *start: Start) -> Run:
    return run(
        place,
        Scenario(title="t", start=start, until=Until(limit_s=8, ended=(start[0].name,))),
        tmp_path / "run.mcap",
    )


@pytest.mark.parametrize("sandbox", ["auto", pytest.param("none", marks=pytest.mark.full)])
def test_a_package_that_depends_on_stand_ins_builds_and_runs(tmp_path: Path, sandbox: str) -> None:
    depends = "".join(f"<depend>{name}</depend>" for name in DEPENDS)
    manifest = MANIFEST.replace("</package>", f"{depends}</package>")
    files = {"package.xml": manifest, "CMakeLists.txt": CMAKE, "src/node.py": SCRIPT + NODE}
    with make_place(files, sandbox=sandbox) as place:
        built = _built(place, tmp_path)
        assert built.env["CMAKE_PREFIX_PATH"].split(":")[0].endswith("/devel")
        seen = _run(built, tmp_path, Start(name="node", script="src/node.py"))
    assert printed(seen, "node") == [f"863b248d5016ca62ea2e895ae5265cf9 {place.standins}/share"]


@pytest.mark.slow
@pytest.mark.skipif(
    not Path("/usr/share/gencpp").is_dir(), reason="gencpp, which makes C++ headers, is not installed"
)
@pytest.mark.full
def test_a_cpp_node_includes_the_headers(tmp_path: Path) -> None:
    depends = "".join(f"<depend>{name}</depend>" for name in ("roscpp", "turtlesim", "std_srvs"))
    manifest = MANIFEST.replace("</package>", f"{depends}</package>")
    files = {"package.xml": manifest, "CMakeLists.txt": CPP_CMAKE, "src/follow.cpp": CPP}
    with make_place(files) as place:
        seen = _run(_built(place, tmp_path), tmp_path, Start(name="follow", script="follow"))
    assert printed(seen, "follow") == ["863b248d5016ca62ea2e895ae5265cf9", "0b2d2e872a8e2887d5ed626f2bf2c561"]


def test_a_students_own_package_of_that_name_wins(tmp_path: Path) -> None:
    """As in a clone of the tutorials: `turtlesim` lies beside the lab in the same workspace."""
    setup = (
        "from setuptools import setup\n"
        "setup(name='turtlesim', version='0.0.0', packages=['turtlesim', 'turtlesim.msg'], package_dir={'': 'py'})\n"
    )
    own = {
        "package.xml": MANIFEST.replace("<name>lab<", "<name>turtlesim<"),
        "CMakeLists.txt": "cmake_minimum_required(VERSION 3.0.2)\nproject(turtlesim)\nfind_package(catkin REQUIRED)\n"
        "catkin_python_setup()\ncatkin_package()\n",
        "setup.py": setup,
        "py/turtlesim/__init__.py": "",
        "py/turtlesim/msg/__init__.py": "Mine = 'mine'\n",
        "nodes/turtlesim_node": SCRIPT + "print('the student's own node')\n".replace("t's", "ts"),
    }
    launch = '<launch><node name="own" pkg="turtlesim" type="turtlesim_node" output="screen" required="true"/></launch>'
    files = {"src/node.py": SCRIPT + OWN, "launch/own.launch": launch}
    with make_place(files) as place:
        for copy in (place.workspace.built / "src", place.workspace.repaired):
            for name, text in own.items():
                path = copy / "turtlesim" / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            (copy / "turtlesim" / "nodes" / "turtlesim_node").chmod(0o755)
            for path in (copy / "turtlesim", *(copy / "turtlesim").rglob("*")):
                shutil.chown(path, copy.stat().st_uid, copy.stat().st_gid)
        built = _built(place, tmp_path)
        node = _run(built, tmp_path, Start(name="node", script="src/node.py"))
        launched = _run(built, tmp_path, Start(name="own", launch="own.launch"))
    assert printed(node, "node") == ["imported mine"]
    assert "the students own node" in printed(launched, "own")
