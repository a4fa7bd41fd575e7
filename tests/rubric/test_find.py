"""Folders of the user's own labs: found by id and by package, and never in what was submitted."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from grader.cli.main import run
from grader.cli.select_rubric import choose_all
from grader.errors import UsageError
from grader.rubric.find import add_folder, config_file, known_labs, remove_folder, rubric_ids
from grader.rubric.load import find_rubric_for_package, load_rubric
from tests.rubric.samples import SOUND

PACKAGE = "rovers"


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.delenv("GRADER_RUBRICS", raising=False)
    return tmp_path


def lab(folder: Path, name: str = "rovers-1", package: str = PACKAGE) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.yaml"
    path.write_text(
        SOUND.replace("id: sample", f"id: {name}").replace("package: lab1", f"package: {package}")
    )
    return path


def own() -> list[str]:
    return [one.id for one in known_labs() if one.id not in rubric_ids()]


def test_a_folder_that_was_added_is_searched_until_it_is_removed(tmp_path: Path) -> None:
    path = lab(tmp_path / "labs")
    (tmp_path / "labs" / "fixtures.yaml").write_text("schema: grader.mutants/1\n")
    assert own() == []
    assert add_folder(tmp_path / "labs") == tmp_path / "labs"
    add_folder(tmp_path / "labs")
    assert config_file().read_text() == f"{tmp_path / 'labs'}\n"
    assert own() == ["rovers-1"]
    assert load_rubric("rovers-1").path == path
    assert find_rubric_for_package("Rovers") == "rovers-1"
    remove_folder(tmp_path / "labs")
    assert own() == []


def test_the_variable_lists_folders_with_labs_one_level_below(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab(tmp_path / "one" / "week1", "week-1", "first")
    lab(tmp_path / "two", "week-2", "second")
    monkeypatch.setenv("GRADER_RUBRICS", os.pathsep.join([str(tmp_path / "one"), str(tmp_path / "two")]))
    assert own() == ["week-1", "week-2"]


def test_a_path_that_depends_on_where_the_grader_starts_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRADER_RUBRICS", "labs")
    with pytest.raises(UsageError, match="not an absolute path"):
        known_labs()


def test_a_folder_without_a_rubric_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="has no rubric in it"):
        add_folder(tmp_path)
    with pytest.raises(UsageError, match="is a file"):
        add_folder(lab(tmp_path / "labs"))
    with pytest.raises(UsageError, match="is not there"):
        add_folder(tmp_path / "lab")
    with pytest.raises(UsageError, match="is not among your folders"):
        remove_folder(tmp_path)


def test_names_that_clash_are_told(tmp_path: Path) -> None:
    lab(tmp_path / "a")
    lab(tmp_path / "b")
    lab(tmp_path / "b", "rovers-2")
    for name in ("a", "b"):
        add_folder(tmp_path / name)
    with pytest.raises(UsageError, match=r"2 labs are called rovers-1: .*a/rovers-1.yaml, .*b/rovers-1.yaml"):
        load_rubric("rovers-1")
    with pytest.raises(UsageError, match="3 rubrics are for a package named rovers: "):
        find_rubric_for_package(PACKAGE)
    assert load_rubric("rovers-2").rubric.id == "rovers-2"


def test_check_finds_the_lab_by_the_package_and_never_a_rubric_inside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "student" / PACKAGE
    package.mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{PACKAGE}</name></package>")
    lab(package, "mine")
    monkeypatch.chdir(package)
    with pytest.raises(UsageError, match=f"no lab is for the package {PACKAGE}"):
        choose_all(package, None)
    lab(tmp_path / "labs")
    add_folder(tmp_path / "labs")
    (chosen,) = choose_all(package, None)
    assert chosen.rubric.rubric.id == "rovers-1"


def test_the_list_says_where_each_comes_from_and_which_is_faulty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lab(tmp_path / "labs")
    broken = lab(tmp_path / "labs", "broken", "other")
    broken.write_text(broken.read_text().replace("points: 40", "points: 30"))
    assert run(["labs", "--add", str(tmp_path / "labs")]) == 0
    capsys.readouterr()
    assert run(["labs"]) == 0
    shown = capsys.readouterr().out
    assert "rovers-1" in shown
    assert f"{broken} is faulty: grader rubric validate {broken}" in shown.replace("\n", "")
    assert run(["labs", "--json"]) == 0
    listed = {one["id"]: one["source"] for one in json.loads(capsys.readouterr().out)}
    assert listed["rovers-1"] == str(tmp_path / "labs")
    assert {listed[name] for name in rubric_ids()} == {"the grader"}
