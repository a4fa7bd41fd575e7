"""An ordinary user without root and sudo, on a machine whose packages are installed, in a clone of their own."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from grader.model.result import GradingResult
from tests.fresh.room import Rooms, Root

pytestmark = [pytest.mark.ros, pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(900)]

REPO = Path(__file__).resolve().parents[2]
HOME, USER = "/home/someone", "someone"
CLONE = f"{HOME}/ros-lab-grader"
CHECK = [f"{CLONE}/.venv/bin/grader", "check", "reference_solutions/leeds-comp3631-lab1"]
CHECK += ["--rubric", "leeds-comp3631-lab1", "--out", f"{HOME}/out"]
WITHOUT_NAMESPACES = """
set -e
coproc unshare --user cat
until [ "$(readlink /proc/$COPROC_PID/ns/user)" != "$(readlink /proc/self/ns/user)" ]; do :; done
for map in uid_map gid_map; do echo '0 0 65536' >/proc/$COPROC_PID/$map; done
exec nsenter --user=/proc/$COPROC_PID/ns/user sh -c 'echo 0 >/proc/sys/user/max_user_namespaces
  exec setpriv --reuid=someone --regid=someone --init-groups --inh-caps=-all "$@"' sh "$@"
"""
"""Runs a command as that user where nobody may make a user namespace: the limit is that of a namespace around it."""


@pytest.fixture(scope="module")
def clone(rooms: Rooms, system: Root) -> Root:
    """A clone that has its virtual environment: `make demo` made it, and ran in a container."""
    root = rooms.fresh_root(on=system)
    root.run(["useradd", "--uid", "1000", "--create-home", "--shell", "/bin/bash", USER])
    ask = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listed = subprocess.run(ask, cwd=REPO, capture_output=True, check=True).stdout.decode().split("\0")
    for name in filter(None, listed):
        if (REPO / name).is_file():
            root.copy_in(REPO / name, f"{CLONE}/{name}")
    root.run(["chown", "-R", f"{USER}:{USER}", HOME])
    root.run(["make", "demo"], user=USER, env={"HOME": HOME}, cwd=CLONE, network=True, timeout=800)
    return root


@pytest.fixture
def run(rooms: Rooms, clone: Root) -> Callable[..., tuple[subprocess.CompletedProcess[str], Root]]:
    """Runs a command there as that user, with the kernel of a machine and without a network."""

    def run_as_user(*argv: str, user: str | None = USER) -> tuple[subprocess.CompletedProcess[str], Root]:
        root = rooms.fresh_root(on=clone)
        env = {"HOME": HOME, "LANG": "C.UTF-8"}
        done = root.run(argv, privileged=True, user=user, env=env, cwd=CLONE, check=False)
        return done, root

    return run_as_user


def _result(root: Root, path: str) -> GradingResult:
    return GradingResult.model_validate_json((root.path / path.lstrip("/") / "result.json").read_bytes())


def test_make_demo_in_a_container(clone: Root) -> None:
    points = [
        _result(clone, f"{CLONE}/demo/{name}").points
        for name in ("leeds-comp3631-lab1", "counter-resets-to-1")
    ]
    assert points == [100, 85]


def test_make_demo_with_a_sandbox(run) -> None:
    done, root = run("make", "demo")
    assert done.returncode == 0, done.stdout + done.stderr
    result = _result(root, f"{CLONE}/demo/leeds-comp3631-lab1")
    assert "bubblewrap" in result.environment.sandbox
    assert result.points == 100


def test_the_tests_of_gradings(run) -> None:
    command = (
        ".venv/bin/python -m pytest -q -p no:cacheprovider -n 2 -m 'ros and not full' tests/test_grading.py"
    )
    done, _ = run("bash", "-c", command)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]


def test_without_user_namespaces_no_sandbox_can_be_had(run) -> None:
    done, root = run("bash", "-c", WITHOUT_NAMESPACES, "bash", *CHECK, "--sandbox", "require", user=None)
    assert done.returncode == 3, done.stdout + done.stderr
    assert "no sandbox on this machine" in done.stderr
    assert _result(root, f"{HOME}/out/leeds-comp3631-lab1").status == "error"


def test_without_user_namespaces_it_can_be_done_without(run) -> None:
    done, root = run("bash", "-c", WITHOUT_NAMESPACES, "bash", *CHECK, "--sandbox", "none", user=None)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "The sandbox is switched off (--sandbox none)" in done.stderr
    result = _result(root, f"{HOME}/out/leeds-comp3631-lab1")
    assert "bubblewrap" not in result.environment.sandbox
    assert result.points == 100
