"""`grader check` as a student sees it: what it took, what it says of git, and how it ends."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from grader.model.result import GitStatus, Point
from tests.student.conftest import SCRIPT, Clone

ROOT = Path(__file__).resolve().parents[2]
SOLUTIONS = ROOT / "reference_solutions"


def check(*argv: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command line, with nothing of whoever runs the tests."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("GIT_", "GITHUB_", "CI", "PRE_COMMIT"))}
    own = {"GIT_CONFIG_GLOBAL": os.devnull, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", "grader", "check", "--static", *argv],
        cwd=cwd,
        env={**kept, **own, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def lab(clone: Clone) -> Clone:
    """The reference solution in the place of the small package, pushed."""
    shutil.rmtree(clone.package)
    shutil.copytree(SOLUTIONS / "leeds-comp3631-lab1" / "lab1", clone.package)
    clone.commit()
    clone.git("push", "-q")
    return clone


@pytest.mark.full
def test_it_says_what_it_took_and_that_all_is_pushed(lab: Clone) -> None:
    done = check(cwd=lab.package / "launch")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("grader: Checking lab1 in .. against leeds-comp3631-lab1\n")
    assert "Everything is committed and pushed: origin/main has it" in done.stdout


@pytest.mark.full
def test_what_is_not_pushed_is_told_in_80_columns(lab: Clone) -> None:
    for number in range(30):
        (lab.package / f"a_script_with_a_rather_long_name_{number}.py").write_text(SCRIPT)
    (lab.package / "src" / "listener.py").write_text(SCRIPT)
    done = check(cwd=lab.package)
    assert done.returncode == 0, done.stderr
    _, _, below = done.stdout.partition("Only pushed work is marked. These changes aren't pushed yet:")
    assert "1 change is not committed: src/listener.py" in below
    assert "git add src/listener.py\n" in below
    assert "30 files of the package are not in git:" in below
    assert done.stdout.rstrip().endswith("points so far, 80 not decided yet")
    assert max(map(len, done.stdout.splitlines())) <= 80


@pytest.mark.full
def test_the_verdicts_stay_what_the_disk_says(lab: Clone) -> None:
    before = json.loads(check("--json", cwd=lab.package).stdout)
    (lab.package / "src" / "new.py").write_text(SCRIPT)
    after = json.loads(check("--json", cwd=lab.package).stdout)
    assert before["points"] == after["points"]
    assert before["standing"]["points"] == []
    assert [point["kind"] for point in after["standing"]["points"]] == ["untracked"]
    assert list(after)[:3] == ["schema", "submission", "rubric"]


@pytest.mark.full
def test_no_file_of_results_has_it(lab: Clone, tmp_path: Path) -> None:
    (lab.package / "src" / "new.py").write_text(SCRIPT)
    assert check("--out", str(tmp_path / "out"), cwd=lab.package).returncode == 0
    assert "standing" not in json.loads((tmp_path / "out" / "lab1" / "result.json").read_text())


@pytest.mark.full
def test_in_ci_a_checkout_is_not_nagged(lab: Clone) -> None:
    lab.git("checkout", "-q", "--detach")
    lab.git("remote", "remove", "origin")
    done = check(cwd=lab.package, GITHUB_ACTIONS="true", CI="true")
    assert done.returncode == 0, done.stderr
    assert "Your marks" not in done.stdout
    assert "Before you submit" not in done.stdout


@pytest.mark.full
def test_packages_of_two_labs_one_after_the_other(lab: Clone, tmp_path: Path) -> None:
    shutil.copytree(SOLUTIONS / "mcr2-basic-comms" / "basic_comms", lab.top / "basic_comms")
    (lab.top / "basic_comms" / "package.xml").write_text("<package><name>basic_comms</name>")
    done = check("--out", str(tmp_path / "out"), cwd=lab.top)
    assert done.returncode == 1
    assert "leeds-comp3631-lab1: " in done.stdout
    assert "mcr2-basic-comms: " in done.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["basic_comms", "lab1"]
    assert check("--json", cwd=lab.top).returncode == 2


@pytest.mark.full
def test_staged_goes_with_static_alone(lab: Clone) -> None:
    done = check("--staged", "--watch", cwd=lab.package)
    assert done.returncode == 2
    assert "--staged goes with --static" in done.stderr


@pytest.mark.full
def test_staged_outside_of_a_repository(tmp_path: Path) -> None:
    shutil.copytree(SOLUTIONS / "leeds-comp3631-lab1" / "lab1", tmp_path / "lab1")
    done = check("--staged", cwd=tmp_path / "lab1")
    assert done.returncode == 2
    assert "is not in a git repository" in done.stderr


@pytest.mark.full
def test_staged_heeds_the_index_that_git_names(lab: Clone) -> None:
    """As `git commit -a` does to its hooks."""
    own = lab.top / ".git" / "next-index-1.lock"
    shutil.copy(lab.top / ".git" / "index", own)
    environment = {**os.environ, "GIT_INDEX_FILE": str(own)}
    command = ["git", "update-index", "--chmod=-x", "lab1/src/numeric_talker.py"]
    subprocess.run(command, cwd=lab.top, env=environment, check=True)
    assert check("--staged", cwd=lab.top).returncode == 0
    assert check("--staged", cwd=lab.top, GIT_INDEX_FILE=str(own)).returncode == 1
    assert check("--staged", cwd=lab.top, GIT_INDEX_FILE="/etc/passwd").returncode == 0


def test_hostile_text_is_shown_and_obeyed_by_nobody(lab: Clone) -> None:
    (lab.package / "src" / "::error::x\x1b[31m.py").write_text(SCRIPT)
    done = check(cwd=lab.package)
    assert "\x1b" not in done.stdout
    assert not any(row.lstrip().startswith("::") for row in done.stdout.splitlines())


def test_a_file_whose_name_has_a_sign_of_the_shell_stays_one_word(lab: Clone) -> None:
    (lab.package / "src" / "count && tell.py").write_text(SCRIPT)
    lines = [row.strip() for row in check(cwd=lab.package).stdout.splitlines()]
    assert "git add 'src/count && tell.py'" in lines
    assert "git commit -m Lab" in lines


def test_a_point_is_a_record() -> None:
    point = Point(kind="mode", text="git does not know that this is executable: a.py", fix="git add a.py")
    assert GitStatus.model_validate_json(GitStatus(points=(point,)).model_dump_json()) == GitStatus(
        points=(point,)
    )
