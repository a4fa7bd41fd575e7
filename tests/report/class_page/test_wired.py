"""`grader batch` and `grader regrade` write the page, and its links lead to reports that are there."""

from __future__ import annotations

import html
import shlex

import pytest

from grader.cli.main import run
from tests.classes.batch.a_class import CORRECT, ROOT, RUBRIC, WRONG_NAME, batch, handed_in, roster_of
from tests.report.class_page.test_page import data_of


@pytest.mark.full
def test_a_batch_writes_the_page_beside_the_gradebook(tmp_path, capsys) -> None:
    handed_in(tmp_path, ["bob"], WRONG_NAME)
    rows = [f"ada,{CORRECT},Ada", "b b,bob,Bob", f"zoe,{tmp_path}/nowhere/at/all,Zoe"]
    roster, out = roster_of(tmp_path, rows, "id,source,name"), tmp_path / "out"
    batch(roster, out, "--allow-local", str(ROOT))
    data = data_of(out / "index.html")
    assert [(row[0], row[1], row[4]) for row in data["rows"]] == [
        ("ada", "Ada", "graded"),
        ("b b", "Bob", "graded"),
        ("zoe", "Zoe", "error"),
    ]
    links = [f"{row[0]}/report.html" if row[3] == 1 else row[3] for row in data["rows"]]
    assert links[1] == "b-b/report.html"
    assert all((out / link).is_file() for link in links[:2])
    assert str(out / "index.html") in capsys.readouterr().out
    page = (out / "index.html").read_text(encoding="utf-8")
    asked = ["--rubric", str(RUBRIC), "--out", str(out), "--allow-local", str(ROOT), "--only", "failed"]
    command = shlex.join(["grader", "batch", str(roster), *asked])
    assert html.escape(command) in page
    assert "This batch" not in page


@pytest.mark.full
def test_a_regrade_writes_it_again(tmp_path) -> None:
    out = tmp_path / "out"
    batch(roster_of(tmp_path, [f"ada,{CORRECT}"]), out, "--allow-local", str(ROOT))
    before = data_of(out / "index.html")
    (out / "index.html").write_text("old")
    assert run(["regrade", str(out), "--rubric", str(RUBRIC)]) == 0
    assert data_of(out / "index.html")["rows"][0][:7] == before["rows"][0][:7]
