"""Where ROS is not to be had, the action runs a container. A stand-in notes what docker is asked for."""

from __future__ import annotations

import json
import os
from itertools import pairwise

import pytest

from tests.integrations.conftest import handed_in
from tests.integrations.runner import ROOT, SYSTEM_PATH

DOCKER = """#!/usr/bin/python3
import json, os, sys
with open({notes!r}, "a") as notes:
    notes.write(json.dumps([sys.argv[1:], dict(os.environ)]) + "\\n")
if sys.argv[1] == "run" and {code} == 0:
    with open(os.environ["GITHUB_OUTPUT"], "a") as output:
        output.write("status=passed\\n")
sys.exit({code} if sys.argv[1] == {failing!r} else 0)
"""
NOTHING = "#!/bin/sh\nexit 100\n"


@pytest.fixture
def docker(tmp_path, runner):
    """Give a function that puts a docker in place, and one that reads what it was asked for."""
    folder, notes = tmp_path / "bin", tmp_path / "notes"
    folder.mkdir()

    def place(*, failing: str = "", code: int = 0):
        (folder / "docker").write_text(DOCKER.format(notes=str(notes), failing=failing, code=code))
        for name in (
            "apt-get",
            "apt-cache",
            "dpkg-query",
            "sudo",
        ):  # a machine on which nothing can be installed
            (folder / name).write_text(NOTHING)
        for path in folder.iterdir():
            path.chmod(0o755)
        runner.path = f"{folder}:{SYSTEM_PATH}"
        del runner.more["GRADER_ROS_SETUP"]
        handed_in(runner.workspace)

    def asked(command: str):
        calls = [json.loads(row) for row in notes.read_text().splitlines()] if notes.exists() else []
        return [(arguments, variables) for arguments, variables in calls if arguments[0] == command]

    return place, asked


def test_where_there_is_no_ros_an_image_is_built_and_run(runner, docker):
    place, asked = docker
    place()
    ran = runner.use(container="always", lab="a lab; $(id)", pass_mark="60%")  # noqa: S106 - a mark
    assert ran.code == 0, ran.log
    assert ran.outputs["status"] == "passed"
    ((build, _),) = asked("build")
    assert build[-1] == str(ROOT)
    ((arguments, variables),) = asked("run")
    assert arguments[-3:] == ["ros-lab-grader:action", "ci", "github"]
    assert variables["GRADER_LAB"] == "a lab; $(id)"
    assert "a lab; $(id)" not in arguments, "values go in by name"
    given = {arguments[i + 1] for i, word in enumerate(arguments) if word == "--env"}
    assert given >= {"GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY", "GRADER_LAB", "GRADER_PASS_MARK", "GRADER_OUT"}


def test_the_container_can_hold_a_sandbox_and_reaches_nothing_else(runner, docker):
    place, asked = docker
    place()
    runner.use(container="always")
    ((arguments, _),) = asked("run")
    options = list(pairwise(arguments))
    for word in ("seccomp=unconfined", "apparmor=unconfined", "systempaths=unconfined"):
        assert ("--security-opt", word) in options
    assert {("--network", "none"), ("--cap-drop", "ALL"), ("--user", f"{os.getuid()}:{os.getgid()}")} <= set(
        options
    )
    assert "--rm" in arguments
    assert "--privileged" not in arguments
    workspace = str(runner.workspace)
    mounts = [words.split(",source=")[1].split(",")[0] for name, words in options if name == "--mount"]
    assert f"type=bind,source={workspace},target={workspace},readonly" in arguments
    writable = [path for path in mounts if path != workspace]
    assert len(writable) == 3
    assert all(path.startswith(str(runner.temp)) for path in writable)


CURL = """#!/bin/sh
printf '%s\\n' "$*" >"{notes}"
while [ "$1" != --output ]; do shift; done
[ "{code}" -ne 0 ] || printf 'a rubric' >"$2"
exit {code}
"""


@pytest.mark.parametrize("code", [0, 22])
def test_a_rubric_by_its_address_is_fetched_before_the_container_that_has_no_network(
    runner, docker, tmp_path, code
):
    place, asked = docker
    place()
    curl = tmp_path / "bin" / "curl"
    curl.write_text(CURL.format(notes=tmp_path / "curl", code=code))
    curl.chmod(0o755)
    digest = "a" * 64
    ran = runner.use(container="always", lab=f"https://course.example/lab1.yaml#sha256:{digest}")
    words = (tmp_path / "curl").read_text()
    assert words.endswith("-- https://course.example/lab1.yaml\n")
    assert "--proto =https" in words
    if code:
        assert (ran.code, ran.outputs["status"], asked("run")) == (3, "not-graded", []), ran.log
        return
    ((arguments, variables),) = asked("run")
    file, _, pin = variables["GRADER_LAB"].partition("#")
    assert pin == f"sha256:{digest}"
    assert f"type=bind,source={file},target={file},readonly" in arguments


def test_an_image_of_the_courses_own_is_not_built(runner, docker):
    place, asked = docker
    place()
    runner.use(container="always", image="ghcr.io/course/grader:2026\n--privileged")
    assert asked("build") == []
    ((arguments, _),) = asked("run")
    assert "ghcr.io/course/grader:2026--privileged" in arguments


@pytest.mark.full
def test_the_static_part_needs_no_container(runner, docker):
    place, asked = docker
    place()
    ran = runner.use(static="true", container="always", path="ws")
    assert ran.code == 0, ran.log
    assert asked("run") == []


@pytest.mark.parametrize(("failing", "code"), [("run", 125), ("run", 137), ("build", 1)])
def test_a_container_that_cannot_be_had_is_nobodys_verdict(runner, docker, failing, code):
    place, _ = docker
    place(failing=failing, code=code)
    ran = runner.use(container="always")
    assert (ran.code, ran.outputs["status"], ran.outputs["passed"]) == (3, "not-graded", "false"), ran.log
    assert ran.annotations("error")[0].startswith("Not graded: ")


@pytest.mark.parametrize("code", [1, 2, 3, 4])
def test_the_graders_own_end_is_the_steps(runner, docker, code):
    place, _ = docker
    place(failing="run", code=code)
    assert runner.use(container="always").code == code


def test_docker_that_does_not_answer(runner, docker):
    place, asked = docker
    place(failing="info", code=1)
    ran = runner.use(container="always")
    assert ran.code == 3
    assert "no docker here that answers" in ran.log
    assert asked("run") == []


def test_ubuntus_switch_is_turned_on_runners_of_githubs_own_alone(runner, docker, tmp_path):
    place, _ = docker
    place()
    turned = tmp_path / "turned"
    (tmp_path / "bin" / "sysctl").write_text("#!/bin/sh\necho 1\n")
    (tmp_path / "bin" / "sudo").write_text(f'#!/bin/sh\nprintf "%s " "$@" >>"{turned}"\n')
    for name in ("sysctl", "sudo"):
        (tmp_path / "bin" / name).chmod(0o755)
    ran = runner.use(container="always")
    assert not turned.exists()
    assert (
        "there will be no sandbox; 'sudo sysctl -w kernel.apparmor_restrict_unprivileged_userns=0'" in ran.log
    )
    runner.more["RUNNER_ENVIRONMENT"] = "github-hosted"
    runner.use(container="always")
    assert turned.read_text() == "-n sysctl -q -w kernel.apparmor_restrict_unprivileged_userns=0 "
