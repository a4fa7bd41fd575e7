"""`CMakeLists.txt` read with and without CMake, and a trace held against what is written in the files."""

from __future__ import annotations

import json
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.line_slips.cmake import find_slip
from grader.model.package import meant_command
from grader.package.cmake import (
    FILES_BYTES_MAX,
    LINES_MAX,
    read_cmake,
    refine_cmake,
    split_lists,
    written_calls,
)
from grader.package.cmake_parse import parse_tree_of


def facts_of(tmp_path, text, *, trace=None, root=None):
    data = text if isinstance(text, bytes) else text.encode()
    (tmp_path / "CMakeLists.txt").write_bytes(data)
    facts = read_cmake(tmp_path, "lab1")
    return facts if trace is None else refine_cmake(facts, ("lab1",), trace=trace, root=root)


def calls_of(facts, name):
    return [call.args for call in facts.calls if call.name == name]


INSTALL = ("PROGRAMS", "scripts/a.py", "scripts/b.py", "DESTINATION", "lib/lab1")


@pytest.mark.parametrize(
    "text",
    [
        (
            "project(lab1)\nfind_package(catkin)\nCATKIN_INSTALL_PYTHON(PROGRAMS scripts/a.py scripts/b.py "
            "DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})"
        ),
        (
            "project(lab1)\nset(S scripts/a.py\n  scripts/b.py)\ncatkin_install_python(PROGRAMS ${S} "
            "DESTINATION lib/${PROJECT_NAME})"
        ),
        (
            "macro(place D f) # one\n  catkin_install_python(PROGRAMS ${f} ${ARGN} DESTINATION ${D})\nendmacro()\n"
            "Place(lib/lab1 scripts/a.py scripts/b.py)"
        ),
        (
            "function(place)\n  catkin_install_python(PROGRAMS ${ARGN} DESTINATION lib/lab1)\nendfunction()\n"
            "place(scripts/a.py scripts/b.py)"
        ),
        (
            "set(D scripts)\nlist(APPEND S ${D}/a.py)\nlist(APPEND S ${D}/b.py)\n"
            'catkin_install_python(PROGRAMS ${S} DESTINATION "lib/${PROJECT_NAME}")'
        ),
        (
            "project(lab1)\r\n# catkin_install_python(PROGRAMS x)\r\n#[[\r\ncatkin_install_python(x)\r\n"
            "]]\r\nif(TRUE)\r\ncatkin_install_python(PROGRAMS scripts/a.py # why\r\n scripts/b.py\r\n"
            "DESTINATION lib/lab1)\r\nendif()\r\nif(FALSE)\r\ncatkin_install_python(no)\r\nendif()"
        ),
    ],
)
def test_the_parser_expands_what_is_literal(tmp_path, text):
    facts = facts_of(tmp_path, text)
    assert facts.fault is None
    assert calls_of(facts, "catkin_install_python") == [INSTALL]


def test_loops_unknown_variables_and_lone_dollars(tmp_path):
    facts = facts_of(
        tmp_path,
        "foreach(n a b)\ninstall(FILES ${n}.py)\nendforeach()\nset(L x y)\nforeach(n IN LISTS L ITEMS z)\n"
        "add_executable(${n} ${n}.cpp)\nendforeach()\n"
        'target_link_libraries(x ${catkin_LIBRARIES} $<TARGET_FILE:y> "^a$" $ENV{HOME})\nmessage(hi)\n'
        "function(f)\ninstall(never)\nendfunction()",
    )
    assert calls_of(facts, "install") == [("FILES", "a.py"), ("FILES", "b.py")]
    assert calls_of(facts, "add_executable") == [(n, f"{n}.cpp") for n in "xyz"]
    assert calls_of(facts, "target_link_libraries") == [
        ("x", "${catkin_LIBRARIES}", "$<TARGET_FILE:y>", "^a$", "$ENV{HOME}")
    ]
    assert not calls_of(facts, "message")


def test_a_brace_without_its_dollar_stays_in_its_word(tmp_path):
    facts = facts_of(tmp_path, "install(PROGRAMS a.py DESTINATION {WHERE})\ninstall(FILES {B} ${C}{D}/e)\n")
    assert calls_of(facts, "install") == [
        ("PROGRAMS", "a.py", "DESTINATION", "{WHERE}"),
        ("FILES", "{B}", "${C}{D}/e"),
    ]


