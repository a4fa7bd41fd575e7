"""Rubrics, evidence and results through the Python API: nothing is run."""

from __future__ import annotations

import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from mcap.writer import Writer

from grader import (
    EvidenceError,
    LoadedRubric,
    Rubric,
    RubricError,
    Status,
    UsageError,
    judge,
    load_result,
    load_rubric,
)

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "fixtures" / "formats"
LAB = "leeds-comp3631-lab1"


def test_a_rubric_by_its_id() -> None:
    lab = load_rubric(LAB)
    assert isinstance(lab, LoadedRubric)
    assert isinstance(lab.rubric, Rubric)
    assert (lab.rubric.id, lab.rubric.max_points, len(lab.digest)) == (LAB, 100.0, 64)


@pytest.mark.parametrize("kind", [str, Path])
def test_a_rubric_by_its_file(kind: type, tmp_path: Path, monkeypatch) -> None:
    shutil.copy(ROOT / "rubrics" / f"{LAB}.yaml", tmp_path / "mine.yaml")
    monkeypatch.chdir(tmp_path)
    assert load_rubric(kind("mine.yaml")).digest == load_rubric(LAB).digest
    assert load_rubric(kind(tmp_path / "mine.yaml")).rubric.id == LAB


def test_a_path_is_a_file_even_if_it_has_an_ids_name(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RubricError):
        load_rubric(Path(LAB))
    assert load_rubric(LAB).rubric.id == LAB


def test_a_rubric_that_there_is_not() -> None:
    with pytest.raises(RubricError) as caught:
        load_rubric("leeds-comp3631-lab")
    assert 'did you mean "leeds-comp3631-lab1"?' in caught.value.message
    assert caught.value.hint


def test_every_fault_of_a_rubric(tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text("schema: grader.rubric/1\nid: Lab\ntitle: 3\n")
    with pytest.raises(RubricError) as caught:
        load_rubric(tmp_path / "lab.yaml")
    assert len(caught.value.faults) >= 4
    assert all("lab.yaml:" in fault for fault in caught.value.faults)


@pytest.mark.parametrize("wrong", [None, 5, b"leeds", LoadedRubric])
def test_no_rubric_at_all(wrong: object) -> None:
    with pytest.raises(TypeError):
        load_rubric(wrong)


def test_evidence_is_judged_as_when_it_was_graded() -> None:
    then = load_result(KEPT / "parameters")
    now = judge(KEPT / "parameters", then.rubric.id)
    marks = [[(c.id, c.status, c.points, c.max_points) for c in r.criteria] for r in (now, then)]
    assert marks[0] == marks[1], "words may have become better since then, marks may not change"
    assert (now.status, now.points, now.max_points) == (then.status, then.points, then.max_points)
    assert (now.submission, now.notes) == (then.submission, then.notes)
    assert (now.rubric.id, now.rubric.version) == (then.rubric.id, then.rubric.version)
    assert (now.environment.ros, now.environment.sandbox) == (then.environment.ros, then.environment.sandbox)
    assert {c.status for c in now.criteria} >= {Status.PASS, Status.FAIL}


def test_every_way_to_name_evidence() -> None:
    folder, lab = KEPT / "files", load_rubric(LAB)
    one = judge(folder, lab)
    assert judge(str(folder), LAB) == one
    assert judge(folder / "evidence", lab) == one
    assert judge([folder / "evidence" / "package.mcap"], lab).submission == one.submission
    assert judge(sorted((folder / "evidence").glob("*.mcap")), lab) == one
    assert one.status == "inconclusive"


def test_what_was_not_recorded_costs_nobody_a_mark() -> None:
    found = judge(KEPT / "correct" / "evidence" / "package.mcap", LAB)
    assert {c.status for c in found.criteria} == {Status.PASS, Status.INCONCLUSIVE}


def test_another_tools_recording(tmp_path: Path) -> None:
    """It says nothing of whose it is; what needs more than messages is open."""
    path = tmp_path / "mine.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros1")
        schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
        channel = writer.register_channel("/chatter", "ros1", schema)
        writer.add_message(channel, 1, b"\x02\x00\x00\x00hi", 1)
        writer.finish()
    found = judge(path, LAB)
    assert (found.submission.id, found.submission.source, found.submission.commit) == (
        "mine",
        "mine.mcap",
        None,
    )
    assert found.environment.sandbox == "nothing was run"
    assert {c.id: c.status for c in found.criteria}["counter-wrap"] is Status.INCONCLUSIVE
    assert Status.FAIL not in {c.status for c in found.criteria}


@pytest.mark.parametrize("what", ["nothing", "empty", "text"])
def test_evidence_that_cannot_be_read(what: str, tmp_path: Path) -> None:
    if what == "empty":
        (tmp_path / what).mkdir()
    if what == "text":
        (tmp_path / what).write_text("no evidence")
    with pytest.raises(EvidenceError) as caught:
        judge(tmp_path / what, LAB)
    assert what in caught.value.message
    assert "\n" not in caught.value.message


def test_no_evidence_at_all() -> None:
    with pytest.raises(EvidenceError):
        judge([], LAB)


def test_a_result_by_its_folder_or_file() -> None:
    one = load_result(KEPT / "notes")
    assert load_result(str(KEPT / "notes" / "result.json")) == one
    assert one.notes[0].kind == "refused"
    with pytest.raises(EvidenceError):
        load_result(KEPT / "nobody")


def test_many_threads_judge_alike() -> None:
    lab = load_rubric(LAB)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: judge(KEPT / "notes", lab), range(4)))
    assert all(one == found[0] for one in found)


def test_an_instructors_own_checks_in_threads_leave_stdout_as_it_was(tmp_path: Path, capfd) -> None:
    (tmp_path / "own.py").write_text(OWN)
    text = (ROOT / "rubrics" / f"{LAB}.yaml").read_text()
    criterion = "  - {id: own, title: Own, points: 0, check: says-so}\n"
    (tmp_path / "lab.yaml").write_text(text.replace("digits: 1\n", "digits: 1\nchecks: own.py\n") + criterion)
    lab, out, err = load_rubric(tmp_path / "lab.yaml"), sys.stdout, sys.stderr
    with ThreadPoolExecutor(6) as pool:
        found = list(pool.map(lambda _: judge(KEPT / "files", lab).criteria[-1].status, range(12)))
    assert set(found) == {Status.PASS}
    assert (sys.stdout, sys.stderr) == (out, err)
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err == "said\n" * 12


OWN = '''
import time

from grader.checks import PackageFacts, Record, check, passed


class Nothing(Record):
    """No parameters."""


@check("says-so", params=Nothing)
def says_so(package: PackageFacts, params: Nothing):
    """Says so.

    What it checks
        Nothing.

    Why it matters on a robot
        It does not.

    How it is measured
        It is not.

    How to fix
        There is nothing to fix.
    """
    print("said")
    time.sleep(0.01)
    return passed("it does")
'''


def test_nothing_is_written(tmp_path: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(KEPT / "files", tmp_path / "files")
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    judge("files", LAB)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before
    assert capfd.readouterr() == ("", "")


def test_usage_is_an_error_of_the_tree() -> None:
    assert issubclass(RubricError, UsageError)
