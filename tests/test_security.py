"""SECURITY.md names the test of each promise, and the limits as they are."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from grader import files
from grader.arena import build, process_environment, recording_files, scenario_inputs, steps, workspace
from grader.arena.limits import SUBMISSION_MESSAGE_BYTES, RunLimits
from grader.checks.support import text
from grader.evidence import decode, definitions, mcap_records
from grader.evidence.run import DECODED_BYTES_MAX, FOREIGN_BYTES_MAX, HELD_BYTES_MAX
from grader.intake import archive, git, gitdir
from grader.intake.limits import IntakeLimits
from grader.package import cmake, cmake_parse, launch, launch_loader, python, reading
from grader.ros_env import DUMP_BYTES, NAMES_MAX, VALUE_BYTES

KB, MB, RUN = 1 << 10, 1 << 20, RunLimits()
ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in TEXT.splitlines()
    if line.startswith("|") and not line.startswith("|--")
]
PROMISES = [row for row in ROWS if len(row) == 3 and re.search("`test(s/|_)", row[2])]


def _folders() -> list[Path]:
    """Where the files of the second column may be."""
    return [ROOT, ROOT / "grader", *(path for path in (ROOT / "grader").rglob("*") if path.is_dir())]


@pytest.mark.parametrize("row", PROMISES, ids=[row[0][:40] for row in PROMISES])
def test_what_holds_a_promise_and_what_tests_it_is_there(row: list[str]) -> None:
    held, tested = re.findall(r"`([^`]+)`", row[1]), re.findall(r"`([^`]+)`", row[2])
    assert tested
    for name in held:
        assert any((folder / name).exists() for folder in _folders()), name
    for name in tested:
        assert _is_there(name), name


OUTSIDE = [row for row in ROWS if len(row) == 4 and row[0] != "program or file"]


@pytest.mark.parametrize("row", OUTSIDE, ids=[row[0][:40] for row in OUTSIDE])
def test_what_stands_outside_has_a_test_or_says_that_nothing_holds(row: list[str]) -> None:
    tested = re.findall(r"`([^`]+)`", row[3])
    assert tested or "**nothing**" in row[2]
    for name in tested:
        assert _is_there(name), name


READINGS = [row for row in ROWS if len(row) == 5 and row[0] != "reading"]


@pytest.mark.parametrize("row", READINGS, ids=[row[0][:40] for row in READINGS])
def test_what_is_read_from_the_students_side_is_tested(row: list[str]) -> None:
    read_by, tested = re.findall(r"`([^`]+)`", row[1]), re.findall(r"`([^`]+)`", row[4])
    assert all([read_by, tested, *row])
    for name in read_by:
        assert (ROOT / "grader" / name).exists(), name
    for name in tested:
        assert _is_there(name), name


BOUNDS = {
    "stdout and stderr": (RUN.output_bytes // MB, RUN.output_lines, "ros/processes:LINE_BYTES_MAX"),
    "what bubblewrap says": ("ros/processes:INFO_BYTES_MAX",),
    "what a step hands over": (RUN.built_bytes // MB,),
    "`built.tar`": (
        RUN.built_bytes // MB, workspace.MEMBERS_MAX, workspace.HEADER_BYTES_MAX // KB,
        workspace.HEADERS_BYTES_MAX // MB, workspace.HEADERS_IN_A_ROW_MAX, len(workspace.ELF),
    ),
    "CMake's trace": (files.READ_MAX // MB, cmake.LINES_MAX, cmake.FILES_BYTES_MAX // 1000),
    "remarks on Python files": (
        python.REPORT_BYTES_MAX // MB, "lint/slips:SLIPS_LIMIT", "lint/syntax:ALL_SLIPS_LIMIT", build.STEP_S,
    ),
    "archives": (archive.MEMORY_BYTES // MB, archive.CPU_S, int(archive.WALL_S)),
    "calls of the master": (
        ("ros/rpc:HEAD_BYTES_MAX", KB), ("ros/rpc:BODY_BYTES_MAX", MB), "ros/xmlrpc_parser:ELEMENTS_MAX",
        "ros/xmlrpc_parser:DEPTH_MAX", "ros/rpc:CONNECTIONS_MAX", "ros/rpc:CALLS_HZ", "ros/rpc:MULTICALLS_MAX",
        "ros/rpc:REQUEST_S",
    ),
    "answers of nodes": (
        ("ros/bounded_sockets:ANSWER_BYTES_MAX", MB), "ros/links:CONNECTIONS_MAX", "ros/topic_recorder:CONNECT_S",
        "ros/links:BUS_INFO_S", "ros/master:NOTIFY_S", "ros/quotas:EACH_MAX",
    ),
    "connections to": (
        ("ros/tcpros:HEADER_BYTES_MAX", KB), "ros/actor:WAITING_MAX", "ros/actor:HANDSHAKE_S",
    ),
    "headers of publishers": (
        ("ros/tcpros:HEADER_BYTES_MAX", KB), "ros/tcpros:FIELD_CHARS_MAX", "ros/tcpros:DEFINITION_CHARS_MAX",
        "ros/topic_recorder:OPEN_MAX", "ros/topic_recorder:SAME_MAX", "ros/topic_recorder:CONNECT_S",
    ),
    "messages": (
        ("ros/connection:MESSAGE_BYTES_MAX", MB), RUN.channel_bytes // MB, RUN.channel_messages, RUN.channels,
        RUN.run_bytes // MB,
    ),
    "a service's answer": (("ros/tcpros:ANSWER_BYTES_MAX", MB), "ros/tcpros:WORDS_CHARS_MAX", steps.ANSWER_S),
    "names of nodes": ("ros/guard:NAME_CHARS_MAX", "ros/guard:NAMES_MAX", ("ros/guard:NAME_BYTES_MAX", KB)),
    "parameters": (
        ("ros/master:PROCESS_BYTES_MAX", MB), ("ros/master:RUN_BYTES_MAX", MB),
        "ros/master:LEVELS_MAX", ("ros/master:VALUE_BYTES_MAX", KB), "ros/master:EVENTS_MAX",
        ("ros/master:EVENTS_BYTES_MAX", MB),
    ),
    "`/proc`": ("ros/process_tree:PROCESSES_MAX", "ros/sockets:FILES_MAX"),
    "the kernel's tables": ("ros/sockets:SOCKETS_MAX", "ros/sockets:TABLE_ROWS_MAX"),
    "lines that were printed": ("ros/processes:LINE_BYTES_MAX",),
    "names that are compared": (text.NAMES_MAX, text.NAME_CHARS_MAX),
    "definitions and messages": (
        definitions.MAX_DEFINITION_BYTES, definitions.MAX_FIELDS, definitions.MAX_DEPTH,
        HELD_BYTES_MAX // MB, DECODED_BYTES_MAX // MB,
    ),
    "MCAP files": (
        FOREIGN_BYTES_MAX // MB, mcap_records.MAX_RECORDS, mcap_records.MAX_CHUNK_BYTES // MB,
        mcap_records.MAX_UNPACKED_BYTES // MB,
    ),
    "`package.xml`": (
        reading.MARKUP_LIMIT_BYTES // 10**6, launch._TAGS_MAX, launch._FILES_MAX, launch_loader.INCLUDES_MAX,
        launch_loader.DEPTH_MAX,
    ),
    "`CMakeLists.txt`": (cmake_parse.FILE_BYTES_MAX // 1000, cmake_parse.STEPS_MAX),
    "files of the package": (reading.SOURCE_LIMIT_BYTES // 10**6,),
    "files for the evidence": (recording_files.ATTACHED_BYTES_MAX // KB, recording_files.ATTACHED_FILES_MAX),
    "YAML files": (
        scenario_inputs.FILE_BYTES_MAX // KB, scenario_inputs.EVENTS_MAX, scenario_inputs.VALUES_MAX,
        scenario_inputs.DEPTH_MAX, scenario_inputs.ALIASES_MAX,
    ),
    "texts of services": (process_environment.TEXT_BYTES_MAX // KB, decode._PARTS_MAX),
    "what git says": (git._ANSWER_BYTES // MB, git._FILE_BYTES // MB, git._MEMORY_BYTES >> 30, gitdir._MAX_FILES),
}  # fmt: skip
"""By how a reading begins: the numbers in its bound, each a constant of the code, of ROS's side as `file:NAME`."""