def test_included_files_of_the_package_count_and_no_others(tmp_path):
    (tmp_path / "cmake").mkdir()
    (tmp_path / "cmake" / "more.cmake").write_text("install(FILES x)\ninclude(cmake/more.cmake)\n")
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "CMakeLists.txt").write_text("add_executable(n n.cpp)")
    facts = facts_of(tmp_path, "include(cmake/more.cmake)\ninclude(../../etc/passwd)\nadd_subdirectory(src)")
    assert [(c.name, c.file, c.line) for c in facts.calls if c.name in {"install", "add_executable"}] == [
        ("install", "cmake/more.cmake", 1),
        ("add_executable", "src/CMakeLists.txt", 1),
    ]


@pytest.mark.parametrize(
    "folder", ["PROJECT_SOURCE_DIR", "CMAKE_CURRENT_SOURCE_DIR", "CMAKE_CURRENT_LIST_DIR"]
)
def test_an_included_file_may_be_named_from_the_folder_of_the_package(tmp_path, folder):
    (tmp_path / "more.cmake").write_text("install(FILES x)\n")
    assert calls_of(facts_of(tmp_path, f"include(${{{folder}}}/more.cmake)\n"), "install") == [("FILES", "x")]
    text = f"list(APPEND CMAKE_MODULE_PATH ${{{folder}}})\ninclude(more)\ninclude(other)\n"
    assert calls_of(facts_of(tmp_path, text), "install") == [("FILES", "x")]


@pytest.mark.parametrize(
    ("text", "line", "cause", "kept"),
    [
        (
            "project(lab1)\nfind_package(catkin\ncatkin_package()\n",
            2,
            "`(` of `find_package(` is never closed",
            1,
        ),
        ("project(lab1)\n)\n", 2, "`)` too many", 1),
        ("project(lab1)\n# set(\n  a\n  b\n)\n", 2, "`set(…)` is commented out: remove the `#` on line 2", 1),
        ("project(lab1)\nset(\n#  a\n#  b)\nset(c d)\n", 3, "remove the `#` on lines 3 to 4", 1),
        ("project(lab1)\nset(a\n# set(b c)\nset(c d)\n", 2, "write `)` at the end of line 2", 1),
        ("project(lab1)\nset(a\n\n# and more)\nset(c d)\n", 2, "write `)` at the end of line 2", 1),
        ('project(lab1)\n\nset(a "b)\n', 3, "a quote", 1),
        ("project(lab1)\nhello world\n", 2, "these words are no command", 1),
        ("project(lab1)\nif(x)\nset(a b)\n", 2, "`if()` is never closed by `endif()`", 1),
        ("project(lab1)\nendif()\n", 2, "no `if()` before it", 1),
        ("project(lab1)\nset(a ${b)\ncatkin_package()", 2, "`${...}` is never closed", 3),
        ("/opt/ros/noetic/share/catkin/cmake/toplevel.cmake", 1, "only the path that a link", 0),
        ("f" + "(" * 5000, None, "nested too deep", 0),
        ("if(a)\n" * 60 + "endif()\n" * 60, 51, "nested too deep", 0),
        ("project(lab1)\nbreak(1)", 1, "", 1),
        (b"p(a [[ " * 2000, None, "too many", 0),
        ("project(lab1)".encode("utf-16"), 1, "UTF-16", 0),
    ],
)
def test_faults_keep_what_comes_before(tmp_path, text, line, cause, kept):
    facts = facts_of(tmp_path, text)
    assert facts.fault.line == line
    assert cause in facts.fault.explanation
    assert len(facts.calls) == kept


@pytest.mark.parametrize(
    "text",
    [
        "",
        "\n",
        "# caf\xe9\nproject(lab1)".encode("latin-1"),
        b"\xef\xbb\xbfproject(lab1)",
        "#[1] odd\nproject(lab1)",
    ],
)
def test_odd_but_good_files(tmp_path, text):
    facts = facts_of(tmp_path, text)
    assert facts.fault is None
    assert calls_of(facts, "project") == ([("lab1",)] if text.strip() else [])


def test_missing_files_and_links(tmp_path):
    assert read_cmake(tmp_path, "lab1") is None
    (tmp_path / "CMakeLists.txt").symlink_to("/opt/ros/none/toplevel.cmake")
    assert "link" in read_cmake(tmp_path, "lab1").fault.explanation
    (tmp_path / "CMakeLists.txt").unlink()
    (tmp_path / "CMakeLists.txt").symlink_to("/etc/passwd")
    assert read_cmake(tmp_path, "lab1").fault.kind == "OutsideLink"


def test_hostile_brackets_end_soon(tmp_path):
    begin = time.process_time()
    for text in ("[[ " * 300_000, "x(" + '" ' * 400_000, "#[" * 400_000, "a" * 900_000):
        assert facts_of(tmp_path, text).fault is not None or text.startswith("#")
    assert time.process_time() - begin < 5


