"""Programs that run outside of every sandbox: they depend neither on the current folder nor on the environment."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from grader.cli.host_support import _modules
from grader.host_programs import (
    HOST_ENV,
    find_host_program,
    find_user_program,
    module_command,
    with_absolute_paths,
)
from grader.intake.git import Git
from grader.judging import overall_status
from grader.ros_env import RosInstallation
from grader.workers import Worker
from tests.intake.samples import write

ROOT = Path(__file__).resolve().parent.parent
TAKEN = """\
from pathlib import Path
Path({marker!r}).write_text(__name__)
raise SystemExit("a student's file was imported")
"""
# Of Python's own: the first that each of these processes imports from a file, and what comes soon after.
NAMES = (
    "multiprocessing",
    "numbers",
    "pickle",
    "pip",
    "ensurepip",
    "random",
    "runpy",
    "secrets",
    "venv",
    "grader",
    "yaml",
)


@pytest.fixture
def marker(tmp_path, monkeypatch) -> Path:
    """Nothing writes this file, though the current folder is a student's with modules named like Python's own."""
    marker, folder = tmp_path / "marker", tmp_path / "student"
    write(folder, {f"{name}.py": TAKEN.format(marker=str(marker)) for name in NAMES})
    monkeypatch.chdir(folder)
    return marker


@pytest.mark.full
def test_a_process_of_the_grader_imports_nothing_from_the_folder_that_it_is_started_in(marker) -> None:
    module = "grader.workers"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        module_command(module), input=b"", env=environment, capture_output=True, check=False
    )
    assert not marker.exists(), done.stderr.decode()
    old = [sys.executable, "-m", module]
    subprocess.run(old, input=b"", env=environment, capture_output=True, check=False)
    assert marker.exists()  # the files in that folder would have been found


def test_worker_processes_import_nothing_from_the_current_folder(marker, monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    worker = Worker()
    try:
        assert worker.run(overall_status, ()) == "error"
    finally:
        worker.close()
    assert not marker.exists()


def test_ci_installs_the_grader_without_a_look_into_the_students_folder(marker, tmp_path) -> None:
    """It goes as far as to ask whether this Python fits, and no further: it may not make its folder."""
    write(tmp_path, {"file": ""})
    variables = {
        "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin",
        "GRADER_HOME": str(tmp_path / "file" / "home"),
    }
    script = (ROOT / "ci" / "install.sh").read_text().replace("provide_python\n", "provide_python; exit 7\n")
    at = write(
        tmp_path / "checkout",
        {"ci/install.sh": script.replace('mkdir -p "$home"', ":"), "pyproject.toml": ""},
    )
    done = subprocess.run(
        ["/bin/bash", at / "ci" / "install.sh"], env=variables, capture_output=True, check=False
    )
    assert (done.returncode, marker.exists()) == (7, False), done.stderr.decode()


def test_lists_of_folders_lose_entries_that_depend_on_the_current_folder() -> None:
    given = {"PATH": "/a::.:b/c:/d", "LD_LIBRARY_PATH": ":/e", "PYTHONPATH": ".", "HOME": "/home/ada"}
    assert with_absolute_paths(given) == {"PATH": "/a:/d", "LD_LIBRARY_PATH": "/e", "HOME": "/home/ada"}
    assert with_absolute_paths({"PATH": ""})["PATH"] == "/usr/bin:/bin"


def test_programs_are_not_found_in_the_current_folder(tmp_path, monkeypatch) -> None:
    write(tmp_path, {"here/git": "#!/bin/sh\n", "bin/git": "#!/bin/sh\n"}, executable=("here/git", "bin/git"))
    monkeypatch.chdir(tmp_path / "here")
    assert find_user_program("git", {"PATH": f".::{tmp_path}/bin"}) == str(tmp_path / "bin" / "git")
    assert find_user_program("no-such-program") is None


def test_git_in_a_students_folder_finds_nothing_of_his(tmp_path, monkeypatch) -> None:
    """No program by an empty entry of PATH, no library by one of LD_LIBRARY_PATH, nothing that names a program."""
    names = ("git", "setpriv", "prlimit")
    real = str(Path(find_user_program("git") or "").parent)
    student = write(tmp_path / "student", dict.fromkeys(names, "#!/bin/sh\ntouch taken\n"), executable=names)
    asked = write(
        tmp_path / "bin",
        {"git": f'#!/bin/sh\nenv > {tmp_path}/env\nexec {real}/git "$@"\n'},
        executable=("git",),
    )
    monkeypatch.setenv("PATH", f":.:{asked}:{real}:/usr/bin:/bin")
    monkeypatch.setenv("LD_LIBRARY_PATH", ":/usr/local/lib")
    monkeypatch.setenv("BASH_ENV", "hook.sh")
    monkeypatch.setenv("PAGER", "./git")
    monkeypatch.chdir(student)
    for remote in (False, True):
        said = Git(tmp_path / "home", timeout_s=120).run("--version", cwd=student, remote=remote)
        told = dict(line.split("=", 1) for line in (tmp_path / "env").read_text().splitlines() if "=" in line)
        assert said.startswith(b"git version")
        assert not (student / "taken").exists()
        assert told["PATH"] == f"{asked}:{real}:/usr/bin:/bin"
        assert told["LD_LIBRARY_PATH"] == "/usr/local/lib"
        assert remote or not {"BASH_ENV", "PAGER"} & told.keys()


def test_doctor_asks_the_python_of_ros_from_the_root_folder(tmp_path) -> None:
    """`python -c` looks in the current folder first."""
    python = (
        write(tmp_path, {"python3": f"#!/bin/sh\npwd > {tmp_path}/here\n"}, executable=("python3",))
        / "python3"
    )
    ros = RosInstallation(kind="debian", where="", distro="", python=str(python), prefixes=(), env={})
    assert {row.state for row in _modules(ros)} == {"ok"}
    assert (tmp_path / "here").read_text() == "/\n"


@pytest.fixture
def _asked_again():
    find_host_program.cache_clear()
    yield
    find_host_program.cache_clear()


@pytest.mark.usefixtures("_asked_again")
def test_programs_are_not_found_by_the_path_of_the_caller(tmp_path, monkeypatch) -> None:
    for name in ("sh", "no-such-program-anywhere"):
        (tmp_path / name).write_text("#!/bin/sh\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    found = find_host_program("sh")
    assert found is not None
    assert Path(found).parent != tmp_path
    assert find_host_program("no-such-program-anywhere") is None


def test_the_path_that_is_handed_on_has_no_folder_of_a_user() -> None:
    assert set(HOST_ENV) == {"PATH", "LANG"}
    folders = [Path(folder) for folder in HOST_ENV["PATH"].split(":")]
    assert all(folder.is_absolute() for folder in folders)
    assert not [folder for folder in folders if folder.exists() and folder.stat().st_uid != 0]