@pytest.mark.parametrize("begin", BOUNDS)
def test_bounds_are_as_they_are(begin: str) -> None:
    (row,) = [row for row in READINGS if row[0].startswith(begin)]
    said = {float(number) for number in re.findall(r"(?<![\w.])\d+(?:\.\d+)?", row[2])}
    for bound in BOUNDS[begin]:
        name, unit = bound if isinstance(bound, tuple) else (bound, 1)
        number = _constant(name) / unit if isinstance(name, str) else name
        assert number in said, f"{name}: {number}"


def _constant(name: str) -> float:
    """`ros/rpc:REQUEST_S` from the text of the file, which only ROS's own Python imports."""
    file, _, wanted = name.partition(":")
    room = "package" if file.startswith("lint/") else "arena"
    tree = ast.parse((ROOT / "grader" / room / f"{file}.py").read_text(encoding="utf-8"))
    for node in tree.body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            many = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            for one, given in zip(target.elts, value.elts, strict=True) if many else [(target, value)]:
                if isinstance(one, ast.Name) and one.id == wanted:
                    return _number(given)
    raise AssertionError(name)


def _number(node: ast.expr) -> float:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.LShift):
        return int(_number(node.left)) << int(_number(node.right))
    return float(ast.literal_eval(node))


def _is_there(name: str) -> bool:
    if name.startswith("test_"):
        return any(
            f"def {name}(" in path.read_text(encoding="utf-8") for path in ROOT.glob("tests/**/test_*.py")
        )
    if name.endswith("-*"):
        return any((ROOT / "tests/hostile/attacks").glob(name))
    return (ROOT / name).exists()


