from __future__ import annotations

import pytest

from grader.authoring.mutation import solution as tree_module
from grader.authoring.mutation.solution import TreeFile, read_tree, unified_diff, write_tree
from grader.authoring.mutation.source_edits import TextEdit, apply_edits
from grader.errors import UsageError


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
