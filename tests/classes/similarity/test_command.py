"""`grader similar` as an instructor sees it."""

from __future__ import annotations

import csv
import json
import re
from datetime import datetime, timezone
from pathlib import Path

import pytest

from grader.cli.class_actions import starter_of
from grader.cli.main import run as grader
from grader.model.batch import BatchRun, Entry, Similarity
from grader.model.result import RubricInfo
from tests.classes.similarity.classes import class_of, renamed, solution
from tests.rubric.samples import spoiled

COPY = renamed(solution("timed")).encode()
SUBMISSIONS = {
    "ann": {"src/square.py": solution("timed").encode()},
    "ben": {"src/drive.py": COPY},
    "=cmd|'x'!A1": {"src/\x1b[31mred\n.py": solution("timed").encode()},
    "dan": {"src/laser.py": solution("laser").encode()},
}


@pytest.fixture
def class_folder(tmp_path) -> Path:
    class_of(tmp_path / "results", SUBMISSIONS)
    return tmp_path / "results"


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.full
def test_copies_are_shown_and_written_and_results_stay_as_they_were(class_folder, capsys) -> None:
    before = files_of(class_folder)
    assert grader(["similar", str(class_folder)]) == 0
    shown = capsys.readouterr().out
    assert "4 submissions compared, 3 pairs are nearly the same." in shown
    assert "no mark depends on it" in shown
    assert all(len(row) <= 80 for row in shown.splitlines())
    assert "\x1b[31m" not in shown
    after = files_of(class_folder)
    assert {path.name for path in after.keys() - before.keys()} == {"similarity.json", "similarity.csv"}
    assert {path: after[path] for path in before} == before


@pytest.mark.full
def test_what_is_written_reads_back(class_folder) -> None:
    grader(["similar", str(class_folder)])
    data = json.loads((class_folder / "similarity.json").read_text(encoding="utf-8"))
    assert data["schema"] == "grader.similarity/1"
    assert data["library"] == "copydetect"
    similarity = Similarity.model_validate(data, strict=False)
    assert ("ann", "ben") in {(pair.a, pair.b) for pair in similarity.pairs}
    text = (class_folder / "similarity.csv").read_text(encoding="utf-8-sig")
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == len(similarity.pairs)
    assert not any(re.match(r"[=+@-]", cell) for row in rows for cell in row.values())


@pytest.mark.full
def test_json_is_what_is_written(class_folder, capsys) -> None:
    assert grader(["similar", str(class_folder), "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown == json.loads((class_folder / "similarity.json").read_text(encoding="utf-8"))


@pytest.mark.full
def test_no_pairs_is_success_too(tmp_path, capsys) -> None:
    class_of(tmp_path, {"ann": SUBMISSIONS["ann"], "dan": SUBMISSIONS["dan"]})
    assert grader(["similar", str(tmp_path)]) == 0
    assert "no pairs are nearly the same" in capsys.readouterr().out


@pytest.mark.full
def test_names_and_groups_come_from_the_batch(tmp_path, capsys) -> None:
    ids = ("ann", "ben", "dan")
    class_of(tmp_path, {name: SUBMISSIONS[name] for name in ids} | {"eve": SUBMISSIONS["ann"]})
    write_run(
        tmp_path, ("ann", "Ann Ax", "red"), ("ben", "Ben By", "red"), ("dan", "", ""), ("eve", "Eve Ek", "")
    )
    assert grader(["similar", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "2 pairs are nearly the same" in shown
    assert "Ann Ax" in shown
    assert "1 pair within a group is not listed." in shown


@pytest.mark.full
def test_a_submission_of_the_roster_without_evidence_is_named(tmp_path, capsys) -> None:
    class_of(tmp_path, {"ann": SUBMISSIONS["ann"]})
    write_run(tmp_path, ("ann", "", ""), ("ben", "", ""))
    assert grader(["similar", str(tmp_path)]) == 0
    assert "Not compared: ben: there is no evidence of it here" in capsys.readouterr().out


@pytest.mark.parametrize("threshold", ["0", "101", "nan", "much", "-5"])
def test_a_threshold_that_is_none_is_refused(class_folder, capsys, threshold) -> None:
    assert grader(["similar", str(class_folder), f"--threshold={threshold}"]) == 2
    assert "percentage" in capsys.readouterr().err


@pytest.mark.parametrize("folder", ["empty", "missing"])
def test_a_folder_without_submissions_is_refused(tmp_path, capsys, folder) -> None:
    (tmp_path / "empty").mkdir()
    assert grader(["similar", str(tmp_path / folder)]) == 2
    assert "grader batch" in capsys.readouterr().err


def test_starter_code_that_is_no_archive_is_refused(class_folder, tmp_path, capsys) -> None:
    (tmp_path / "handout.zip").write_bytes(b"PK\3\4 and no more")
    assert grader(["similar", str(class_folder), "--starter", str(tmp_path / "handout.zip")]) == 2
    assert "--starter handout.zip" in capsys.readouterr().err


@pytest.mark.full
def test_starter_code_without_a_program_is_said(class_folder, tmp_path, capsys) -> None:
    (tmp_path / "handout").mkdir()
    assert grader(["similar", str(class_folder), "--starter", str(tmp_path / "handout")]) == 0
    assert "starter code: holds no program" in capsys.readouterr().out


def test_starter_code_that_is_not_there_is_refused(class_folder, capsys) -> None:
    assert grader(["similar", str(class_folder), "--starter", "no/such"]) == 2
    assert "no/such: not found" in capsys.readouterr().err


def test_without_the_extra_it_says_what_to_install(class_folder, capsys, monkeypatch) -> None:
    monkeypatch.setattr("grader.installable.find_spec", lambda _name: None)
    assert grader(["similar", str(class_folder)]) == 2
    assert "-m pip install 'copydetect>=" in capsys.readouterr().err
    assert not (class_folder / "similarity.json").exists()


def test_the_starter_of_the_batchs_rubric_is_no_ones_own(class_folder, tmp_path) -> None:
    rubric = spoiled(tmp_path, ("package: lab1\n", "package: lab1\nstarter: handed_out\n"))
    write_run(class_folder, ("ann", "Ann", ""), rubric=str(rubric))
    assert starter_of(class_folder) == []  # its folder is gone, and the rubric is faulty without it
    (tmp_path / "handed_out").mkdir()
    (tmp_path / "handed_out" / "timed.py").write_text(solution("timed"), encoding="utf-8")
    assert starter_of(class_folder) == [tmp_path / "handed_out"]
    assert starter_of(tmp_path) == []


def write_run(folder: Path, *students: tuple[str, str, str], rubric: str = "lab") -> None:
    run = BatchRun(
        state="complete",
        grader="0",
        rubric=RubricInfo(id="lab", version="1", digest="0"),
        rubric_source=rubric,
        title="Lab",
        max_points=1.0,
        criteria=(),
        roster="roster.csv",
        started_at=datetime.now(timezone.utc),
        entries=tuple(Entry(id=i, source=".", name=name, group=group) for i, name, group in students),
    )
    (folder / "run.json").write_text(run.model_dump_json(by_alias=True), encoding="utf-8")
