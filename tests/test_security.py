"""SECURITY.md names the test of each promise, and the limits as they are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grader.arena.limits import SUBMISSION_MESSAGE_BYTES
from grader.arena.limits import Limits as RunLimits
from grader.arena.ros_env import DUMP_BYTES, NAMES_MAX, VALUE_BYTES
from grader.intake.limits import Limits as IntakeLimits

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
    return [ROOT / "grader", *(path for path in (ROOT / "grader").rglob("*") if path.is_dir())]


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


def _is_there(name: str) -> bool:
    if name.startswith("test_"):
        return any(
            f"def {name}(" in path.read_text(encoding="utf-8") for path in ROOT.glob("tests/**/test_*.py")
        )
    if name.endswith("-*"):
        return any((ROOT / "tests/hostile/attacks").glob(name))
    return (ROOT / name).exists()


def test_every_kind_of_attack_is_named() -> None:
    kinds = {path.name.split("-")[0] for path in (ROOT / "tests/hostile/attacks").iterdir()}
    named = set(re.findall(r"`([a-z]+)-\*`", TEXT))
    assert kinds == named


def test_limits_are_as_they_are() -> None:
    run, intake = RunLimits(), IntakeLimits()
    mb = 1 << 20
    together = f"all runs of a submission together {SUBMISSION_MESSAGE_BYTES // mb} MB"
    for text in (
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
        assert text in TEXT, text
