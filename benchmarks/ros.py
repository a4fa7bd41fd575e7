"""ROS's own tools, which the grader is measured beside."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.figures import NotMeasured
from benchmarks.machine import Cost, timed
from grader.host_programs import HOST_PATH
from grader.ros_env import RosInstallation, find_ros

MASTER_S, LOOK_S = 10.0, 0.02
HZTEST = """<launch>
  <node pkg="{package}" type="{program}" name="talker"/>
  <test test-name="chatter" pkg="rostest" type="hztest" name="chatter">
    <param name="topic" value="/chatter"/>
    <param name="hz" value="10.0"/>
    <param name="hzerror" value="0.5"/>
    <param name="test_duration" value="5.0"/>
  </test>
</launch>
"""


def require_ros() -> RosInstallation:
    """Return the ROS 1 of this machine. Raises NotMeasured where there is none."""
    ros = find_ros()
    if ros is None:
        raise NotMeasured("no ROS 1 on this machine")
    return ros


def ros_env(home: Path, **more: str) -> dict[str, str]:
    """What ROS's programs need, with logs and results below `home`."""
    ros = require_ros()
    path = os.pathsep.join([ros.env["PATH"], HOST_PATH])
    plain = {"HOME": str(home), "ROS_HOSTNAME": "localhost", "LANG": "C.UTF-8", "PYTHONUNBUFFERED": "1"}
    return {**ros.env, **plain, "PATH": path, **more}


def program(name: str) -> str:
    """Where one of ROS's programs is."""
    found = require_ros().program(name)
    if found is None:
        raise NotMeasured(f"{name} is not installed")
    return found


def hztest_workspace(folder: Path, package: Path, script: str) -> Path:
    """A workspace with the package, built, and one rate check of `/chatter` as a rostest."""
    workspace = folder / "ws"
    copy = workspace / "src" / package.name
    shutil.copytree(package, copy)
    (copy / "test").mkdir()
    (copy / "test" / "hz.test").write_text(HZTEST.format(package=package.name, program=script))
    for file in copy.glob("src/*.py"):
        file.write_text(file.read_text().replace("env python\n", "env python3\n"))
    timed([program("catkin_make")], cwd=workspace, env=ros_env(folder))
    return workspace


def hztest(workspace: Path) -> Cost:
    """`rostest` with `hztest`: exit code 0 where the rate passed."""
    package = next((workspace / "src").glob("*/package.xml")).parent.name
    words = 'source devel/setup.bash && exec rostest "$1" hz.test'
    argv = ["/bin/bash", "-c", words, "bash", package]
    return timed(argv, cwd=workspace, env=ros_env(workspace), codes=(0, 1))


@contextmanager
def master(home: Path) -> Iterator[dict[str, str]]:
    """ROS's own master on a free port: the environment of who wants to speak to it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    env = ros_env(home, ROS_MASTER_URI=f"http://localhost:{port}")
    argv = [program("rosmaster"), "--core", "-p", str(port)]
    with running(argv, env):
        _await_master(env["ROS_MASTER_URI"])
        yield env


@contextmanager
def running(argv: list[str], env: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    """The process, ended with the block. Its stdout is a pipe."""
    process = subprocess.Popen(
        argv, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=env["HOME"]
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def _await_master(uri: str) -> None:
    until_s = time.monotonic() + MASTER_S
    while not _answers(uri):
        if time.monotonic() > until_s:
            raise NotMeasured("rosmaster does not answer")
        time.sleep(LOOK_S)


def _answers(uri: str) -> bool:
    try:
        xmlrpc.client.ServerProxy(uri).getPid("/benchmark")
    except OSError:
        return False
    return True
