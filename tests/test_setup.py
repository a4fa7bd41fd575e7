"""`scripts/setup.sh`: what it asks for, how it becomes root, and that it has nothing to do the second time."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SCRIPT = ROOT / "scripts" / "setup.sh"
LOG = 'printf "%s\\n" "${0##*/} $*" >>"$LOG"\n'
# A Debian on which nothing is installed, seen by somebody who is not root.
BARE = {
    "id": "echo 1000",
    "sudo": f"{LOG}exit 1",
    "dpkg-query": "exit 1",
    "apt-cache": "exit 0",
    "apt-get": f'{LOG}case "$*" in *update) exit 0 ;; esac; exit 100',
}
SHELLS = ("zsh", "fish", "man", "groff", "mandoc")
UPDATE = "apt-get -q -y -o DPkg::Lock::Timeout=300 update"


class Machine:
    """Runs a copy of the script, in a path with a space, among programs that only pretend."""

    def __init__(self, folder: Path) -> None:
        self.project = folder / "a b"
        (self.project / "scripts").mkdir(parents=True)
        shutil.copy(SCRIPT, self.project / "scripts")
        (self.project / "pyproject.toml").touch()
        self.programs = folder / "bin"
        self.programs.mkdir()
        self.log = folder / "log"

    def run(
        self, programs: Mapping[str, str], *arguments: str, rest: str = "/usr/bin:/bin"
    ) -> subprocess.CompletedProcess[str]:
        for name, text in programs.items():
            (self.programs / name).write_text(f"#!/bin/bash\n{text}\n")
            (self.programs / name).chmod(0o755)
        path = f"{self.programs}:{rest}"
        env = {"PATH": path, "LOG": str(self.log), "HOME": os.devnull}
        script = str(self.project / "scripts" / "setup.sh")
        return subprocess.run(
            [script, *arguments],
            env=env,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )

    def calls(self) -> list[str]:
        return self.log.read_text().splitlines() if self.log.exists() else []


@pytest.fixture
def machine(tmp_path) -> Machine:
    if Path("/opt/ros").exists() or shutil.which("bash") is None:
        pytest.skip("ROS comes from elsewhere than Debian's packages on this machine")
    return Machine(tmp_path)


def test_without_root_it_says_in_one_line_what_to_ask_for(machine) -> None:
    done = machine.run(BARE)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1
    assert "ask an administrator" in line
    assert "python3-rospy" in line
    assert "libstd-msgs-dev" in line
    assert machine.calls() == ["sudo -n true"]


def test_root_installs_after_an_update_and_without_questions(machine) -> None:
    done = machine.run({**BARE, "id": "echo 0"})
    update, install = machine.calls()
    assert update == UPDATE
    assert " install --no-install-recommends " in install
    assert "python3-rosmaster" in install
    assert "could not install" in done.stderr
    assert done.returncode == 1


def test_sudo_without_a_password_will_do(machine) -> None:
    machine.run({**BARE, "sudo": f'{LOG}shift; exec "$@"'})
    assert f"sudo -n env DEBIAN_FRONTEND=noninteractive {UPDATE}" in machine.calls()


def test_only_what_is_missing_is_asked_for(machine) -> None:
    installed = 'shift 2; for name; do [ "$name" = rosout ] || echo "installed $name"; done'
    done = machine.run({**BARE, "dpkg-query": installed})
    assert done.stderr.rstrip().endswith("--no-install-recommends rosout")


def test_a_name_that_apt_does_not_know_is_named(machine) -> None:
    done = machine.run({**BARE, "id": "echo 0", "apt-cache": '[ "$2" != python3-rospy ]'})
    (line,) = done.stderr.splitlines()
    assert "apt knows no python3-rospy" in line
    assert machine.calls() == [UPDATE]


def test_a_missing_setup_file_is_named(machine, tmp_path) -> None:
    script = machine.project / "scripts" / "setup.sh"
    env = {"PATH": "/usr/bin:/bin", "GRADER_ROS_SETUP": str(tmp_path / "none.bash")}
    done = subprocess.run([script], env=env, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "none.bash" in done.stderr


class Ready(Machine):
    """All is installed but what the tests of pages need: not even a program of /usr/bin is to be seen."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        binaries = self.project / ".venv" / "bin"
        binaries.mkdir(parents=True)
        for name in ("python", "grader"):
            (binaries / name).write_text("#!/bin/sh\n")
            (binaries / name).chmod(0o755)
        (self.project / ".venv" / "setup-stamp").write_text(f"4294967295 0 {self.project}\n")
        for name in ("bash", "env", "dirname", "cat", "cksum", "grep", "sed", "ls"):
            (self.programs / name).symlink_to(shutil.which(name))

    def setup(
        self, *arguments: str, without: Sequence[str] = (), **programs: str
    ) -> subprocess.CompletedProcess[str]:
        installed = {
            "dpkg-query": 'shift 2; for name; do echo "installed $name"; done',
            **dict.fromkeys(("bwrap", "git", "cmake", "make", "g++", "ip", "ssh-keygen", *SHELLS), "exit 0"),
        }
        here = {name: text for name, text in {**BARE, **installed, **programs}.items() if name not in without}
        return self.run(here, *arguments, rest="/nowhere")


