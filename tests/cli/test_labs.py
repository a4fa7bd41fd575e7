"""`grader example` and `grader rubric copy`: something to try things with, wherever the grader came from."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.authoring.mutation.solution import read_tree, references_folder
from grader.cli.main import run
from grader.rubric.find import rubric_ids, rubrics_folder

LAB = "leeds-comp3631-lab1"


@pytest.mark.parametrize("lab", rubric_ids())
def test_every_lab_has_its_correct_package(lab: str, tmp_path: Path) -> None:
    assert run(["example", lab, str(tmp_path / "mine")]) == 0
    assert read_tree(tmp_path / "mine") == read_tree(references_folder() / lab)


def test_a_mistake_is_the_only_difference(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["example", LAB, str(tmp_path / "mine"), "--mistake", "reset-to-one"]) == 0
    assert "with a mistake: After 127" in capsys.readouterr().out
    before, after = read_tree(references_folder() / LAB), read_tree(tmp_path / "mine")
    assert [name for name in before if before[name] != after[name]] == ["lab1/src/numeric_talker.py"]


def test_without_a_folder_the_mistakes_are_listed_with_what_they_cost(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(["example", LAB]) == 0
    rows = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert ["counter-resets-to-1", "counter-wrap"] in rows
    assert len(rows) > 30
    assert all(len(row) == 2 for row in rows)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["example", LAB, "used"], "used is in use"),
        (["example", LAB, "file"], "file is in use"),
        (["example", LAB, "new", "--mistake", "reset-to-on"], 'there is no mistake "reset-to-on"'),
        (["example", LAB, "new", "--mistake", "bit-removed"], "bit-removed can be made in 2 ways"),
        (["example", LAB, "--mistake", "reset-to-one"], "--mistake needs a folder"),
        (["example", "leeds", "new"], 'there is no rubric "leeds" (did you mean "leeds-comp3631-lab1"?)'),
        (["rubric", "copy", LAB, "--out", "file"], "file exists"),
        (["rubric", "copy", "leeds"], 'there is no rubric "leeds"'),
    ],
    ids=["used", "file", "unknown", "several", "no-folder", "lab", "exists", "no-rubric"],
)
def test_nothing_is_overwritten_or_guessed(
    words: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "used").mkdir()
    (tmp_path / "used" / "work").write_text("a student's", encoding="utf-8")
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert run(words) == 2
    assert message in capsys.readouterr().err
    assert (tmp_path / "used" / "work").read_text(encoding="utf-8") == "a student's"
    assert not (tmp_path / "new").exists()


def test_the_copy_of_a_rubric_is_the_rubric(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.yaml"
    assert run(["rubric", "copy", LAB, "--out", str(mine)]) == 0
    assert run(["rubric", "validate", str(mine)]) == 0
    assert mine.read_bytes() == (rubrics_folder() / f"{LAB}.yaml").read_bytes()
    capsys.readouterr()
    assert run(["rubric", "copy", LAB]) == 0
    assert capsys.readouterr().out == mine.read_text(encoding="utf-8")
