"""A class that an earlier grader graded: judged again, reported again, reviewed, gone on with."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pytest

from grader.classes.batch.folder import open_batch
from grader.classes.review.session import open_session
from grader.cli.main import run
from tests.report.file_formats.kept import FOLDER

POINTS = {"ada": 100.0, "bob": 65.7, "cyd": 85.0, "dan": 2.0}


@pytest.fixture
def course(tmp_path: Path, monkeypatch) -> Path:
    """A copy of the class's folder, with its rubric and roster beside it; commands are run there."""
    shutil.copytree(FOLDER, tmp_path / "course")
    monkeypatch.chdir(tmp_path / "course")
    return tmp_path / "course"


def points(out: Path) -> dict[str, float]:
    return {name: json.loads((out / name / "result.json").read_bytes())["points"] for name in POINTS}


@pytest.mark.full
def test_it_is_judged_again_to_the_same_points(course: Path, capsys) -> None:
    assert run(["regrade", "class", "--rubric", "class.yaml"]) == 3  # dan's cannot be graded
    assert points(course / "class") == POINTS
    with (course / "class" / "changes.csv").open(newline="") as file:
        assert len(list(csv.reader(file))) == 1, (
            "nothing but the heading: no criterion came to something else"
        )
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.full
def test_its_reports_and_its_page_are_written_again(course: Path) -> None:
    before = {path: path.read_bytes() for path in (course / "class").rglob("result.json")}
    assert run(["report", "class", "--rubric", "class.yaml"]) == 0
    assert {path: path.read_bytes() for path in before} == before
    page = (course / "class" / "index.html").read_text()
    assert all(name in page for name in ("Ada Lovelace", "Bob", "Cyd", "Dan"))
    assert all((course / "class" / name / "report.html").is_file() for name in POINTS)


def test_without_its_rubric_the_report_says_in_a_line_what_to_do(course: Path, capsys) -> None:
    """run.json says where the rubric was, which is not here."""
    assert run(["report", "class"]) == 2
    said = capsys.readouterr().err
    assert "class.yaml" in said
    assert "Traceback" not in said
    assert len(said.splitlines()) <= 2


def test_its_gradebook_is_written_again(course: Path) -> None:
    assert run(["gradebook", "class", "--form", "csv", "--out", "grades.csv"]) == 0
    with (course / "grades.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = {row["id"]: row for row in csv.DictReader(file)}
    graded = {name: points for name, points in POINTS.items() if rows[name]["status"] != "error"}
    assert {name: float(rows[name]["points"]) for name in graded} == graded
    assert {name for name in rows if rows[name]["points"] == ""} == {"dan", "eve"}, "could not be graded"
    assert rows["eve"]["status"] == "error"


def test_it_is_reviewed(course: Path) -> None:
    run_json = course / "class" / "run.json"
    said = json.loads(run_json.read_text())
    run_json.write_text(json.dumps(said | {"rubric_source": str(course / "class.yaml")}))
    review = open_session(course / "class")
    found = {item.key: review.result(item, review.overrides()) for item in review.submissions.items()}
    assert {name: found[name].points for name in POINTS} == POINTS


def test_it_is_gone_on_with(course: Path) -> None:
    """What is complete for the same files, rubric and grader is kept, whoever wrote it."""
    batch = open_batch(course / "class")
    assert {entry.id for entry in batch.run.entries} == set(POINTS)
    assert all(batch.earlier(entry) is not None for entry in batch.run.entries)
    assert batch.run.counts.graded == 3
