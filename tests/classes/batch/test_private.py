"""A class's marks are for who grades alone, whatever the umask."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest

from grader.cli.main import run
from tests.classes.batch.a_class import CORRECT, RUBRIC, WRONG_NAME, batch, handed_in, run_of

LOCKS = {".overrides.yaml.lock"}  # empty: who reads one learns nothing


@pytest.fixture(autouse=True)
def _no_umask() -> Iterator[None]:
    before = os.umask(0)
    try:
        yield
    finally:
        os.umask(before)


def _mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def _modes(folder: Path) -> tuple[set[int], set[int]]:
    """Of the folders and of the files."""
    found = [folder, *(path for path in folder.rglob("*") if path.name not in LOCKS)]
    return {_mode(p) for p in found if p.is_dir()}, {_mode(p) for p in found if p.is_file()}


@pytest.mark.full
def test_a_batch_and_all_that_is_written_later(tmp_path: Path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    handed_in(tmp_path / "in", ["cem"], WRONG_NAME)
    out = tmp_path / "deep" / "out"
    batch(tmp_path / "in", out)
    for command in (["regrade", str(out), "--jobs", "1"], ["report", str(out)]):
        run(command)
    for form in ("csv", "xlsx"):
        run(["gradebook", str(out), "--form", form])
    names = {path.name for path in out.rglob("*")}
    assert {"gradebook.csv", "results.jsonl", "index.html", "run.json", "changes.csv", "evidence"} <= names
    assert _modes(tmp_path / "deep") == ({0o700}, {0o600})


def test_a_single_grading(tmp_path: Path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    out = tmp_path / "out"
    run(["grade", str(tmp_path / "in" / "ada"), "--rubric", str(RUBRIC), "--out", str(out)])
    assert (next(out.iterdir()) / "result.json").is_file()
    assert _modes(out) == ({0o700}, {0o600})


@pytest.mark.full
def test_what_comes_of_a_comparison(tmp_path: Path) -> None:
    out = tmp_path / "out"
    batch(handed_in(tmp_path / "in", ["ada", "bob"]), out)
    before = set(out.iterdir())
    run(["similar", str(out)])
    assert set(out.iterdir()) - before
    assert _modes(out) == ({0o700}, {0o600})


@pytest.mark.full
def test_a_submission_that_cannot_be_graded(tmp_path: Path) -> None:
    (tmp_path / "in" / "ada").mkdir(parents=True)
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    assert (out / "ada" / "result.json").is_file()
    assert _modes(out) == ({0o700}, {0o600})


@pytest.mark.full
def test_a_folder_that_was_there_keeps_its_mode_and_what_is_in_it_is_private(tmp_path: Path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    out = tmp_path / "out"
    out.mkdir()
    out.chmod(0o2770)
    (out / "notes.txt").write_text("the instructor's own")
    for _ in range(2):
        batch(tmp_path / "in", out)
        assert _mode(out) == 0o2770
        assert _mode(out / "notes.txt") == 0o666
    assert run_of(out)["own_folder"] is False
    assert _mode(out / "gradebook.csv") == 0o600
    folders, files = _modes(out / "ada")
    assert {mode & 0o777 for mode in folders} == {0o700}
    assert files == {0o600}


@pytest.mark.full
def test_a_folder_that_a_batch_made_is_private_again(tmp_path: Path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    for path in (out, out / "gradebook.csv", out / "run.json", out / "results.jsonl", out / "index.html"):
        path.chmod(0o777)
    batch(tmp_path / "in", out)
    assert run_of(out)["own_folder"] is True
    assert _modes(out) == ({0o700}, {0o600})


@pytest.mark.full
def test_a_gradebook_at_a_path_that_was_named(tmp_path: Path) -> None:
    handed_in(tmp_path / "in", ["ada"])
    out = tmp_path / "out"
    batch(tmp_path / "in", out)
    there = tmp_path / "there.csv"
    there.write_text("an older one")
    for target in (there, tmp_path / "new" / "book.csv", tmp_path / "new" / "book.xlsx"):
        run(["gradebook", str(out), "--form", target.suffix[1:], "--out", str(target)])
        assert _mode(target) == 0o600
    assert _mode(tmp_path / "new") == 0o700


def test_reports_at_a_path_that_was_named(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(["grade", str(CORRECT), "--rubric", str(RUBRIC), "--out", str(out)])
    (folder,) = out.iterdir()
    for form in ("junit", "html"):
        told = ["--rubric", str(RUBRIC), "--form", form, "--out", str(tmp_path / form)]
        assert run(["report", str(folder), *told]) == 0
        assert _mode(tmp_path / form) == 0o600
