"""Many recorded submissions judged again: each as if it were alone, whatever is wrong with another."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from grader.classes.batch.renew_results import judge_all, submissions_in
from grader.cli.main import run
from grader.errors import EvidenceError
from grader.evidence.reader import load_evidence
from grader.judging import judge
from grader.rubric.load import load_rubric
from tests.rubric.samples import spoiled

RECORDINGS = Path(__file__).parent.parent.parent / "data" / "recordings"
LAB = "leeds-comp3631-lab1"
OWN = '''\
import os

from grader.checks import Evidence, check, passed


@check("ends-the-process")
def ends_the_process(evidence: Evidence):
    """It ends the process that judges a talker which dies."""
    if any(event.exit_code == 1 for _, event in evidence["wraps"].processes):
        os._exit(9)
    return passed("alive")
'''


def handed_in(folder: Path, name: str, recording: str = "correct") -> Path:
    """The results of one submission, with a kept recording as its evidence."""
    (folder / name).mkdir(parents=True)
    (folder / name / "result.json").write_text("{}")
    shutil.copytree(RECORDINGS / recording, folder / name / "evidence")
    return folder / name


@pytest.mark.full
def test_every_submission_of_a_folder_is_judged_as_it_is_alone(tmp_path, capsys) -> None:
    handed_in(tmp_path / "results", "bob", "dies-at-128")
    handed_in(tmp_path / "results", "ada")
    (tmp_path / "results" / ".grader-new" / "evidence").mkdir(parents=True)
    assert run(["judge", str(tmp_path / "results"), "--rubric", LAB, "--jobs", "2"]) == 1
    ada, bob = json.loads(capsys.readouterr().out)
    assert (ada["submission"], ada["status"], ada["points"]) == ("ada", "graded", 100.0)
    assert (bob["submission"], bob["points"], bob["max_points"]) == ("bob", 85.0, 100.0)
    assert run(["judge", str(tmp_path / "results" / "bob"), "--rubric", LAB]) == 1
    assert json.loads(capsys.readouterr().out) == bob["criteria"]


def test_what_is_wrong_with_one_is_told_and_stops_no_other(tmp_path, capsys) -> None:
    broken = handed_in(tmp_path, "broken") / "evidence" / "talker.mcap"
    broken.write_bytes(broken.read_bytes()[:5000])
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "result.json").write_text("{}")
    handed_in(tmp_path, "sound")
    out = tmp_path / "judged.json"
    assert run(["judge", str(tmp_path), "--rubric", LAB, "--jobs", "1", "--out", str(out)]) == 3
    judged = {one["submission"]: one for one in json.loads(out.read_text())}
    assert list(judged) == ["broken", "empty", "sound"]
    assert "cut short" in judged["broken"]["error"]
    assert judged["empty"]["status"] == "error"
    assert judged["sound"]["points"] == 100.0
    told = capsys.readouterr().err
    assert f"grader: error: {broken}: cut short" in told
    assert f"{tmp_path / 'empty'}: no evidence" in told


@pytest.mark.full
def test_one_that_ends_the_process_stops_no_other(tmp_path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    changes = [
        ("package: lab1\n", "package: lab1\nchecks: own.py\n"),
        ("  real:\n", "  wraps:\n"),
        *[
            (
                "    check: rate\n    with: {topic: /chatter, rate_hz: 10}\n    scenario: real\n",
                "    check: x\n",
            )
        ],
        ("check: x\n", "check: ends-the-process\n    scenario: wraps\n"),
        ("scenario: real\n    requires", "scenario: wraps\n    requires"),
    ]
    rubric = load_rubric(str(spoiled(tmp_path, *changes)))
    folders = [
        handed_in(tmp_path / "in", name, recording)
        for name, recording in (("a", "correct"), ("b", "dies-at-128"), ("c", "correct"), ("d", "correct"))
    ]
    judged = {one.folder.name: one for one in judge_all(folders, rubric, 2)}
    assert judged.keys() == {"a", "b", "c", "d"}
    assert {name for name, one in judged.items() if one.criteria is None} == {"b"}
    assert "ended the process" in judged["b"].error
    alone = judge(rubric.rubric, load_evidence([folders[0]]), rubric.checks)
    assert judged["a"].criteria == judged["c"].criteria == judged["d"].criteria == alone


def test_which_folders_stand_for_several_submissions(tmp_path) -> None:
    ada, bob = handed_in(tmp_path / "in", "ada"), handed_in(tmp_path / "in", "bob")
    assert submissions_in([tmp_path / "in"]) == (ada, bob)
    assert submissions_in([bob, ada]) == (bob, ada)
    assert submissions_in([ada / "evidence", bob]) == (ada / "evidence", bob)
    assert submissions_in([ada]) == ()
    assert submissions_in([ada / "evidence" / "talker.mcap", ada / "evidence" / "wraps.mcap"]) == ()
    assert submissions_in([tmp_path / "nowhere"]) == ()


def test_folders_of_recordings_are_one_submission_as_ever(tmp_path) -> None:
    for name in ("talker", "wraps"):
        (tmp_path / name).mkdir()
        shutil.copyfile(RECORDINGS / "correct" / f"{name}.mcap", tmp_path / name / f"{name}.mcap")
    assert submissions_in([tmp_path / "talker", tmp_path / "wraps"]) == ()


def test_something_else_among_submissions_is_refused(tmp_path) -> None:
    ada, bob = handed_in(tmp_path / "in", "ada"), handed_in(tmp_path / "in", "bob")
    with pytest.raises(EvidenceError, match=r"talker\.mcap: not the folder of a submission"):
        submissions_in([ada, bob, ada / "evidence" / "talker.mcap"])
