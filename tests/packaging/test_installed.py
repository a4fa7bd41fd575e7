"""The wheel as pipx installs it: what users do first, with nothing of the repository in sight."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from grader import __version__
from tests.packaging.conftest import LAB
from tests.packaging.making import ROOT, Installed, plain_environment

SHARED = ("man/man1/grader.1", "share/bash-completion/completions/grader", "share/zsh/site-functions/_grader")
MAN = shutil.which("man")
RECORDING = ROOT / "tests" / "data" / "recordings" / "correct"


@pytest.mark.full
def test_pipx_shows_the_program_its_man_page_and_its_completion(pipx_home: Path, installed: Installed):
    assert installed.program.is_file()
    assert [name for name in SHARED if not (pipx_home / name).is_file()] == []
    assert (pipx_home / "share/fish/vendor_completions.d/grader.fish").is_file()


@pytest.mark.full
@pytest.mark.skipif(MAN is None, reason="no man here: apt-get install man-db")
def test_man_finds_the_page(pipx_home: Path):
    environment = {**plain_environment(), "MANPATH": str(pipx_home / "man"), "MANWIDTH": "80"}
    done = subprocess.run([str(MAN), "grader"], env=environment, capture_output=True, text=True, check=True)
    assert "grader - grade introductory ROS 1 labs" in done.stdout


@pytest.mark.full
def test_the_first_line_of_the_version_is_the_grader_s(installed: Installed, tmp_path):
    lines = installed("--version", cwd=tmp_path).splitlines()
    assert lines[0] == f"grader {__version__}"
    assert re.fullmatch(r"Python 3\.\d+\.\S+ \(.*\)", lines[1])
    assert lines[2].startswith("ROS 1 ")


@pytest.mark.full
def test_the_labs_are_those_of_the_repository(installed: Installed, tmp_path):
    labs = json.loads(installed("labs", "--json", cwd=tmp_path))
    assert {lab["id"] for lab in labs} == {path.stem for path in (ROOT / "rubrics").glob("*.yaml")}


def test_a_student_checks_a_package(installed: Installed, package: Path):
    result = json.loads(installed("check", "--static", "--json", cwd=package))
    criteria = {one["id"]: one["status"] for one in result["criteria"]}
    assert criteria["manifest"] == criteria["cmake"] == criteria["talker-executable"] == "pass"


@pytest.mark.full
def test_a_student_s_fault_is_found(installed: Installed, package: Path):
    (package / "package.xml").write_text("<package", encoding="utf-8")
    out = installed("check", "--static", cwd=package, code=1)
    assert "package.xml" in out


@pytest.mark.full
def test_evidence_is_judged(installed: Installed, tmp_path):
    out = installed("judge", RECORDING, "--rubric", LAB, cwd=tmp_path)
    assert {one["status"] for one in json.loads(out)} == {"pass"}


@pytest.mark.full
def test_explain_and_validate_find_the_rubrics(installed: Installed, tmp_path):
    assert f"{LAB}/counter-wrap: " in installed("explain", "counter-wrap", cwd=tmp_path)
    assert f"{LAB}: ok" in installed("rubric", "validate", LAB, cwd=tmp_path)


@pytest.mark.full
def test_the_reference_solutions_and_their_mutants_are_inside(installed: Installed, tmp_path):
    installed("example", LAB, "correct", cwd=tmp_path)
    assert (tmp_path / "correct" / "lab1" / "src" / "talker.py").stat().st_mode & 0o100
    assert "counter" in installed("example", LAB, cwd=tmp_path)


@pytest.mark.full
def test_an_example_rubric_with_its_own_checks_works(installed: Installed, pipx_home: Path, tmp_path):
    (examples,) = pipx_home.glob("home/venvs/*/lib/python3*/site-packages/grader/_data/rubrics/examples")
    for rubric in ("turtle-square.yaml", "own-checks/own-checks.yaml"):
        assert ": ok" in installed("rubric", "validate", examples / rubric, cwd=tmp_path)


PACKAGES = {"review": "flask", "similarity": "copydetect", "cluster": "distributed"}
EXTRAS = {
    "review": ["review", "."],
    "similarity": ["similar", "."],
    "cluster": ["batch", ".", "--rubric", LAB, "--cluster", "local"],
}


@pytest.mark.full
@pytest.mark.parametrize("extra", EXTRAS)
def test_without_its_extra_a_command_says_in_one_line_which_to_install(
    installed: Installed, package: Path, extra
):
    done = installed.run(*EXTRAS[extra], cwd=package.parent)
    assert done.returncode == 2, done.stderr
    error, hint = done.stderr.splitlines()[-2:]
    assert error.startswith("grader: error: ")
    assert re.fullmatch(rf"  hint: pipx inject ros-lab-grader .*'{PACKAGES[extra]}[>=].*", hint)