@pytest.mark.parametrize(
    "row", [row for row in ROWS if "`test" in row[-1]], ids=lambda row: row[0].replace("/", "-")[:40]
)
def test_make_test_looks_at_every_promise(row: list[str]) -> None:
    """Of each row, a test without the marker `full`, or a kind of attacks: one of each runs."""
    names = re.findall("`(tests?[_/][^`]+)`", row[-1])
    assert any(_is_quick(name) for name in names), names


def _is_quick(name: str) -> bool:
    if not name.startswith("test_") and not name.endswith(".py"):
        return True  # a folder
    paths = ROOT.glob("tests/**/test_*.py") if name.startswith("test_") else [ROOT / name]
    wanted = f"def {name}(" if name.startswith("test_") else "\ndef test_"
    texts = (path.read_text(encoding="utf-8") for path in paths)
    return any(
        "@pytest.mark.full" not in block.rpartition("\n\n\n")[2].splitlines()
        for text in texts
        if not re.search(r"^pytestmark.*mark\.full", text, re.MULTILINE)
        for block in text.split(wanted)[:-1]
    )


def test_every_kind_of_attack_is_named() -> None:
    kinds = {path.name.split("-")[0] for path in (ROOT / "tests/hostile/attacks").iterdir()}
    named = set(re.findall(r"`([a-z]+)-\*`", TEXT))
    assert kinds == named


def test_limits_are_as_they_are() -> None:
    run, intake = RunLimits(), IntakeLimits()
    mb = 1 << 20
    together = f"all runs of a submission together {SUBMISSION_MESSAGE_BYTES // mb} MB"
    for line in (
        f"| memory | a process tree | {run.memory_bytes // mb} MB |",
        f"| a process tree | {run.processes}, {run.tasks} |",
        f"| a process tree | {run.cpu_s:g} s |",
        f"| a process tree | {run.output_lines} lines, {run.output_bytes // mb} MB |",
        f"{run.home_bytes // mb} MB and twice the workspace, {run.tmp_bytes // mb} MB, {run.shared_bytes // mb} MB",
        f"| a process tree | {run.home_files}, {run.tmp_files}, {run.shared_files} |",
        f"| a process tree | {run.descriptors} |",
        f"| {run.locked_bytes // mb} MB; {run.queued_signals} |",
        f"| buffers of sockets | a run | {run.socket_bytes // mb} MB |",
        f"| the build | {DUMP_BYTES >> 10} kB, {NAMES_MAX} names, {VALUE_BYTES >> 10} kB each |",
        f"| a process | {run.file_bytes // mb} MB; {run.open_files} |",
        f"| the build | {run.built_bytes // mb} MB |",
        f"| a channel | {run.channel_messages}, {run.channel_bytes // mb} MB |",
        f"| a run | {run.run_bytes // mb} MB, and {together}; {run.channels} |",
        f"| {intake.packed_bytes // mb} MiB; {intake.stream_bytes // mb} MiB |",
        f"| an archive or a commit on disk | {intake.total_bytes // mb} MiB |",
        f"| {intake.file_bytes // mb} MiB; {intake.recording_bytes // mb} MiB;",
        f"| {intake.material_bytes // mb} MiB;",
        f"| {intake.package_bytes // mb} MiB, {intake.package_files} files;",
        f"| {intake.entries}; {intake.folders}; {intake.links} |",
    ):
        assert line in TEXT, line
