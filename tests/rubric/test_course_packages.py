"""Packages beside a rubric: they belong to it, and a slip in them is a fault of the rubric."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.integrations.platform_exports import Bundle, add_lab
from grader.rubric.load import load_rubric, read_beside_rubric
from tests.rubric.samples import faults, spoiled

MANIFEST = "<package><name>course_sim</name></package>"
START = "      - {name: talker, script: src/talker.py}\n"


def lab(folder: Path, program: str = "course_sim/tank.py", packages: str = "[course_sim]") -> Path:
    """The sound rubric with a package of the course's, and a program of it that is started."""
    path = spoiled(
        folder,
        ("package: lab1\n", f"package: lab1\npackages: {packages}\n"),
        (START, f"      - {{name: tank, program: {program}}}\n{START}"),
    )
    for name, text in {
        "package.xml": MANIFEST,
        "CMakeLists.txt": "add_executable(pump src/pump.cpp)",
        "nodes/tank.py": "#!/usr/bin/env python3\n",
        "launch/world.launch": "<launch/>",
        "__pycache__/tank.pyc": "no",
        ".git/HEAD": "no",
    }.items():
        file = folder / "course_sim" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return path


@pytest.mark.parametrize("program", ["tank.py", "world.launch", "pump"])
def test_scripts_launch_files_and_compiled_programs_are_found(tmp_path: Path, program: str) -> None:
    loaded = load_rubric(str(lab(tmp_path, f"course_sim/{program}")))
    assert loaded.rubric.packages == ("course_sim",)


def test_they_are_part_of_the_digest_and_of_what_is_exported(tmp_path: Path) -> None:
    path = lab(tmp_path)
    loaded = load_rubric(str(path))
    names = {
        f"course_sim/{name}"
        for name in ("package.xml", "CMakeLists.txt", "nodes/tank.py", "launch/world.launch")
    }
    assert read_beside_rubric(loaded).keys() == names
    bundle = Bundle()
    add_lab(bundle, loaded, "lab")
    packed = {name: executable for name, _, executable in bundle.entries()}
    assert packed == {"lab/lab.yaml": False, **{f"lab/{name}": name.endswith(".py") for name in names}}
    (tmp_path / "course_sim" / "nodes" / "tank.py").write_text("#!/usr/bin/env python3\nprint()\n")
    assert load_rubric(str(path)).digest != loaded.digest


@pytest.mark.parametrize(
    ("program", "packages", "fault"),
    [
        (
            "course_sim/tanks.py",
            "[course_sim]",
            '11: scenarios.real.start[0].program: course_sim has no program or launch file "tanks.py" (did you mean',
        ),
        (
            "course_sim/tank.py",
            "[course]",
            "6: packages[0]: there is no course/package.xml beside the rubric",
        ),
        ("course_sim/tank.py", "[../course_sim]", "6: packages[0]: "),
    ],
)
def test_each_fault_with_its_line(tmp_path: Path, program: str, packages: str, fault: str) -> None:
    found = faults(lab(tmp_path, program, packages))
    assert any(one.startswith(f"lab.yaml:{fault}") for one in found), found


def test_a_test_file_that_starts_a_students_node_is_a_fault(tmp_path: Path) -> None:
    path = lab(tmp_path, "course_sim/tank.test")
    file = tmp_path / "course_sim" / "test" / "tank.test"
    file.parent.mkdir()
    file.write_text(
        '<launch><!-- <node pkg="lab1"/> --><test pkg="course_sim" type="tank.py" test-name="t"/></launch>'
    )
    load_rubric(str(path))
    file.write_text('<launch><node name="talker" pkg="lab1" type="talker.py"/></launch>')
    (fault,) = faults(path)
    assert fault.startswith(
        "lab.yaml:11: scenarios.real.start[0].program: tank.test starts something of lab1: take"
    )


def test_a_manifest_with_another_name_is_a_fault(tmp_path: Path) -> None:
    path = lab(tmp_path)
    (tmp_path / "course_sim" / "package.xml").write_text(MANIFEST.replace("course_sim", "sim"))
    assert "lab.yaml:6: packages[0]: course_sim/package.xml does not say <name>course_sim</name>" in faults(
        path
    )


def test_more_than_a_rubric_may_bring_along_is_refused(tmp_path: Path) -> None:
    path = lab(tmp_path)
    with (tmp_path / "course_sim" / "map.pgm").open("wb") as file:
        file.truncate(21_000_000)
    assert any("is more than 20 MB or 500 files" in fault for fault in faults(path))
