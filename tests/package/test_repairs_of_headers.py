"""Programs of C++ that may be compiled before the headers of the messages that they include."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.model.generated_headers import surely_waits
from grader.package.repairs import apply_repair, find_repairs
from tests.package.repairing import CMAKE, CMAKELISTS, WANTED, package, repair_all
from tests.package.trees import facts_of

pytestmark = pytest.mark.usefixtures("without_processes")


def test_a_program_waits_for_no_header_of_a_package_that_is_not_there(tmp_path: Path) -> None:
    node = "#include <lab_msgs/Num.h>\n"
    folder = package(tmp_path, {"src/a.cpp": node, CMAKELISTS: f"{CMAKE}add_executable(a src/a.cpp)\n"})
    assert not any("headers" in one.message for one in find_repairs(folder, facts_of(folder, "lab"), WANTED))


EXPORTED = "${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS}"


@pytest.mark.parametrize(
    ("lines", "fix"),
    [
        ("add_dependencies(a lab_generate_messages_cpp)\n", f"write add_dependencies(a {EXPORTED})"),
        ("add_dependencies(a ${PROJECT_NAME}_gencpp)\n", f"write add_dependencies(a {EXPORTED})"),
        ("add_dependencies(a b first_pkg_generate_messages_cpp ${catkin_EXPORTED_TARGETS})\n",
         f"write add_dependencies(a b {EXPORTED})"),
        ("add_dependencies(a lab_gencpp)\nadd_dependencies(b lab_gencpp)\n",
         f"write add_dependencies(a {EXPORTED}); write add_dependencies(b {EXPORTED})"),
        ("add_dependencies(a std_msgs_generate_messages_cpp)\n", ""),
        ("add_dependencies(a ${OTHER}_generate_messages_cpp)\n", ""),
        ("add_dependencies(a b)\n", ""),
        ("generate_messages()\nadd_dependencies(a lab_generate_messages_cpp)\n", ""),
    ],
)  # fmt: skip
def test_a_program_waits_for_no_headers_that_nothing_makes(tmp_path: Path, lines: str, fix: str) -> None:
    programs = "".join(f"add_executable({a} src/{a}.cpp)\ntarget_link_libraries({a} x)\n" for a in "ab")
    catkin = CMAKE.replace("COMPONENTS ", "COMPONENTS message_generation ")
    folder = package(tmp_path, {"src/a.cpp": "\n", "src/b.cpp": "\n", CMAKELISTS: catkin + programs + lines})
    found = repair_all(folder)
    assert [one.fix for one in found] == ([fix] if fix else [])
    assert find_repairs(folder, facts_of(folder), WANTED) == ()
    older = (catkin + programs + lines).replace("3.0.2", "2.8.3")  # warns only
    (folder / CMAKELISTS).write_text(older)
    assert find_repairs(folder, facts_of(folder), WANTED) == ()


@pytest.mark.parametrize(
    ("headers", "targets"),
    [
        (["lab_msgs/Num.h"], "${catkin_EXPORTED_TARGETS}"),
        (["lab/Own.h"], "${${PROJECT_NAME}_EXPORTED_TARGETS}"),
        (["lab/Own.h", "lab_msgs/Num.h"], "${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS}"),
    ],
)
def test_a_program_waits_for_the_headers_that_it_includes(
    headers: list[str], targets: str, tmp_path: Path
) -> None:
    node = "".join(f"#include <{one}>\n" for one in headers)
    cmake = CMAKE.replace("catkin_p", "add_message_files(FILES Own.msg)\ngenerate_messages()\ncatkin_p")
    cmake = cmake.replace("COMPONENTS ", "COMPONENTS lab_msgs ")
    cmake += "add_executable()\nadd_executable(a src/a.cpp)\n"
    folder = package(tmp_path, {"src/a.cpp": node, "msg/Own.msg": "int8 a\n", CMAKELISTS: cmake})
    (tmp_path / "lab_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "lab_msgs" / "msg" / "Num.msg").write_text("int8 a\n")
    (tmp_path / "lab_msgs" / "package.xml").write_text("<package><name>lab_msgs</name></package>")
    beside = facts_of(tmp_path / "lab_msgs", "lab_msgs")
    facts = facts_of(folder, "lab").model_copy(update={"also": (beside,)})
    found = [one for one in find_repairs(folder, facts, WANTED) if "headers" in one.message]
    assert [one.fix.partition(", write ")[2] for one in found] == [f"add_dependencies(a {targets})"]


TO_OWN = "${${PROJECT_NAME}_EXPORTED_TARGETS}"
TO_END = "endforeach()\nadd_dependencies(a lab_gencpp)\n"
OF_OTHER = "add_dependencies(a lab_gencpp)\nadd_executable(c src/a.cpp)\n"
BOTH = f"add_dependencies(a2 {TO_OWN}) and add_dependencies(b2 {TO_OWN})"
WAITS = {
    "misspelt": (
        "add_dependencies(a other ${PROJECT_NAME}_generate_message_cpp)\n",
        f"add_dependencies(a other {TO_OWN})\n",
        f"on line 9, write {TO_OWN} in place of lab_generate_message_cpp",
    ),
    "of-a-tutorial": ("add_dependencies(a first_gencpp)\n", f"add_dependencies(a {TO_OWN})\n", ""),
    "of-python": (
        "add_dependencies(a lab_generate_messages_py)\n",
        f"add_dependencies(a lab_generate_messages_py {TO_OWN})\n",
        f"add {TO_OWN} to the add_dependencies(a …) on line 9",
    ),
    "no-variable": (
        "add_dependencies(a ${PROJECT_NAME}_EXPORTED_TARGETS)\n",
        f"add_dependencies(a {TO_OWN})\n",
        "",
    ),
    "of-others": (
        "add_dependencies(a ${catkin_EXPORTED_TARGETS})\n",
        f"add_dependencies(a ${{catkin_EXPORTED_TARGETS}} {TO_OWN})\n",
        "",
    ),
    "loop": (
        "foreach(t a b)\n  add_executable(${t}2 src/a.cpp)\n" + TO_END,
        f"foreach(t a b)\n  add_executable(${{t}}2 src/a.cpp)\nadd_dependencies(${{t}}2 {TO_OWN})\n{TO_END}",
        f"below the foreach(…) loop around line 10, write {BOTH}",
    ),
    "commented-out": (
        "#add_dependencies(a ${PROJECT_NAME}_generate_messages_cpp)\n",
        "add_dependencies(a ${PROJECT_NAME}_generate_messages_cpp)\n",
        "remove the `#` on line 9",
    ),
    "commented-out-of-another": (
        f"{OF_OTHER}# add_dependencies(b lab_gencpp)\n# add_dependencies(c std_msgs_gencpp)\n",
        (
            f"{OF_OTHER}add_dependencies(c {TO_OWN})\n"
            "# add_dependencies(b lab_gencpp)\n# add_dependencies(c std_msgs_gencpp)\n"
        ),
        f"below the add_executable(…) on line 10, write add_dependencies(c {TO_OWN})",
    ),
    "right": ("add_dependencies(a ${PROJECT_NAME}_generate_messages_cpp)\n", "", ""),
}


@pytest.mark.parametrize(("lines", "after", "fix"), WAITS.values(), ids=WAITS)
def test_a_program_waits_for_what_makes_its_headers(tmp_path: Path, lines: str, after: str, fix: str) -> None:
    cmake = CMAKE.replace("catkin_p", "add_message_files(FILES Own.msg)\ngenerate_messages()\ncatkin_p")
    cmake = cmake.replace("3.0.2", "2.8.3").replace("COMPONENTS ", "COMPONENTS message_generation ")
    begin = f"{cmake}add_executable(a src/a.cpp)\ntarget_link_libraries(a ${{catkin_LIBRARIES}})\n"
    files = {"src/a.cpp": "#include <lab/Own.h>\n", "msg/Own.msg": "int8 a\n", CMAKELISTS: begin + lines}
    folder = package(tmp_path, files)
    facts = facts_of(folder)
    assert surely_waits(facts) == (after == "")
    found = [one for one in find_repairs(folder, facts, WANTED) if "headers" in one.message]
    assert len(found) == (after != "")
    for one in found:
        apply_repair(folder, one)
        assert one.fix == fix or not fix
        assert (folder / CMAKELISTS).read_text() == begin + after


@pytest.mark.parametrize(
    ("source", "line", "waits"),
    [
        ("#include <lab/Own.h>\n", "file(GLOB all src/*.cpp)\nadd_executable(a ${all})\n", False),
        ("#include <std_msgs/Int8.h>\n", "file(GLOB all src/*.cpp)\nadd_executable(a ${all})\n", True),
        ("#include <lab/Own.h>\n", "", False),
    ],
    ids=["names-no-source", "of-ros", "no-target"],
)
def test_a_source_that_no_target_names_may_be_compiled_too_early(tmp_path, source, line, waits):
    folder = package(tmp_path, {"src/a.cpp": source, "msg/Own.msg": "int8 a\n", CMAKELISTS: CMAKE + line})
    assert surely_waits(facts_of(folder)) == waits
