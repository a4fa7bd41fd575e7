"""`grader grade` as a user runs it: what it writes, and what is left when it is stopped."""

from __future__ import annotations

import json
import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.checks.support.clocks import CALIBRATION
from grader.evidence.reader import load_evidence
from tests.arena.support import SCRIPT
from tests.support.grader_process import ROOT, Grader

pytestmark = pytest.mark.ros

LAB = "leeds-comp3631-lab1"
SOLUTION = ROOT / "reference_solutions" / LAB
KEYS = [
    "schema", "submission", "rubric", "rubric_origin", "status", "points", "max_points", "criteria", "environment",
    "timing",
]  # fmt: skip
CRITERION_KEYS = [
    "id", "title", "check", "scenario", "status", "points", "max_points", "message", "expected", "measured",
    "hint", "reproduce", "citations",
]  # fmt: skip


@pytest.fixture
def grader() -> Iterator[Grader]:
    grader = Grader()
    yield grader
    grader.end()


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Grader]]:
    folder = tmp_path_factory.mktemp("graded")
    grader = Grader()
    code, out, err = grader.run("grade", SOLUTION, "--rubric", LAB, "--out", folder / "out", "--id", "sc20ab")
    assert code == 0, out + err
    yield folder / "out" / "sc20ab", grader
    grader.end()


def test_result_has_the_keys_that_others_read(graded: tuple[Path, Grader]) -> None:
    result = json.loads((graded[0] / "result.json").read_text())
    assert list(result) == KEYS
    assert (result["schema"], result["status"], result["points"]) == ("grader.result/1", "graded", 100)
    assert list(result["submission"]) == ["id", "source", "commit", "digest", "package"]
    assert result["submission"]["id"] == "sc20ab"
    assert list(result["rubric"]) == ["id", "version", "digest"]
    assert list(result["environment"]) == ["grader", "ros", "python", "sandbox"]
    assert list(result["timing"]) == ["wall_s", "cpu_s", "student_cpu_s"]
    for criterion in result["criteria"]:
        assert list(criterion) == CRITERION_KEYS


def test_judging_again_gives_the_same_bytes(graded: tuple[Path, Grader], tmp_path: Path) -> None:
    folder, grader = graded
    code, out, _ = grader.run("judge", folder / "evidence", "--rubric", LAB, GRADER_ROS_SETUP="none")
    assert code == 0
    again = json.loads(out)
    result = json.loads((folder / "result.json").read_text())
    as_text = {"ensure_ascii": False, "indent": 2}
    assert json.dumps(again, **as_text) == json.dumps(result["criteria"], **as_text)
    single = grader.run("judge", *sorted((folder / "evidence").iterdir()), "--rubric", LAB)[1]
    assert single == out


def test_the_machine_is_calibrated_where_a_rate_is_judged(graded: tuple[Path, Grader]) -> None:
    runs = load_evidence([graded[0] / "evidence"])
    calibrated = {name for name, run in runs.items() if any(c.topic == CALIBRATION for c in run.channels)}
    assert calibrated == {"talker"}
    assert all(run.host for name, run in runs.items() if name != "package")


def test_all_reports_and_evidence_are_there(graded: tuple[Path, Grader]) -> None:
    folder, grader = graded
    assert {p.name for p in folder.iterdir()} == {
        "result.json", "report.html", "report.md", "junit.xml", "console.log", "evidence"
    }  # fmt: skip
    names = {p.name for p in (folder / "evidence").iterdir()}
    assert names == {"package.mcap", "talker.mcap", "wraps.mcap", "listener.mcap", "launch.mcap"}
    assert "I heard" in (folder / "console.log").read_text()
    assert grader.await_none(2) == []
    assert list(grader.temporary.iterdir()) == []


@pytest.mark.full
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seen", ["catkin_make", "talker", "wraps  done", "launch"])
def test_stopping_leaves_nothing(grader: Grader, tmp_path: Path, seen: str, number: int) -> None:
    out = tmp_path / "out"
    process = grader.start("grade", SOLUTION, "--rubric", LAB, "--out", out)
    assert process.stderr is not None
    for line in process.stderr:
        if seen in line:
            break
    process.send_signal(number)
    _, err = process.communicate()  # a second on a quiet machine
    assert process.returncode == 130
    assert err.splitlines()[-1] == "grader: interrupted"
    assert grader.await_none(1) == []
    assert not out.exists()
    assert list(grader.temporary.iterdir()) == []


