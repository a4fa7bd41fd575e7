"""Files of the package that the arena's side reads: what is over a bound is named, and costs no time."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest

from grader.arena.process_environment import TEXT_BYTES_MAX, ProcessEnvironment
from grader.arena.scenario import set_params
from grader.arena.scenario_inputs import FILE_BYTES_MAX
from grader.arena.static_recorder import (
    ATTACHED_BYTES_MAX,
    ATTACHED_FILES_MAX,
    attachments,
    left_out_events,
)
from grader.evidence.events import ActorEvent
from grader.files import read_untrusted
from grader.package import read_package
from grader.rubric.scenario import Param
from tests.package.trees import CMAKE, MANIFEST, make_package

GOOD = {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE}


def test_files_that_the_evidence_does_not_hold_are_named(tmp_path: Path) -> None:
    files = {f"src/{number:03}.py": "x = 1\n" for number in range(ATTACHED_FILES_MAX)}
    package = make_package(tmp_path / "lab1", {**GOOD, **files, "a.txt": "y" * (ATTACHED_BYTES_MAX + 1)})
    facts = read_package(package)
    held = dict(attachments(package.folder, facts))
    assert len(held) == ATTACHED_FILES_MAX
    assert len(held["a.txt"]) == ATTACHED_BYTES_MAX
    assert [(event.action, event.actor) for event in left_out_events(facts)] == [
        ("limit", "a.txt"),
        ("limit", "the package"),
    ]
    assert list(left_out_events(read_package(make_package(tmp_path / "lab2", GOOD)))) == []


def test_a_readme_is_held_and_takes_no_codes_place(tmp_path: Path) -> None:
    few = make_package(tmp_path / "lab1", {**GOOD, "README.md": "# Lab 1"})
    assert dict(attachments(few.folder, read_package(few)))["README.md"] == b"# Lab 1"
    files = {f"src/{number:03}.py": "x = 1\n" for number in range(ATTACHED_FILES_MAX)}
    many = make_package(tmp_path / "lab2", {**files, "package.xml": MANIFEST, "README.md": "# Lab 1"})
    assert "README.md" not in dict(attachments(many.folder, read_package(many)))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a: 1\n" * (FILE_BYTES_MAX // 5 + 1), "too large"),
        ("\n".join(f"a{number}: 1" for number in range(2_000)), "too much in it"),
        ("a: " + "[" * 50 + "]" * 50, "too much in it"),
        ("a: &a [1, 1]\n" + "".join(f"b{n}: *a\n" for n in range(30)), "too much in it"),
    ],
)
def test_parameters_that_are_too_much_are_named(text: str, why: str, tmp_path: Path) -> None:
    file = tmp_path / "p.yaml"
    file.write_text(text)
    arena = SimpleNamespace(place=SimpleNamespace(package_file=lambda _: file))
    noted, arena.send = list[ActorEvent](), lambda **_: None
    arena.note = noted.append
    set_params((Param(file="p.yaml", also=("/a",)),), arena)  # type: ignore[arg-type] # as much as it looks at
    assert [(event.action, event.detail) for event in noted] == [("limit", f"p.yaml: {why}")]


def test_a_service_text_that_is_too_large_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "lab" / "msg"
    folder.mkdir(parents=True)
    place = SimpleNamespace(workspace=SimpleNamespace(repaired=tmp_path), share_folders=())
    (folder / "Odd.msg").write_text("int8 x\n" * (TEXT_BYTES_MAX // 7))
    find = partial(ProcessEnvironment.type_text, place)  # type: ignore[arg-type] # as much of a place as it looks at
    assert find("lab/Odd", "msg") is not None
    (folder / "Odd.msg").write_text("int8 x\n" * (TEXT_BYTES_MAX // 7 + 1))
    with pytest.raises(ValueError, match=r"Odd\.msg is larger than 64 kB"):
        find("lab/Odd", "msg")


def test_what_is_read_is_a_regular_file_and_no_longer_than_the_limit(tmp_path: Path) -> None:
    file = tmp_path / "a"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)
    assert read_untrusted(file, 100) == bytes(100)
    assert read_untrusted(tmp_path, 100) is None
