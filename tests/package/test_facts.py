from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from grader.installable import noetic_messages
from grader.model.file_fault import Fault
from grader.model.message_definitions import meant_field, parse_interface
from grader.model.package import PackageFacts
from grader.package.facts import python_paths, read_package, with_build_facts
from tests.package.trees import CMAKE, MANIFEST, NODE, make_package

LAUNCH = '<launch>\n  <node pkg="lab1" type="a.py" name="a"/>\n</launch>\n'
FILES = {
    "package.xml": MANIFEST,
    "CMakeLists.txt": CMAKE + "catkin_install_python(PROGRAMS src/a.py DESTINATION "
    "${CATKIN_PACKAGE_BIN_DESTINATION})\ncatkin_package(INCLUDE_DIRS ${no_such_variable})\n",
    "src/a.py": NODE + "rate.sleep\n",
    "src/bad.py": NODE + "print 1\n",
    "src/tool": NODE,
    "launch/lab1.launch": LAUNCH,
    "build/old.launch": "<launch",
}


def test_a_whole_package(tmp_path):
    package = make_package(tmp_path / "lab1", FILES, executable={"src/a.py": True})
    facts = read_package(package, hints=("found by folder name",))
    assert facts.manifest.name == "lab1"
    assert facts.manifest_fault is None
    assert facts.cmake.source == "parser"
    assert facts.file("src/a.py").executable is True
    assert facts.file("src/bad.py").python_fault.line == 3
    kinds = {(s.file, s.line, s.kind) for s in facts.slips}
    assert kinds == {("src/a.py", 3, "not-called"), ("src/a.py", 3, "undefined")}
    assert [(f.path, f.nodes[0].line) for f in facts.launch_files] == [("launch/lab1.launch", 2)]
    assert facts.hints == ("found by folder name",)
    assert python_paths(facts) == ("src/a.py", "src/bad.py", "src/tool")
    assert PackageFacts.model_validate_json(facts.model_dump_json()) == facts


def test_an_empty_folder_is_no_crash(tmp_path):
    facts = read_package(make_package(tmp_path / "lab1", {}))
    assert (facts.manifest, facts.manifest_fault.kind, facts.cmake, facts.files) == (
        None,
        "Missing",
        None,
        (),
    )


def test_ros_python_has_the_last_word(tmp_path):
    package = make_package(tmp_path / "lab1", FILES)
    fault = Fault(file="src/a.py", line=1, kind="SyntaxError", message="invalid syntax")
    given = read_package(package)
    facts = with_build_facts(given, folder=package.folder, python_faults={"src/a.py": fault}, python_slips=())
    assert facts.file("src/a.py").python_fault == fault
    assert facts.file("src/bad.py").python_fault is None
    assert facts.slips == ()


def test_what_ros_python_was_not_asked_keeps_its_fault(tmp_path):
    package = make_package(tmp_path / "lab1", {os.fsdecode(b"caf\xe9.py"): "x = \n", "b.py": "y = \n"})
    (package.folder / "here.py").symlink_to(package.folder / "b.py")
    (package.folder / "there.py").symlink_to("b.py")
    facts = read_package(package)
    assert python_paths(facts) == ("b.py", "there.py")
    assert all(file.python_fault for file in facts.files)
    refined = with_build_facts(facts, python_faults={})
    assert [f.path for f in refined.files if f.python_fault] == ["caf\\udce9.py", "here.py"]


def test_build_facts_that_are_not_given_change_nothing(tmp_path):
    given = read_package(make_package(tmp_path / "lab1", FILES))
    assert with_build_facts(given) == given


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize("stops", [False, True])
def test_cmake_says_what_it_was_told(tmp_path, stops):
    """A real trace; where the script to install is missing, catkin stops CMake there."""
    cmake = shutil.which("cmake", path="/usr/bin:/bin")
    if cmake is None or not Path("/usr/share/catkin").exists():
        pytest.skip("needs cmake and Debian's catkin")
    package = make_package(tmp_path / "lab1", FILES)
    if stops:
        (package.folder / "src" / "a.py").unlink()
    trace = tmp_path / "trace.json"
    options = ["--trace-expand", "--trace-format=json-v1", "--trace-source=CMakeLists.txt"]
    subprocess.run(
        [cmake, "-S", package.folder, "-B", tmp_path / "out", *options, f"--trace-redirect={trace}"],
        env={**os.environ, "PATH": "/usr/bin:/bin"},
        capture_output=True,
        check=not stops,
    )
    static = read_package(package)
    facts = with_build_facts(static, cmake_trace=trace)
    by_root = with_build_facts(static, cmake_trace=trace, cmake_root=str(package.folder))
    assert facts.cmake == by_root.cmake
    assert facts.cmake.source == "trace"
    assert facts.cmake.stopped_line == (5 if stops else None)
    calls = [(c.name, c.args, c.line) for c in facts.cmake.calls]
    assert ("catkin_install_python", ("PROGRAMS", "src/a.py", "DESTINATION", "lib/lab1"), 5) in calls
    assert [line for name, _, line in calls if name == "catkin_package"] == [4, 6]
    assert calls[:5] == [(c.name, c.args, c.line) for c in static.cmake.calls][:5]


LINES = {
    "float64\tlevel": "float64 level",
    "uint8 A\t=\t1": None,
    "float64 \tlevel": None,
    "uint8 A = 0x10": "uint8 A = 16",
    "uint8 A = 256": "",
    "uint8 A = zero": "",
    "int8 A = -128": None,
    "int32 A == 5": "int32 A = 5",
    "int32 A = 1.0": "int32 A = 1",
    "bool B = true": "bool B = True",
    "bool B = 1": None,
    "float32 F = 1.5f": "float32 F = 1.5",
    "float64 F = 1e3  # m": None,
    "string S = a-b # c": None,
    "string[] S = a": "",
    "float64: level": "float64 level",
    "level: float64": "float64 level",
    "float64 le-vel": "float64 le_vel",
    "float64 my speed": "float64 my_speed",
    "float64 [] levels": "float64[] levels",
    "float64 levels[3]": "float64[3] levels",
    "float 64 level": "float64 level",
    "std_msgs.Header header": "std_msgs/Header header",
    "float64 a, b": "",
    "float64 2nd": "",
    "Pose pose at": "",
    "// in metres": "# in metres",
}


@pytest.mark.parametrize("line", LINES)
def test_a_line_that_ros_refuses_is_a_fault_with_what_is_meant(line: str) -> None:
    right = LINES[line]
    fault = parse_interface(line.encode(), "msg/Level.msg").fault
    assert (fault and fault.fix) == (None if right is None else f"write `{right}`" if right else "")
    assert not right or parse_interface(right.encode(), "msg/Level.msg").fault is None


@pytest.mark.parametrize(
    ("field", "meant"),
    [
        ("speed float64", "float64 speed"),
        ("float64[] time", ""),
        ("std_msgs/Header duration", ""),
        ("Level string", ""),
        ("std_msg/Header header", "std_msgs/Header header"),
        ("geometry_msgs/pose[] poses", "geometry_msgs/Pose[] poses"),
        ("mav_msgs/Odometry odometry", ""),
        ("lab/Other other", ""),
    ],
)
def test_a_field_of_no_type_has_the_one_that_is_meant(field: str, meant: str) -> None:
    (read,) = parse_interface(field.encode(), "msg/Lab.msg").fields
    assert " ".join(meant_field(read, {"Level"}, noetic_messages())) == (meant or field)