@pytest.mark.full
def test_killing_leaves_no_process_and_no_half_result(grader: Grader, tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = grader.start("grade", SOLUTION, "--rubric", LAB, "--out", out)
    assert process.stderr is not None
    for line in process.stderr:
        if "observing" in line or "wraps  done" in line:
            break
    assert grader.processes()
    process.kill()
    process.communicate()
    assert grader.await_none(2) == []
    assert not list(out.rglob("result.json"))
    code, _, err = grader.run("grade", SOLUTION, "--rubric", LAB, "--out", out)
    assert code == 0, err


def test_interrupted_grading_keeps_the_older_result(grader: Grader, tmp_path: Path) -> None:
    source = tmp_path / "empty-lab"
    (source / "src").mkdir(parents=True)
    (source / "package.xml").write_text("<package>broken")
    (source / "src" / "numeric_talker.py").write_text(SCRIPT)
    argv = ("grade", source, "--rubric", LAB, "--out", tmp_path / "out", "--id", "one")
    source.rename(tmp_path / "lab1")
    argv = (argv[0], tmp_path / "lab1", *argv[2:])
    assert grader.run(*argv)[0] == 1
    before = {p: p.read_bytes() for p in (tmp_path / "out").rglob("*") if p.is_file()}
    process = grader.start(*argv)
    assert process.stderr is not None
    for line in process.stderr:
        if "catkin_make" in line:
            break
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert {p: p.read_bytes() for p in (tmp_path / "out").rglob("*") if p.is_file()} == before


def test_without_ros_the_static_criteria_are_still_judged(grader: Grader, tmp_path: Path) -> None:
    code, out, _ = grader.run(
        "grade", SOLUTION, "--rubric", LAB, "--out", tmp_path / "out", GRADER_ROS_SETUP="none"
    )
    assert code == 4
    result = json.loads(next((tmp_path / "out").rglob("result.json")).read_text())
    statuses = {c["id"]: c["status"] for c in result["criteria"]}
    assert {i for i, s in statuses.items() if s == "pass"} == {
        "manifest", "cmake", "talker-executable", "listener-executable", "dependencies"
    }  # fmt: skip
    assert set(statuses.values()) == {"pass", "inconclusive"}
    assert "apt-get install python3-rospy" in out.replace("\n", " ").replace("          ", "")


@pytest.mark.full
def test_without_a_sandbox_the_lab_is_graded_all_the_same(grader: Grader, tmp_path: Path) -> None:
    code, out, err = grader.run(
        "grade", SOLUTION, "--rubric", LAB, "--out", tmp_path / "out", "--sandbox", "none"
    )
    assert code == 0, out + err
    result = json.loads(next((tmp_path / "out").rglob("result.json")).read_text())
    assert result["environment"]["sandbox"].startswith("none (--sandbox none)")
    assert grader.await_none(2) == []


@pytest.mark.full
@pytest.mark.skipif(os.geteuid() != 0, reason="only root becomes another user")
def test_root_with_a_closed_temporary_folder(grader: Grader, tmp_path: Path) -> None:
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o700)
    argv = ("grade", SOLUTION, "--rubric", LAB, "--out", tmp_path / "out")
    assert grader.run(*argv, TMPDIR=str(closed))[0] == 0


def test_a_repaired_copy_is_evidence_like_any_other(grader: Grader, tmp_path: Path) -> None:
    package = tmp_path / "misspelt"
    shutil.copytree(SOLUTION, package)
    talker = package / "lab1" / "src" / "numeric_talker.py"
    talker.write_text(talker.read_text().replace("numeric_chatter", "numeric_chater"))
    code, out, err = grader.run("grade", package, "--rubric", LAB, "--out", tmp_path / "out")
    assert code == 1, out + err
    folder = tmp_path / "out" / "misspelt"
    result = json.loads((folder / "result.json").read_text())
    lost = {c["id"]: c for c in result["criteria"] if c["status"] != "pass"}
    assert (result["points"], list(lost)) == (90, ["numeric-type"])
    assert lost["numeric-type"]["repaired"]["charged"] is True
    judged = [c["id"] for c in result["criteria"] if "repaired" in c and not c["repaired"]["charged"]]
    assert judged == ["numeric-rate", "counter-start", "counter-step", "counter-wrap"]
    copies = {path.name for path in (folder / "evidence" / "repaired-1").iterdir()}
    assert copies == {"package.mcap", "talker.mcap", "wraps.mcap"}
    assert "this costs you 10 points (numeric-type)" in (folder / "report.md").read_text()
    code, out, err = grader.run("judge", folder, "--rubric", LAB)
    assert code == 1, err
    assert json.loads(out) == result["criteria"]