TEXT = (
    "project(lab1)\nset(S a.py b.py)\nfind_package(catkin REQUIRED)\ninstall(FILES ${S})\ncatkin_package()\n"
)


def trace_file(tmp_path, entries, tail=""):
    lines = ['{"version":{"major":1,"minor":2}}']
    for name, args, file, line in entries:
        lines.append(
            json.dumps({"args": args, "cmd": name, "file": file, "frame": 1, "line": line, "time": 1.0})
        )
    path = tmp_path / "trace.json"
    path.write_text("\n".join([lines[0], "garbage {", "[" * 100_000, "5", *lines[1:]]) + "\n" + tail)
    return path


WHOLE = [
    ("PROJECT", ["lab1"], "/ws/src/lab1/CMakeLists.txt", 1),
    ("find_package", ["catkin", "REQUIRED"], "/ws/src/lab1/CMakeLists.txt", 3),
    ("if", ["x"], "/ws/src/lab1/CMakeLists.txt", 3),
    ("include", ["x"], "/ws/src/other/CMakeLists.txt", 1),
    ("set", ["Z", "1"], "/opt/ros/catkin.cmake", 1),
    ("install", ["FILES", "a.py;b.py", ""], "/ws/src/lab1/CMakeLists.txt", 4),
    ("option", ["x"], "/ws/src/lab1/cmake/x.cmake", 1),
    ("catkin_package", [], "/ws/src/lab1/CMakeLists.txt", 5),
]


@pytest.mark.parametrize("root", [None, "/ws/src/lab1", "/ws/src/lab1/"])
def test_a_trace_says_what_cmake_was_told(tmp_path, root):
    facts = facts_of(tmp_path, TEXT, trace=trace_file(tmp_path, WHOLE, '{"args":["cut'), root=root)
    assert (facts.source, facts.stopped_line, facts.last_line) == ("trace", None, 5)
    assert [(c.name, c.args, c.file, c.line) for c in facts.calls] == [
        ("project", ("lab1",), "CMakeLists.txt", 1),
        ("find_package", ("catkin", "REQUIRED"), "CMakeLists.txt", 3),
        ("install", ("FILES", "a.py", "b.py"), "CMakeLists.txt", 4),
        ("option", ("x",), "cmake/x.cmake", 1),
        ("catkin_package", (), "CMakeLists.txt", 5),
    ]


def test_where_cmake_gives_up_the_parser_goes_on(tmp_path):
    facts = facts_of(tmp_path, TEXT, trace=trace_file(tmp_path, WHOLE[:2]))
    assert (facts.source, facts.stopped_line) == ("trace", 3)
    assert [(c.name, c.line) for c in facts.calls] == [
        ("project", 1),
        ("find_package", 3),
        ("install", 4),
        ("catkin_package", 5),
    ]
    returned = [*WHOLE[:2], ("return", [], "/ws/src/lab1/CMakeLists.txt", 3)]
    assert len(facts_of(tmp_path, TEXT, trace=trace_file(tmp_path, returned)).calls) == 2


def test_a_trace_without_the_package_changes_nothing(tmp_path):
    plain = facts_of(tmp_path, TEXT)
    others = [(n, a, f"/ws/{n}/CMakeLists.txt", line) for n, a, _, line in WHOLE]
    assert facts_of(tmp_path, TEXT, trace=trace_file(tmp_path, others)) == plain
    assert facts_of(tmp_path, TEXT, trace=trace_file(tmp_path, WHOLE), root="/ws/src/lab") == plain
    assert facts_of(tmp_path, TEXT, trace=tmp_path / "none") == plain
    newer = tmp_path / "newer"
    newer.write_text(trace_file(tmp_path, WHOLE).read_text().replace('"major":1', '"major":2'))
    assert facts_of(tmp_path, TEXT, trace=newer) == plain


def test_lists_are_split_as_cmake_does():
    assert split_lists(["a;b", "", "c\\;d", ";e;", "\ud800"]) == ("a", "b", "c;d", "e", "\\ud800")


@settings(derandomize=True)
@given(st.binary(max_size=200), st.integers(0, len(TEXT)))
def test_never_raises(tmp_path_factory, noise, at):
    folder = tmp_path_factory.getbasetemp()
    text = TEXT.encode()
    for data in (noise, text[:at] + noise + text[at:]):
        parse_tree_of(data, "CMakeLists.txt")
        assert facts_of(folder, data).source == "parser"
        (folder / "noise.json").write_bytes(noise)
        assert facts_of(folder, data, trace=folder / "noise.json").source == "parser"


