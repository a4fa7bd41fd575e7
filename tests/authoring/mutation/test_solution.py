"""The correct package of a lab: where it is, its files as one tree, and edits of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from grader.authoring.mutation import solution as tree_module
from grader.authoring.mutation.faulty_packages import mutants_file
from grader.authoring.mutation.solution import (
    Reference,
    TreeFile,
    find_reference,
    load_solution,
    read_tree,
    reference_at,
    unified_diff,
    write_tree,
)
from grader.authoring.mutation.source_edits import TextEdit, apply_edits
from grader.errors import UsageError
from grader.rubric.load import load_rubric
from tests.authoring.mutation.samples import LABS, ROOT
from tests.rubric.samples import spoiled

LAB = LABS[0]


@pytest.mark.parametrize("lab", LABS)
def test_what_comes_with_the_grader(lab):
    loaded = load_rubric(lab)
    assert mutants_file(loaded) == ROOT / "fixtures" / f"{lab}.yaml"
    assert find_reference(loaded).folder == ROOT / "reference_solutions" / lab
    assert load_solution(find_reference(loaded), loaded.rubric.package).scripts


@pytest.mark.parametrize("lab", LABS)
def test_shebangs_tell_the_modes_where_a_wheel_lost_them(lab):
    folder = ROOT / "reference_solutions" / lab
    assert read_tree(folder, modes=False) == read_tree(folder, modes=True)


def test_an_installed_grader_does_not_trust_its_modes(tmp_path, monkeypatch):
    data = tmp_path / "grader" / "_data"
    shutil.copytree(ROOT / "rubrics", data / "rubrics")
    shutil.copytree(ROOT / "reference_solutions", data / "reference_solutions")
    for path in data.rglob("*.py"):
        path.chmod(0o644)
    monkeypatch.setattr("grader.authoring.mutation.solution.rubrics_folder", lambda: data / "rubrics")
    loaded = load_rubric(str(data / "rubrics" / f"{LAB}.yaml"))
    reference = find_reference(loaded)
    assert reference.folder == data / "reference_solutions" / LAB
    solution = load_solution(reference, loaded.rubric.package)
    assert all(solution.entry(path).executable for path in solution.programs)


def test_a_copy_of_a_labs_rubric_is_tested_with_the_labs_own_files(tmp_path):
    copy = tmp_path / "mine.yaml"
    shutil.copy(ROOT / "rubrics" / f"{LAB}.yaml", copy)
    loaded = load_rubric(str(copy))
    assert mutants_file(loaded) == ROOT / "fixtures" / f"{LAB}.yaml"
    assert find_reference(loaded).folder == ROOT / "reference_solutions" / LAB


def test_what_lies_beside_a_rubric_comes_first(tmp_path):
    (tmp_path / "rubrics" / "mutants").mkdir(parents=True)
    path = spoiled(tmp_path / "rubrics")
    (tmp_path / "rubrics" / "mutants" / "sample.yaml").touch()
    (tmp_path / "reference_solutions" / "sample").mkdir(parents=True)
    loaded = load_rubric(str(path))
    assert mutants_file(loaded) == tmp_path / "rubrics" / "mutants" / "sample.yaml"
    assert find_reference(loaded) == Reference(folder=tmp_path / "reference_solutions" / "sample")


def test_nothing_is_there(tmp_path):
    loaded = load_rubric(str(spoiled(tmp_path)))
    assert mutants_file(loaded) is None
    with pytest.raises(UsageError, match="no reference solution for sample"):
        find_reference(loaded)
    with pytest.raises(UsageError, match="not a folder"):
        reference_at(tmp_path / "nowhere")


def test_the_package_is_found_wherever_it_is(tmp_path):
    for folder, name in (
        ("other", "other"),
        ("a b/ws/src/lab1", "lab1"),
        ("a b/ws/src/lab1/vendor/x", "lab1"),
    ):
        manifest = tmp_path / folder / "package.xml"
        manifest.parent.mkdir(parents=True)
        manifest.write_text(f"<package><export><name>x</name></export><name>\n{name} </name></package>")
    (tmp_path / "package.xml").write_text("<package")
    solution = load_solution(Reference(folder=tmp_path), "Lab1")
    assert solution.folder == "a b/ws/src/lab1/"
    with pytest.raises(UsageError, match="no package lab2 in"):
        load_solution(Reference(folder=Path(tmp_path)), "lab2")


def test_what_is_written_is_read_back(tmp_path):
    tree = {
        "a/ü b.py": TreeFile(data=b"#!/bin/sh\r\n", executable=True),
        "link": TreeFile(data=b"", link="nowhere/at/all"),
        "bytes": TreeFile(data=bytes(range(256))),
    }
    write_tree(tree, tmp_path / "x")
    assert read_tree(tmp_path / "x") == tree


def test_writing_takes_the_place_of_what_was_there(tmp_path):
    write_tree({"old": TreeFile(data=b"1")}, tmp_path / "x")
    write_tree({"new": TreeFile(data=b"2")}, tmp_path / "x")
    assert sorted(p.name for p in (tmp_path / "x").iterdir()) == ["new"]


def test_without_modes_what_has_a_shebang_is_executable(tmp_path):
    (tmp_path / "a.py").write_text("#!/usr/bin/env python\n")
    (tmp_path / "b.py").write_text("x = 1\n")
    (tmp_path / "b.py").chmod(0o755)
    assert {n: e.executable for n, e in read_tree(tmp_path, modes=False).items()} == {
        "a.py": True,
        "b.py": False,
    }


def test_what_git_and_python_leave_is_left_out(tmp_path):
    for name in (".git/HEAD", "src/__pycache__/a.pyc", "src/a.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert list(read_tree(tmp_path)) == ["src/a.py"]


def test_a_folder_that_is_no_package_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(tree_module, "MAX_FILES", 2)
    for name in "abc":
        (tmp_path / name).touch()
    with pytest.raises(UsageError, match="more than a package"):
        read_tree(tmp_path)


def test_a_diff_says_what_cannot_be_seen():
    before = {
        "mode": TreeFile(data=b"x\n", executable=True),
        "gone": TreeFile(data=b"1\n"),
        "ends": TreeFile(data=b"a\nb"),
        "same": TreeFile(data=b"same"),
    }
    after = {
        "mode": TreeFile(data=b"x\n"),
        "new": TreeFile(data=b"2\n"),
        "ends": TreeFile(data=b"\xef\xbb\xbfa\r\nb"),
        "same": TreeFile(data=b"same"),
    }
    text = unified_diff(before, after)
    assert "old mode 100755\nnew mode 100644\n" in text
    assert "deleted file\n--- a/gone\n+++ /dev/null\n" in text
    assert "new file\n--- /dev/null\n+++ b/new\n" in text
    assert "-a\n+<BOM>a^M\n b\n" in text
    assert "same" not in text


def test_edits_are_made_from_their_places():
    assert apply_edits("abcdef", [TextEdit(4, 5, "E"), TextEdit(1, 3, ""), TextEdit(1, 1, "+")]) == "a+dEf"
    with pytest.raises(ValueError, match="overlap"):
        apply_edits("abcdef", [TextEdit(0, 3, ""), TextEdit(2, 4, "")])
