"""Which packages are stood in for, what is copied, and how ROS is told."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import pytest

from grader.arena.sandbox_files import (
    COMPLETED,
    STANDIN_SOURCES,
    copy_standins,
    missing_packages,
    packages_without_program,
    prepare,
    standin_packages,
    with_standins,
)
from grader.cli.host_support import _standins
from grader.ros_env import RosInstallation
from grader.rubric.scenario import Scenario, Start, Until
from tests.arena.support import make_place, printed, require_ros, run

ALL = ("robot_world", "rospy_tutorials", "std_srvs", "turtlesim")


def _ros(*prefixes: Path, **env: str) -> RosInstallation:
    return RosInstallation(
        kind="setup",
        where="x",
        distro="x",
        python="python3",
        prefixes=tuple(map(str, prefixes)),
        env={"PATH": "/usr/bin", **env},
    )


def _package(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name></package>")
    return folder


def test_all_are_missing_where_ros_knows_none(tmp_path: Path) -> None:
    assert standin_packages() == ALL
    assert missing_packages(_ros(tmp_path, ROS_PACKAGE_PATH=f"{tmp_path}/share::/nowhere")) == ALL


def test_what_ros_knows_is_not_stood_in_for(tmp_path: Path) -> None:
    _package(tmp_path / "noetic" / "share" / "turtlesim")
    _package(tmp_path / "ws" / "src" / "ros_tutorials" / "rospy_tutorials")
    own = _package(tmp_path / "std_srvs")
    world = _package(tmp_path / "robot_world")
    ros = _ros(tmp_path / "noetic", ROS_PACKAGE_PATH=f"{tmp_path}/ws/src:{own}:{world}")
    assert missing_packages(ros) == ()
    assert _standins(ros).detail == "not needed for any package"
    assert missing_packages(_ros(tmp_path / "noetic")) == ALL[:3]
    assert missing_packages(_ros(ROS_PACKAGE_PATH=str(tmp_path / "noetic" / "share"))) == ALL[:3]
    assert "robot_world, rospy_tutorials, std_srvs" in _standins(_ros(tmp_path / "noetic")).detail


def test_a_copy_is_an_install_space_with_programs_that_run(tmp_path: Path) -> None:
    _package(tmp_path / "noetic" / "share" / "std_srvs")
    folder = tmp_path / "standins"
    copy_standins(folder, _ros(tmp_path / "noetic"))
    assert sorted(p.name for p in (folder / "share").iterdir()) == [
        "robot_world",
        "rospy_tutorials",
        "turtlesim",
    ]
    programs = {p.name for p in folder.rglob("*") if p.is_file() and os.access(p, os.X_OK)}
    talkers = {"talker", "talker.py", "listener", "listener.py"}
    assert programs == talkers | {
        "robot_world",
        "turtlesim_node",
        "turtle_teleop_key",
        "draw_square",
        "mimic",
    }
    assert not list(folder.rglob("__pycache__"))
    assert all(p.stat().st_mode & 0o444 == 0o444 for p in folder.rglob("*"))


def test_a_package_without_its_program_gets_the_graders(tmp_path: Path) -> None:
    installed = _package(tmp_path / "ros" / "share" / "tf2_ros")
    ros, (place, program) = _ros(tmp_path / "ros"), (tmp_path / "place", "static_transform_publisher")
    assert [(folder, [p.name for p in found]) for folder, found in packages_without_program(ros)] == [
        (installed, [program])
    ]
    prepare(place, ros)
    completed = place / COMPLETED / "tf2_ros"
    assert {path.name for path in completed.iterdir()} == {"package.xml", program}
    assert os.access(completed / program, os.X_OK)
    (tmp_path / "ros" / "lib" / "tf2_ros").mkdir(parents=True)
    (tmp_path / "ros" / "lib" / "tf2_ros" / program).touch()
    assert list(packages_without_program(ros)) == []


def test_stand_ins_come_after_everything_else(tmp_path: Path) -> None:
    copy_standins(tmp_path / "standins", _ros())
    before = {"ROS_PACKAGE_PATH": "/in/share:/ws/src:/usr/share", "HOME": "/home/student"}
    env = with_standins(before, tmp_path / "standins", "/in")
    assert env["ROS_PACKAGE_PATH"] == "/ws/src:/usr/share:/in/share"
    assert env["CMAKE_PREFIX_PATH"] == "/in"
    assert env["PYTHONPATH"].split(":") == ["/in/python", *(f"/in/share/{name}/python" for name in ALL)]
    assert env["HOME"] == "/home/student"
    assert with_standins(env, tmp_path / "standins", "/in") == env


def test_nothing_is_told_where_nothing_is_missing(tmp_path: Path) -> None:
    for name in ALL:
        _package(tmp_path / "noetic" / "share" / name)
    copy_standins(tmp_path / "standins", _ros(tmp_path / "noetic"))
    assert with_standins({"A": "b"}, tmp_path / "standins", "/in") == {"A": "b"}


@pytest.mark.parametrize(
    "path",
    [
        p
        for p in sorted(STANDIN_SOURCES.rglob("*"))
        if p.is_file() and (p.suffix == ".py" or p.read_bytes()[:2] == b"#!")
    ],
    ids=lambda path: path.relative_to(STANDIN_SOURCES).as_posix(),
)
def test_the_sources_are_python_3_8(path: Path) -> None:
    assert isinstance(ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8)), ast.Module)


@pytest.mark.ros
def test_the_real_package_of_a_sourced_ros_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ROS comes from a `setup.bash` whose `rospy_tutorials` is there, and whose `turtlesim` is not."""
    if require_ros().kind != "debian":
        pytest.skip("asks for Debian's packages to make a setup.bash of")
    prefix = tmp_path / "prefix"
    talker = _package(prefix / "share" / "rospy_tutorials") / "talker"
    talker.write_text("#!/bin/sh\necho the real talker\n")
    talker.chmod(0o755)
    for folder in (tmp_path, *tmp_path.parents[:-2]):
        folder.chmod(folder.stat().st_mode | 0o011)
    path = f"{prefix}/share:/usr/share"
    (prefix / "setup.bash").write_text(f"export ROS_PACKAGE_PATH={path} ROS_DISTRO=made-up\n")
    monkeypatch.setenv("GRADER_ROS_SETUP", str(prefix / "setup.bash"))
    missing = missing_packages(require_ros())
    assert "turtlesim" in missing
    assert "rospy_tutorials" not in missing
    launch = """<launch>
      <node name="talker" pkg="rospy_tutorials" type="talker" output="screen"/>
      <node name="sim" pkg="turtlesim" type="turtlesim_node"/>
    </launch>"""
    scenario = Scenario(
        title="t",
        start=(Start(name="all", launch="all.launch"),),
        until=Until(messages={"/turtle1/pose": 10}, first_message_s=15),
    )
    with make_place({"launch/all.launch": launch}, sandbox="none") as place:
        seen = run(place, scenario, tmp_path / "run.mcap")
    # It may come behind words of roslaunch's own, on one line.
    assert any("the real talker" in line for line in printed(seen, "all"))
    assert len(seen.student_channels("/turtle1/pose")) == 1