@settings(derandomize=True)
@given(st.text(alphabet='if()endforach"${}[=]#\\;\n x', max_size=60))
def test_never_raises_on_what_looks_like_cmake(tmp_path_factory, text):
    assert facts_of(tmp_path_factory.getbasetemp(), text).source == "parser"


@pytest.mark.parametrize(
    ("lines", "name", "folder"),
    [
        ("", "lab1_node", ""),
        ('set_target_properties(lab1_node PROPERTIES OUTPUT_NAME node PREFIX "")', "node", ""),
        ('set_target_properties(lab1_node PROPERTIES PREFIX "" OUTPUT_NAME node)', "node", ""),
        ('set_target_properties(lab1_node PROPERTIES LINK_FLAGS "" OUTPUT_NAME node)', "node", ""),
        ("set_target_properties(a lab1_node PROPERTIES PREFIX my_ SUFFIX .bin)", "my_lab1_node.bin", ""),
        ("set_property(TARGET lab1_node PROPERTY OUTPUT_NAME node)", "node", ""),
        ("set_property(SOURCE lab1_node PROPERTY OUTPUT_NAME node)", "lab1_node", ""),
        ("set_target_properties(lab1_node PROPERTIES RUNTIME_OUTPUT_NAME b OUTPUT_NAME a)", "b", ""),
        ("set_target_properties(other PROPERTIES OUTPUT_NAME a)", "lab1_node", ""),
        (
            "set_target_properties(lab1_node PROPERTIES RUNTIME_OUTPUT_DIRECTORY /x/bin)",
            "lab1_node",
            "/x/bin",
        ),
    ],
)
def test_a_program_has_the_name_that_its_target_s_properties_give_it(lines, name, folder, tmp_path):
    facts = facts_of(tmp_path, f"project(lab1)\nadd_executable(${{PROJECT_NAME}}_node a.cpp)\n{lines}\n")
    (found,) = facts.executables
    assert (found.target, found.name, found.folder) == ("lab1_node", name, folder)
    assert found.is_called(name)
    assert not found.is_called(f"{name}2")


def test_a_name_that_only_cmake_knows_may_be_any(tmp_path):
    text = "add_executable(talker a.cpp)\nset_target_properties(talker PROPERTIES OUTPUT_NAME my_${UNKNOWN}_node)"
    (found,) = facts_of(tmp_path, text).executables
    assert found.is_called("my_talker_node")
    assert not found.is_called("talker")


@pytest.mark.parametrize(
    ("text", "fix", "after"),
    [
        (
            "// a\nproject(x) // b\n",
            "where the comment begins, and the same on line 2",
            "# a\nproject(x) # b\n",
        ),
        (
            "/* a\n b */\nproject(x)\n",
            "where the comment begins, and the same on line 2",
            "# a\n# b */\nproject(x)\n",
        ),
        ("<!-- a -->\nproject(x)\n", "where the comment begins", "# a -->\nproject(x)\n"),
        (
            "project(x);\nfoo()  ;  # a\n",
            "delete the `;`, and the same on line 2",
            "project(x)\nfoo()  # a\n",
        ),
        ('set(x "http://a;b")\nproject(x)\n', "", ""),
        ("foo(\n  --option\n  % b\n)\n", "", ""),
        ("-- a\nfoo(\n  --option\n)\n", "where the comment begins", "# a\nfoo(\n  --option\n)\n"),
        (
            "  // see foo(\n-- a\nproject(x)\n",
            "where the comment begins, and the same on line 2",
            "  # see foo(\n# a\nproject(x)\n",
        ),
        (
            "project(x\n)\n Use this (if any)\nfoo()\n",
            "before them",
            "project(x\n)\n# Use this (if any)\nfoo()\n",
        ),
        ("project(x)\nInstall:\n the rest\n", "the same on line 3", "project(x)\n# Install:\n# the rest\n"),
        ("project(x)\ns\n", "delete line 2", "project(x)\n"),
        ("catkin package()\n", "write `catkin_package()`", "catkin_package()\n"),
        ("project\n(x)\n", "", ""),
        ("find_pakage catkin\n", "", ""),
    ],
)
def test_what_other_languages_write_is_put_right_on_all_lines(text, fix, after):
    slip = find_slip(text, 1)
    assert (slip.fix.endswith(fix), slip.text) == (True, after) if fix else slip is None


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("catkin_python_install", "catkin_install_python"),
        ("package_find", "find_package"),
        ("catkinpackage", "catkin_package"),
        ("catkin_install_python", ""),
        ("my_macro", ""),
        ("cs_add_executable", ""),
    ],
)
def test_a_command_with_its_words_in_another_order_is_a_slip_of_it(name, meant):
    assert meant_command(name) == meant


