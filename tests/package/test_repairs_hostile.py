"""Repairs of hostile packages: links, pipes, huge files and sources that no parser likes."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from grader.package.repairs import NotRepairable, Repair, apply_repair, find_repairs
from grader.package.repairs.manifest import SLIPS_MAX
from tests.package.repairing import (
    CMAKELISTS,
    LAUNCHED,
    MANIFEST,
    SCRIPT,
    TALKER,
    WANTED,
    XML,
    package,
    repair_all,
    swapped,
)
from tests.package.trees import facts_of


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    folder = tmp_path / "outside"
    folder.mkdir()
    (folder / "secret.py").write_text(SCRIPT.replace("numeric_chatter", "numeric_chater"))
    (folder / "secret.py").chmod(0o644)
    return folder


def snapshot(folder: Path) -> dict[str, tuple[int, bytes]]:
    return {p.name: (p.stat().st_mode, p.read_bytes()) for p in folder.rglob("*") if p.is_file()}


def misspelt(file: str = "src/talker.py") -> Repair:
    line = "    publisher = rospy.Publisher('numeric_chater', Int8, queue_size=10)"
    after = line.replace("chater", "chatter")
    return Repair(kind="topic-name", file=file, line=7, before=line, after=after, message="x", fix="x")


def test_a_link_in_place_of_the_script_is_not_followed(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    (folder / "src" / "talker.py").symlink_to(outside / "secret.py")
    assert [r for r in find_repairs(folder, facts_of(folder), WANTED) if r.file == TALKER] == []
    bit = Repair(kind="executable-bit", file=TALKER, message="x", fix="x")
    for repair in (bit, misspelt()):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, repair)
    assert snapshot(outside) == before
    assert (folder / "src" / "talker.py").is_symlink()


def test_a_linked_folder_is_not_entered(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").symlink_to(outside)
    for file in ("src/secret.py", "../outside/secret.py", str(outside / "secret.py")):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, misspelt(file))
    assert snapshot(outside) == before


def test_windows_opens_nothing_relative_to_a_folder(tmp_path: Path, outside: Path, monkeypatch) -> None:
    monkeypatch.setattr("grader.package.repairs.editing.HAS_DIR_FD", False)
    before = snapshot(outside)
    changed = SCRIPT.replace("numeric_chatter", "numeric_chater")
    folder = package(tmp_path, {TALKER: None, "src/talkr.py": changed})
    assert [repair.kind for repair in repair_all(folder)] == ["file-name", "topic-name"]
    assert (folder / "src" / "talker.py").read_text() == SCRIPT
    (folder / "scripts").symlink_to(outside)
    with pytest.raises((OSError, NotRepairable)):
        apply_repair(folder, misspelt("scripts/secret.py"))
    assert snapshot(outside) == before


def test_a_script_with_a_name_elsewhere_changes_here_alone(tmp_path: Path, outside: Path) -> None:
    before = snapshot(outside)
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    os.link(outside / "secret.py", folder / "src" / "talker.py")
    assert [repair.kind for repair in repair_all(folder)] == ["executable-bit", "topic-name"]
    assert snapshot(outside) == before
    assert (folder / "src" / "talker.py").read_text() == SCRIPT


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    folder = package(tmp_path, {TALKER: None})
    (folder / "src").mkdir()
    os.mkfifo(folder / "src" / "talker.py")
    assert [r for r in find_repairs(folder, facts_of(folder), WANTED) if r.file == TALKER] == []
    for repair in (misspelt(), Repair(kind="executable-bit", file=TALKER, message="x", fix="x")):
        with pytest.raises((OSError, NotRepairable)):
            apply_repair(folder, repair)


def test_no_more_slips_of_a_name_are_corrected_than_a_student_makes(tmp_path: Path) -> None:
    many = "  <depend>rospi</depend>\n" * 1_000
    folder = package(tmp_path, {XML: MANIFEST.replace("</package>", f"{many}</package>")})
    found = [r for r in find_repairs(folder, facts_of(folder), WANTED) if r.file == XML]
    assert len(found) == SLIPS_MAX


def test_a_huge_file_is_left_as_it_is_but_for_its_bit(tmp_path: Path) -> None:
    folder = package(tmp_path)
    script = folder / "src" / "talker.py"
    with script.open("r+b") as file:
        file.truncate(100_000_000)
    script.chmod(0o644)
    assert [repair.kind for repair in repair_all(folder)] == ["executable-bit"]
    assert script.stat().st_size == 100_000_000
    with pytest.raises(NotRepairable):
        apply_repair(folder, misspelt())


def test_a_name_with_a_newline_is_a_name(tmp_path: Path) -> None:
    file = "src/a\nb/talker.py"
    folder = package(tmp_path, {TALKER: None, file: SCRIPT.replace("numeric_chatter", "numeric_chater")})
    (found,) = repair_all(folder)
    assert found.file == file
    assert (folder / file).read_text() == SCRIPT


INDENTS = "def f():\n" + "".join(" " * depth + "if 1:\n" for depth in range(1, 200))


@pytest.mark.parametrize(
    "source",
    [
        pytest.param("(" * 50_000, id="brackets", marks=pytest.mark.full),
        pytest.param("x = " + "-" * 60_000 + "1", id="signs"),
        pytest.param(INDENTS, id="indents", marks=pytest.mark.full),
        pytest.param("print 'a'\n" * 3_000, id="prints", marks=pytest.mark.full),
        pytest.param("'" * 60_001, id="quotes", marks=pytest.mark.full),
        pytest.param("\x0c\x0b\x1c x = 1\n", id="feeds", marks=pytest.mark.full),
        pytest.param("x = '\\ud800'\nprint x\n", id="surrogate"),
        pytest.param("\u2028print 'a'\n", id="separator", marks=pytest.mark.full),
    ],
)
def test_a_hostile_source_costs_its_own_repairs(source: str, tmp_path: Path) -> None:
    launch = '<launch>\n  <node pkg="lab" type="evil.py" name="evil"/>\n</launch>\n'
    wrong = swapped(TALKER, ("numeric_chatter", "numeric_chater"))
    folder = package(
        tmp_path, {**wrong, "src/evil.py": f"#!/usr/bin/env python3\n{source}", "launch/e.launch": launch}
    )
    found = [repair for repair in repair_all(folder) if repair.file == TALKER]
    assert [repair.kind for repair in found] == ["topic-name"]
    assert (folder / "src" / "talker.py").read_text() == SCRIPT


@pytest.mark.parametrize(
    ("file", "text"),
    [
        (XML, "<!--" * 15_000),
        (LAUNCHED, "<!--" * 15_000),
        (CMAKELISTS, "#project(\n" * 6_000),
        (CMAKELISTS, "projct(lab)\n" * 4_000),
        (CMAKELISTS, "catkin_package(CATKIN_DEPENDS " + " ".join(f"q{n}" for n in range(6_000)) + ")"),
    ],
)
def test_the_same_slip_thousands_of_times_is_looked_through_once(
    file: str, text: str, tmp_path: Path
) -> None:
    folder = package(tmp_path, {file: text})
    begin = time.process_time()
    repair_all(folder)
    assert time.process_time() - begin < 5
