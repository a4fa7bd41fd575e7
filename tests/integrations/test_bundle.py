"""What `grader export` writes for platforms: the same bytes each time, with all that grading there needs."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import shutil
import subprocess
import sys
import zipfile
from functools import cache
from pathlib import Path

import pytest

from grader.cli.main import run
from grader.integrations import platform_exports
from grader.integrations.platform_exports import wheel
from grader.rubric.find import rubrics_folder
from tests.rubric.own_checks.samples import GREETING, OWN, TESTS, write_rubric

LAB = "york-ele00118m-lab7"
packed = cache(wheel)
"""The wheel, which takes a quarter of a second to pack."""


@pytest.fixture(autouse=True)
def packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform_exports, "wheel", packed)


def exported(folder: Path, *arguments: str, lab: str = LAB) -> zipfile.ZipFile:
    out = folder / "out.zip"
    assert run(["export", "gradescope", lab, "--out", str(out), *arguments]) == 0
    return zipfile.ZipFile(out)


def test_the_same_lab_gives_the_same_bytes(tmp_path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        exported(tmp_path / name)
    assert (tmp_path / "a" / "out.zip").read_bytes() == (tmp_path / "b" / "out.zip").read_bytes()
    assert wheel() == packed()


def test_gradescope_finds_its_two_scripts_at_the_top_and_may_run_them(tmp_path) -> None:
    archive = exported(tmp_path, "--minutes", "20")
    for name in ("setup.sh", "run_autograder", "system.sh"):
        assert archive.getinfo(name).external_attr >> 16 == 0o100755
        assert archive.read(name).startswith(b"#!/usr/bin/env bash\n")
    assert b" 1170 " in archive.read("run_autograder")  # 20 minutes, but for the last half
    settings = json.loads(archive.read("grader.json"))
    given = {"rubric": f"rubric/{LAB}.yaml", "minutes": 20, "sandbox": "auto", "modes": "lost", "package": ""}
    assert settings == given


@pytest.mark.parametrize("script", ["gradescope-setup.sh", "run_autograder", "grade-question"])
def test_the_scripts_are_sound_bash(script) -> None:
    file = Path(__file__).parents[2] / "grader" / "integrations" / "files" / script
    assert subprocess.run(["/bin/bash", "-n", file], check=False).returncode == 0


def test_an_instructors_files_go_along(tmp_path) -> None:
    rubric = write_rubric(
        tmp_path / "lab", OWN + TESTS.replace("id: own", "id: tests").replace("100", "0"), checks=GREETING,
        tests="def test_it(run):\n    assert run\n",
    )  # fmt: skip
    (tmp_path / "lab" / "solution.py").touch()
    archive = exported(tmp_path, lab=str(rubric))
    inside = {name for name in archive.namelist() if name.startswith("rubric/")}
    assert inside == {"rubric/lab.yaml", "rubric/my_checks.py", "rubric/test_lab.py"}
    archive.extractall(tmp_path / "there")
    assert run(["rubric", "validate", str(tmp_path / "there" / "rubric" / "lab.yaml")]) == 0


def test_the_wheel_lists_what_is_in_it_and_holds_what_grading_needs() -> None:
    name, data = packed()
    assert name.startswith("ros_lab_grader-")
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = archive.namelist()
        (record,) = (path for path in names if path.endswith(".dist-info/RECORD"))
        rows = list(csv.reader(archive.read(record).decode().splitlines()))
        for path, digest, size in rows[:-1]:
            content = archive.read(path)
            known = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert (digest, size) == (f"sha256={known}", str(len(content)))
        assert sorted(row[0] for row in rows) == sorted(names)
        script = archive.getinfo(
            "grader/_data/reference_solutions/mcr2-basic-comms/basic_comms/scripts/talker.py"
        )
        assert script.external_attr >> 16 & 0o111
    needed = {
        f"grader/_data/rubrics/{LAB}.yaml",
        "grader/_data/setup.sh",
        "grader/arena/standins/turtlesim/package.xml",
    }
    assert needed <= set(names)
    assert not [path for path in names if "__pycache__" in path]


@pytest.mark.full
def test_the_wheel_is_installed_by_pip_and_exports_the_same_again(tmp_path) -> None:
    """From an installed wheel, too: what it packs is what was packed."""
    pytest.importorskip("pip", reason="no pip in this virtual environment")
    name, data = wheel()
    (tmp_path / name).write_bytes(data)
    target = tmp_path / "site"
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-compile", "--target", str(target)]
    subprocess.run([*pip, str(tmp_path / name)], check=True)
    ask = "import sys; from grader.integrations.platform_exports import wheel; sys.stdout.buffer.write(wheel()[1])"
    again = subprocess.run(
        [sys.executable, "-c", ask],
        env={"PYTHONPATH": str(target)},
        cwd=tmp_path,
        capture_output=True,
        check=True,
    )
    assert again.stdout == data


@pytest.mark.parametrize(
    "arguments",
    [
        ["gradescope", "no-such-lab"],
        ["gradescope", LAB, "--minutes", "41"],
        ["gradescope", LAB, "--minutes", "1"],
        ["gradescope", LAB, "--minutes", "ten"],
        ["prairielearn", LAB, "--minutes", "11"],
        ["gradescope"],
        ["elsewhere", LAB],
    ],
    ids="-".join,
)
def test_what_cannot_be_is_refused(arguments, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["export", *arguments]) == 2
    assert capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
def test_a_folder_takes_the_zip_under_its_own_name_and_stdout_takes_it_alone(tmp_path, capfdbinary) -> None:
    assert run(["export", "gradescope", LAB, "--out", str(tmp_path)]) == 0
    data = (tmp_path / f"{LAB}-gradescope.zip").read_bytes()
    capfdbinary.readouterr()
    assert run(["export", "gradescope", LAB, "--out", "-"]) == 0
    assert capfdbinary.readouterr().out == data


def test_prairielearn_gets_a_question_and_the_files_of_its_image(tmp_path) -> None:
    out = tmp_path / "out"
    assert run(["export", "prairielearn", LAB, "--out", str(out), "--image", "me/ros", "--minutes", "5"]) == 0
    info = json.loads((out / "question" / "info.json").read_text())
    assert info["externalGradingOptions"] == {
        "enabled": True,
        "image": "me/ros",
        "entrypoint": "/usr/local/bin/grade-question",
        "timeout": 300,
    }
    assert (info["type"], info["gradingMethod"]) == ("v3", "External")
    assert 'file-names="lab_exercises.zip"' in (out / "question" / "question.html").read_text()
    assert (out / "question" / "tests" / "rubric" / f"{LAB}.yaml").is_file()
    assert (out / "image" / "grade-question").stat().st_mode & 0o111
    assert {path.name for path in (out / "image").iterdir()} >= {"Dockerfile", "system.sh", wheel()[0]}


def test_what_a_lab_needs_besides_is_installed_in_the_containers(tmp_path) -> None:
    """The course's package goes along; the script is sound, and quotes what a rubric says."""
    needs = "needs: {ros: [rostest, tf2_ros], apt: [espeak], pip: [transforms3d]}"
    lab = rubrics_folder() / "examples" / "cpp-and-python.yaml"
    shutil.copytree(lab.parent / "distance_tests", tmp_path / "distance_tests")
    rubric = tmp_path / "lab.yaml"
    rubric.write_text(
        lab.read_text(encoding="utf-8").replace("needs: {ros: [rostest]}", needs), encoding="utf-8"
    )
    archive = exported(tmp_path, lab=str(rubric))
    script = archive.read("needs.sh").decode()
    assert "rubric/distance_tests/test/pair.test" in archive.namelist()
    assert "apt-get install -y --no-install-recommends espeak" in script
    assert " python3-tf2-ros " in script
    assert "python3 -m pip install --no-cache-dir transforms3d\n" in script
    assert subprocess.run(["/bin/bash", "-n"], input=script.encode(), check=False).returncode == 0
    out = tmp_path / "question"
    assert run(["export", "prairielearn", str(rubric), "--out", str(out), "--image", "me/ros"]) == 0
    assert (out / "image" / "needs.sh").read_text(encoding="utf-8") == script
    lines = (out / "image" / "Dockerfile").read_text(encoding="utf-8").splitlines()
    assert [line.split()[0] for line in lines[-4:]] == ["COPY", "COPY", "RUN", "ENTRYPOINT"]
    assert "needs.sh" not in exported(tmp_path).namelist()


@pytest.mark.full
def test_prairielearn_again_is_the_same_question_and_nobody_elses_folder_is_written_over(
    tmp_path, capsys
) -> None:
    out = tmp_path / "out"
    assert run(["export", "prairielearn", LAB, "--out", str(out)]) == 0
    first = (out / "question" / "info.json").read_bytes()
    assert run(["export", "prairielearn", LAB, "--out", str(out)]) == 0
    assert (out / "question" / "info.json").read_bytes() == first
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    assert run(["export", "prairielearn", LAB, "--out", str(tmp_path / "mine")]) == 2
    assert "contains other files" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.tex"]


def test_prairielearn_takes_a_zip_too(tmp_path) -> None:
    assert run(["export", "prairielearn", LAB, "--out", str(tmp_path / "q.ZIP")]) == 0
    with zipfile.ZipFile(tmp_path / "q.ZIP") as archive:
        assert "question/info.json" in archive.namelist()