ROOT = "/home/student/catkin_ws/src/lab"
WRITTEN = (
    "cmake_minimum_required(VERSION 3.0.2)\nproject(lab)\nmacro(own)\n  Catkin_Package()\nendmacro()\n"
    "foreach(n a b)\n  install(FILES ${n}\n    DESTINATION x)\nendforeach()\ncmake_language(CALL enable_testing)\n"
)


def call(line, cmd, *args, file="CMakeLists.txt"):
    return {"file": f"{ROOT}/{file}", "line": line, "cmd": cmd, "args": list(args)}


def kept(tmp_path, *entries, text=WRITTEN):
    (tmp_path / "CMakeLists.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    trace = b"".join(json.dumps(entry).encode() + b"\n" for entry in entries)
    return [json.loads(line) for line in written_calls(trace, tmp_path, ROOT).trace.splitlines()]


TRUE = [
    call(2, "project", "lab"),
    call(4, "Catkin_Package"),
    call(6, "foreach", "n", "a"),
    call(7, "install", "FILES", "a", "DESTINATION", "x"),
    call(10, "enable_testing"),
    {"file": "/usr/share/catkin/cmake/x.cmake", "line": 1, "cmd": "set", "args": ["a"]},
    {"version": {"major": 1, "minor": 2}},
]
FORGED = [
    call(1, "catkin_package"),
    call(2, "catkin_package"),
    call(2, "project", "lab1"),
    call(2, "project", "lab", "x"),
    call(99, "catkin_package"),
    call(1, "catkin_package", file="not-handed-in.cmake"),
    call(1, "catkin_package", file="../lab/CMakeLists.txt"),
]


def test_what_is_written_is_kept_and_what_is_not_is_dropped(tmp_path):
    assert kept(tmp_path, *TRUE, *FORGED) == TRUE


@pytest.mark.parametrize("text", ["project(lab)\n(\n", b"\xff\xfep\x00", "[[" * 5000])
def test_a_file_that_cannot_be_read_through_bears_out_everything(tmp_path, text):
    assert kept(tmp_path, *FORGED[:2], text=text) == FORGED[:2]


def test_what_is_no_call_is_left_alone(tmp_path):
    garbage = b'not json\n{"file": 1}\n[1]\n{"cut":'
    assert written_calls(garbage, tmp_path, ROOT) == (garbage, "")


def test_a_trace_of_too_many_lines_is_named_and_cut(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text("project(a)\n")
    line = json.dumps(call(1, "project", "a")).encode() + b"\n"
    begin = time.process_time()
    found = written_calls(line * 80_000, tmp_path, ROOT)
    assert time.process_time() - begin < 10
    assert found.trace.count(b"\n") == LINES_MAX - 1
    assert found.too_much == f"CMake's trace has more than {LINES_MAX} lines"


@pytest.mark.full
def test_files_that_take_too_long_to_parse_bear_out_nothing_and_are_named(tmp_path):
    for number in range(60):
        (tmp_path / f"c{number}.cmake").write_text("a(b)\n" * 39_000)
    entries = [call(1, "a", "b", file=f"c{number}.cmake") for number in range(60)]
    trace = b"".join(json.dumps(entry).encode() + b"\n" for entry in entries)
    begin = time.process_time()
    found = written_calls(trace, tmp_path, ROOT)
    assert time.process_time() - begin < 15
    assert found.trace.count(b'"a"') == FILES_BYTES_MAX // len("a(b)\n" * 39_000)
    assert found.too_much == f"CMake's files are more than {FILES_BYTES_MAX // 1000} kB together"


@pytest.mark.full
def test_a_call_of_a_hundred_thousand_words_is_compared_at_once(tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(f"a({'b ' * 90_000})\n")
    trace = (json.dumps(call(1, "a", "c")).encode() + b"\n") * 20_000
    begin = time.process_time()
    assert written_calls(trace, tmp_path, ROOT).trace == b""
    assert time.process_time() - begin < 10


def test_a_slip_within_a_block_is_told_and_not_the_block(tmp_path):
    text = "project(a)\nif(x)\n  foreach(y 1)\n    message(${y}\n  endforeach()\nendif()\n"
    fault = facts_of(tmp_path, text).fault
    assert (fault.line, fault.cause) == (4, "the `(` of `message(` is never closed by `)`")
