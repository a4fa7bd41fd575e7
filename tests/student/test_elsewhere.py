"""The static part on Windows, on macOS, and without ROS, as far as one Linux machine can stand for them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.student.conftest import Clone, git

ROOT = Path(__file__).resolve().parents[2]
SIMULATION = ROOT / "tests" / "student" / "elsewhere.py"
LAB = ROOT / "reference_solutions" / "leeds-comp3631-lab1" / "lab1"
SYSTEMS = ("win32", "darwin", "noros")


def run(system: str, *argv: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line, as on that system."""
    own = {"PYTHONPATH": str(ROOT), "GIT_CONFIG_GLOBAL": os.devnull, "TMPDIR": str(cwd.parent)}
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("GIT_", "GITHUB_", "CI", "GRADER_"))}
    return subprocess.run(
        [sys.executable, str(SIMULATION), system, *argv],
        cwd=cwd,
        env={**kept, **own, **environment},
        capture_output=True,
        text=True,
        encoding=environment.get("PYTHONIOENCODING", "utf-8"),
        check=False,
    )


@pytest.fixture
def work(clone: Clone, tmp_path: Path) -> Path:
    """The reference solution, committed and pushed."""
    git(clone.top, "rm", "-q", "-r", "lab1")
    shutil.copytree(LAB, clone.top / "lab1")
    clone.commit()
    clone.git("push", "-q")
    return clone.top / "lab1"


@pytest.mark.full
@pytest.mark.parametrize("system", SYSTEMS)
def test_files_are_checked_and_the_way_to_the_rest_is_said(system: str, work: Path) -> None:
    ran = run(system, "check", cwd=work)
    assert ran.returncode == 4, ran.stderr
    assert "20 of 100 points" in ran.stdout
    rest = [line for line in ran.stdout.splitlines() if "docs/how-to/without-ros.md" in line]
    assert len(rest) == 1
    assert "Only your files were checked: " in ran.stdout
    assert "Everything is committed and pushed" in ran.stdout
    assert not list(work.parent.parent.glob("grader-*"))


@pytest.mark.parametrize(
    "system", ["win32", *(pytest.param(system, marks=pytest.mark.full) for system in ("darwin", "noros"))]
)
def test_a_static_check_says_the_same_everywhere(system: str, work: Path) -> None:
    ran = run(system, "check", "--static", "--json", cwd=work)
    assert ran.returncode == 0, ran.stderr
    points = {c["id"]: c["points"] for c in json.loads(ran.stdout)["criteria"] if c["status"] == "pass"}
    assert points["talker-executable"] == points["manifest"] == 5


@pytest.mark.full
def test_where_disks_have_no_modes_git_is_asked(work: Path) -> None:
    git(work, "update-index", "--chmod=-x", "src/numeric_talker.py")
    found = json.loads(run("win32", "check", "--static", "--json", cwd=work).stdout)
    assert {c["id"]: c["status"] for c in found["criteria"]}["talker-executable"] == "fail"


@pytest.mark.full
def test_where_nobody_knows_a_mode_nothing_is_lost(work: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone" / "lab1"
    alone.parent.mkdir()
    shutil.copytree(work, alone)
    found = json.loads(run("win32", "check", "--static", "--json", cwd=alone).stdout)
    assert {c["id"]: c["status"] for c in found["criteria"]}["talker-executable"] == "inconclusive"


@pytest.mark.full
@pytest.mark.parametrize(("kept_by_git", "status"), [("lf", "pass"), ("crlf", "fail")])
def test_line_ends_of_a_checkout_on_windows_are_not_the_students(
    kept_by_git: str, status: str, work: Path
) -> None:
    script = work / "src" / "numeric_talker.py"
    turned = script.read_bytes().replace(b"\n", b"\r\n")
    if kept_by_git == "crlf":
        script.write_bytes(turned)
        git(work, "commit", "-q", "-a", "-m", "From an editor of Windows")
    else:
        git(work, "config", "core.autocrlf", "true")
        script.unlink()
        git(work, "checkout", "-q", "--", "src")
    assert script.read_bytes() == turned
    found = json.loads(run("win32", "check", "--static", "--json", cwd=work).stdout)
    assert {c["id"]: c["status"] for c in found["criteria"]}["talker-executable"] == status


@pytest.mark.full
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_a_shell_of_linux_is_known(system: str, tmp_path: Path) -> None:
    """The lab asks for a shell script that begins with `#!/bin/bash`."""
    top = tmp_path / "top"
    shutil.copytree(ROOT / "reference_solutions" / "eyantra-ros-basics", top)
    git(top, "init", "-q", "-b", "main")
    git(top, "add", "-A")
    found = json.loads(run(system, "check", "--static", "--json", cwd=top).stdout)
    assert [c["id"] for c in found["criteria"] if c["status"] in ("fail", "partial")] == []


@pytest.mark.full
@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "cp437"])
def test_a_console_without_signs_gets_plain_ones(encoding: str, work: Path) -> None:
    ran = run("win32", "check", "--static", cwd=work, PYTHONIOENCODING=encoding)
    assert ran.returncode == 0, ran.stderr
    assert "+ 5 other criteria passed" in ran.stdout


@pytest.mark.full
@pytest.mark.parametrize(
    "argv",
    [
        ("labs",),
        ("explain", "counter-wrap"),
        ("rubric", "validate", str(ROOT / "rubrics" / "mcr2-basic-comms.yaml")),
        ("--version",),
    ],
    ids=lambda argv: "-".join(argv[:2]).replace(str(ROOT), ""),
)
def test_what_needs_no_ros_works_on_windows(argv: tuple[str, ...], tmp_path: Path) -> None:
    ran = run("win32", *argv, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.full
def test_judging_and_reporting_work_on_windows(work: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    done = run("win32", "check", "--static", "--out", str(out), cwd=work)
    assert done.returncode == 0, done.stderr
    assert (out / "lab1" / "report.html").is_file()
    ran = run("win32", "judge", str(out / "lab1" / "evidence"), "--rubric", "leeds-comp3631-lab1", cwd=work)
    assert ran.returncode == 4, ran.stderr
    assert json.loads(ran.stdout)[0]["status"] == "pass"
    ran = run("win32", "report", str(out / "lab1"), "--form", "markdown", cwd=work)
    assert ran.returncode == 0, ran.stderr


@pytest.mark.full
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_doctor_says_what_can_and_what_cannot_be_done(system: str, tmp_path: Path) -> None:
    ran = run(system, "doctor", "--json", cwd=tmp_path)
    assert ran.returncode == 3, ran.stderr
    rows = {row["name"]: row for row in json.loads(ran.stdout)}
    assert rows["ROS 1"]["state"] == "missing"
    assert "docs/how-to/without-ros.md" in rows["ROS 1"]["mend"]
    name = {"win32": "Windows", "darwin": "macOS"}[system]
    assert rows[name]["detail"].startswith("can: check --static")
