"""ROS as most courses have it, `/opt/ros/noetic`: correct packages keep all marks, and faults lose theirs.

The same for a course's workspace over it, which `GRADER_ROS_SETUP` names, and for an active environment of conda.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fixtures.make import faulty_package
from grader.model.result import GradingResult
from tests.fixture_runs import read_fixture, rubric_of, surprises
from tests.fresh import conda, noetic
from tests.fresh.room import Rooms, Root

pytestmark = [pytest.mark.ros, pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(1500)]

REPO = Path(__file__).resolve().parents[2]
GRADER = "/opt/ros-lab-grader/bin/grader"
FAULTY = {
    "eyantra-ros-basics": "config-nesting",
    "leeds-comp3631-lab1": "counter-resets-to-1",
    "mcr2-basic-comms": "message-without-time",
    "sheffield-com2009-week1": "rate-1hz",
    "york-ele00118m-lab7": "rate-2hz",
}
OWN_TYPES = ("action-server", "cpp-and-python", "own-message")
"""Examples whose packages make messages, one of them in C++ too."""


@pytest.fixture(scope="module")
def ros(rooms: Rooms, tmp_path_factory) -> Root:
    """ROS Noetic, and the grader in a virtual environment of Debian's Python."""
    key = Path(noetic.__file__).read_bytes() + str(noetic.python38()).encode()
    root = rooms.fresh_root(on=rooms.prepared_root("noetic", key, noetic.install))
    wheels = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(wheels), str(REPO)]
    subprocess.run(build, check=True)
    root.copy_in(wheels, "/tmp/wheel")
    install = "python3.11 -m venv $0 && $0/bin/pip install -q /tmp/wheel/*.whl"
    root.run(["sh", "-c", install, str(Path(GRADER).parent.parent)], network=True)
    return root


@pytest.fixture(scope="module")
def environment(rooms: Rooms, ros: Root) -> Root:
    """The same ROS and grader, ROS in an environment of conda."""
    root = rooms.fresh_root(on=ros)
    conda.install(root)
    return root


def _grade(
    root: Root,
    source: Path,
    lab: str,
    locks: Path | None,
    *,
    user: str | None = None,
    shell: Callable[..., list[str]] = lambda *argv: [*argv],
    **env: str,
) -> GradingResult:
    root.copy_in(source, f"/srv/in/{lab}")
    command = shell(GRADER, "grade", f"/srv/in/{lab}", "--rubric", lab, "--out", "/tmp/out")
    done = root.run(command, privileged=True, locks=locks, env=env, user=user, check=False)
    result = root.path / "tmp" / "out" / lab / "result.json"
    assert result.is_file(), done.stdout + done.stderr
    return GradingResult.model_validate_json(result.read_bytes())


def test_nothing_is_missing(ros: Root) -> None:
    done = ros.run([GRADER, "doctor"], privileged=True, check=False)
    assert "Ready to grade." in done.stdout, done.stdout
    assert f"({noetic.PREFIX}/setup.bash)" in done.stdout
    assert not [line for line in done.stdout.splitlines() if line.startswith("missing")]


@pytest.mark.parametrize("lab", FAULTY)
def test_a_correct_package_keeps_all_marks(rooms: Rooms, ros: Root, lab: str, locks: Path) -> None:
    result = _grade(rooms.fresh_root(on=ros), REPO / "reference_solutions" / lab, lab, locks)
    assert surprises(result, read_fixture(lab, "reference"), rubric_of(lab)) == []
    assert "bubblewrap" in result.environment.sandbox


@pytest.mark.parametrize("lab", FAULTY)
def test_a_fault_costs_what_it_costs_elsewhere(rooms: Rooms, ros: Root, lab: str, locks: Path) -> None:
    name = FAULTY[lab]
    result = _grade(rooms.fresh_root(on=ros), faulty_package(lab, name), lab, locks)
    assert surprises(result, read_fixture(lab, name), rubric_of(lab)) == []


@pytest.mark.parametrize("example", OWN_TYPES)
def test_types_of_ones_own_are_built_and_imported(rooms: Rooms, ros: Root, example: str, locks: Path) -> None:
    result = _grade(rooms.fresh_root(on=ros), REPO / "reference_solutions" / example, example, locks)
    assert surprises(result, read_fixture(example, "reference"), rubric_of(example)) == []


def test_a_courses_workspace_over_it(rooms: Rooms, ros: Root, locks: Path) -> None:
    """The student's launch file could start its nodes: they are found, and so is ROS below it."""
    lab, root = "leeds-comp3631-lab1", rooms.fresh_root(on=ros)
    shutil.copytree(
        REPO / "benchmarks" / "data" / "pulse" / "cpp" / "pulse", root.path / "srv/course/src/pulse"
    )
    make = f". {noetic.PREFIX}/setup.sh && cd /srv/course && catkin_make"
    root.run(["bash", "-c", make])
    setup = "/srv/course/devel/setup.bash"
    result = _grade(root, REPO / "reference_solutions" / lab, lab, locks, GRADER_ROS_SETUP=setup)
    assert setup in result.environment.ros
    assert surprises(result, read_fixture(lab, "reference"), rubric_of(lab)) == []


def test_an_ordinary_user_grades_in_a_sandbox_too(rooms: Rooms, ros: Root) -> None:
    lab, root = "leeds-comp3631-lab1", rooms.fresh_root(on=ros)
    root.run(["useradd", "--uid", "1000", "--create-home", "someone"])
    source = REPO / "reference_solutions" / lab
    result = _grade(root, source, lab, None, user="someone", HOME="/home/someone")
    assert surprises(result, read_fixture(lab, "reference"), rubric_of(lab)) == []
    assert "bubblewrap" in result.environment.sandbox


def test_nothing_is_missing_in_an_environment_of_conda(environment: Root) -> None:
    done = environment.run(conda.active(GRADER, "doctor"), privileged=True, env=conda.ENV, check=False)
    assert "Ready to grade." in done.stdout, done.stdout + done.stderr
    assert conda.PREFIX in done.stdout
    assert not [line for line in done.stdout.splitlines() if line.startswith("missing")]


@pytest.mark.parametrize("lab", FAULTY)
@pytest.mark.parametrize("name", ["reference", "faulty"])
def test_in_an_environment_of_conda(
    rooms: Rooms, environment: Root, name: str, lab: str, locks: Path
) -> None:
    root, name = rooms.fresh_root(on=environment), name if name == "reference" else FAULTY[lab]
    source = REPO / "reference_solutions" / lab if name == "reference" else faulty_package(lab, name)
    result = _grade(root, source, lab, locks, shell=conda.active, **conda.ENV)
    assert surprises(result, read_fixture(lab, name), rubric_of(lab)) == []
    assert conda.PREFIX in result.environment.ros
    assert "bubblewrap" in result.environment.sandbox