@pytest.fixture
def ready(machine, tmp_path) -> Ready:
    return Ready(tmp_path / "ready")


def test_a_browser_that_cannot_be_had_is_no_obstacle_and_said_once(ready) -> None:
    done = ready.setup()
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == (
        "setup: no chromium nodejs npm here: the tests of pages in a browser will be skipped\n"
    )
    again = ready.setup()
    assert (again.returncode, again.stdout) == (0, "")


def test_a_browser_is_installed_by_root(ready) -> None:
    ready.setup(id="echo 0", node="exit 0")
    update, install = ready.calls()
    assert update == UPDATE
    assert install.endswith("install --no-install-recommends chromium npm")


def test_shells_that_cannot_be_had_are_no_obstacle_and_said_once(ready) -> None:
    pages = {"chromium": "exit 0", "node": "exit 0", "npm": "exit 0"}
    done = ready.setup(**pages, without=("fish", "mandoc"))
    again = ready.setup(**pages, without=("fish", "mandoc"))
    assert done.stdout == "setup: no fish mandoc here: the tests that need them will be skipped\n"
    assert (done.returncode, again.returncode, again.stdout) == (0, 0, "")


def test_a_browser_is_not_for_everybody(ready) -> None:
    done = ready.setup("--no-browser", id="echo 0")
    assert (done.returncode, done.stdout, ready.calls()) == (0, "", [])


def test_what_npm_brings_is_installed_once_for_each_lock_file(ready) -> None:
    pages = ready.project / "tests" / "browser"
    (pages / "node_modules").mkdir(parents=True)
    (pages / "package-lock.json").write_text("{}")
    here = {"chromium": "exit 0", "node": "exit 0", "npm": LOG}
    for text in ("{}", "{}", "{ }"):
        (pages / "package-lock.json").write_text(text)
        assert ready.setup(**here).returncode == 0
    assert [call.split()[3] for call in ready.calls()] == ["ci", "ci"]


def test_the_second_time_there_is_nothing_to_do() -> None:
    if not (ROOT / ".venv" / "setup-stamp").exists():
        pytest.skip("not set up by make setup")
    for _ in range(2):
        done = subprocess.run([SCRIPT], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_for_an_image_it_installs_the_system_and_nothing_else(machine) -> None:
    done = machine.run({**BARE, "id": "echo 0"}, "--system-only")
    update, install = machine.calls()
    assert update == UPDATE
    assert {"python3-rospy", "ca-certificates", "python3-venv"} <= set(install.split())
    assert (done.returncode, (machine.project / ".venv").exists()) == (1, False)  # this apt installs nothing


def test_an_image_that_has_everything_is_left_alone(machine) -> None:
    installed = 'shift 2; for name; do echo "installed $name"; done'
    done = machine.run({**BARE, "dpkg-query": installed}, "--system-only")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert machine.calls() == []
