from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from grader.model.package import Fault, PackageFacts
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
    facts = with_build_facts(read_package(package), python_faults={"src/a.py": fault}, python_slips=())
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
