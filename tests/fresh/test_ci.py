"""CI jobs in a container of Debian: the scripts of `ci/gitlab.yml` and `action.yml`, with a real installation."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.fresh.room import Rooms, Root
from tests.integrations.gitlab import JOB, variables_of
from tests.integrations.runner import ACTION, outputs_in

pytestmark = [pytest.mark.ros, pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(900)]

REPO = Path(__file__).resolve().parents[2]
SOLUTION = REPO / "reference_solutions" / "leeds-comp3631-lab1" / "lab1"
NOT_INSTALLED = ("benchmarks/", "docs/", "fixtures/", "tests/")
PROJECT = "/builds/robotics/my-lab"
GIT = ["git", "-c", "user.name=a", "-c", "user.email=a@example.org", "-C", "/srv/grader"]


@pytest.fixture(scope="module")
def machine(rooms: Rooms, system: Root) -> Root:
    """A container with the packages of Debian, a student's project, and the grader's repository somewhere else."""
    root = rooms.fresh_root(on=system)
    ask = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listed = subprocess.run(ask, cwd=REPO, capture_output=True, check=True).stdout.decode().split("\0")
    for name in listed:
        if name and not name.startswith(NOT_INSTALLED) and (REPO / name).is_file():
            root.copy_in(REPO / name, f"/srv/grader/{name}")
    for words in (["init", "-q", "-b", "v1"], ["add", "."], ["commit", "-qm", "v1"]):
        root.run([*GIT, *words])
    shutil.copytree(SOLUTION, root.path / PROJECT.lstrip("/") / "src" / "lab1")
    return root


@pytest.fixture(scope="module")
def installed(machine: Root, locks: Path) -> tuple[Root, subprocess.CompletedProcess[str]]:
    """GitLab's job there, with its first installation."""
    told = variables_of(PROJECT, GRADER_REPOSITORY="/srv/grader", GRADER_PASS_MARK="80%")  # noqa: S106 - a mark
    script = "set -eo pipefail\n" + "\n".join([*JOB["before_script"], *JOB["script"]])
    done = machine.run(
        ["bash", "-c", script], env=told, cwd=PROJECT, network=True, locks=locks, check=False, timeout=800
    )
    machine.run(["bash", "-c", "\n".join(JOB["after_script"])], env=told, cwd=PROJECT)
    return machine, done


def test_a_job_of_gitlab_installs_the_grader_and_runs_nodes(installed) -> None:
    root, done = installed
    assert done.returncode == 0, done.stdout + done.stderr
    results = root.path / PROJECT.lstrip("/") / "grader-results"
    assert json.loads((results / "result.json").read_bytes())["points"] >= 80
    assert (results / "evidence" / "wraps.mcap").is_file()
    assert "sandbox: " in done.stdout


def test_a_job_of_github_in_a_container_runs_what_is_installed(installed, locks) -> None:
    root, _ = installed
    home = f"{PROJECT}.grader"
    temp = root.path / "runner"
    temp.mkdir()
    (temp / "ros-lab-grader").symlink_to(home)
    told = {
        "GITHUB_ACTION_PATH": f"{home}/source",
        "GITHUB_WORKSPACE": PROJECT,
        "RUNNER_TEMP": "/runner",
        "GITHUB_OUTPUT": "/runner/output",
        "GITHUB_STEP_SUMMARY": "/runner/summary",
        "GRADER_PATH": "src/lab1",
    }
    for step in ACTION["runs"]["steps"][:2]:
        found = outputs_in((temp / "output").read_text()) if (temp / "output").exists() else {}
        told |= {"GRADER_HOW": found.get("how", ""), "GRADER_OUT": found.get("results", "")}
        done = root.run(["bash", "-eo", "pipefail", "-c", step["run"]], env=told, cwd=PROJECT, locks=locks)
        assert "installing" not in done.stdout + done.stderr
    found = outputs_in((temp / "output").read_text())
    assert (found["how"], found["status"], found["points"]) == ("native", "passed", "100"), done.stdout
    assert (temp / "summary").read_text().startswith("**Passed:** 100 of 100 points")
