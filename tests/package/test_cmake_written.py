"""What a trace says is held against what is written in the package's files."""

from __future__ import annotations

import json
import time

import pytest

from grader.package.cmake import FILES_BYTES_MAX, LINES_MAX, written_calls

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
