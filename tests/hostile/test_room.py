"""The checks of a room can fail: the same attacks without a sandbox, and reports of what must not be."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest

from tests.hostile.form import Run, load_attack
from tests.hostile.harness import (
    document_faults,
    faults,
    grade_in_room,
    machine_faults,
    wall_faults,
    was_refused,
    why_no_room,
)
from tests.hostile.outputs import control_characters, secrets_in

SOUND = {
    "changed": [], "scratch": [], "shared": [], "processes": [], "sockets": [], "groups": [], "settings": [],
    "asked": [], "odd": [], "packets": 0, "late": False, "wall_s": 1.0, "memory_bytes": 1, "disk_bytes": 1,
    "machine_bytes": 1,
}  # fmt: skip
WITHOUT_SANDBOX = {
    "read-everything": [r"harm was done: .*marks\.csv", r"a secret is in an output: console\.log"],
    "disk-outside": [r"harm was done: .*wrote into", r"files changed outside", r"left in \$TMPDIR"],
    "net-services": [
        r"services of the machine were asked",
        r"packets were sent",
        r"harm was done: .*service-port",
    ],
}


def test_a_sound_report_has_no_faults() -> None:
    assert list(machine_faults(SOUND)) == []


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *((key, ["one"]) for key, value in SOUND.items() if value == []),
        ("packets", 1),
        ("late", True),
        ("memory_bytes", 300 << 20),
        ("disk_bytes", 200 << 20),
        ("machine_bytes", 1600 << 20),
    ],
)
def test_each_finding_is_a_fault(key, value) -> None:
    assert len(list(machine_faults(SOUND | {key: value}))) == 1


def test_secrets_and_escape_codes_are_found(tmp_path) -> None:
    (tmp_path / "report.md").write_text("a \x1b[2J b")
    (tmp_path / "other.bin").write_bytes(b"xx SECRET-shadow yy")
    assert list(secrets_in("SECRET", tmp_path, {"stdout": "SECRET"})) == ["other.bin : -shadow", "stdout: "]
    assert [line.partition(":")[0] for line in control_characters(tmp_path, {"stderr": "\x9b"})] == [
        "stderr",
        "report.md",
    ]


def test_a_platform_that_is_told_something_else_is_a_fault() -> None:
    result = SimpleNamespace(points=40)
    assert list(document_faults({"score": 40}, result)) == []
    for told in ({"score": 100}, {}, None, [40]):
        assert len(list(document_faults(told, result))) == 1


@pytest.mark.parametrize(
    ("container", "groups", "said", "count"),
    [
        (False, "with", "bubblewrap, unprivileged; memory held by cgroup v1", 0),
        (False, "without", "bubblewrap, unprivileged; memory held by a watchdog", 0),
        (True, "found", "none (it is forbidden); memory held by cgroup v1", 0),
        (False, "found", "none (it is forbidden); memory held by cgroup v1", 1),
        (True, "found", "bubblewrap, unprivileged; memory held by a watchdog", 1),
        (False, "with", "bubblewrap, unprivileged; memory held by a watchdog", 1),
        (False, "without", "bubblewrap, unprivileged; memory held by cgroup v1", 1),
    ],
)
def test_another_sandbox_than_was_wanted_is_a_fault(container, groups, said, count) -> None:
    attack = SimpleNamespace(arguments=(), container=container)
    result = SimpleNamespace(environment=SimpleNamespace(sandbox=said), error=None)
    graded = SimpleNamespace(result=result, run=Run("ordinary", groups))
    assert len(list(wall_faults(attack, graded))) == count


def test_only_the_words_that_an_attack_names_excuse_it_from_being_graded() -> None:
    attack = load_attack("start-few-processes")
    said = {"exit_code": 3, "stdout": "", "stderr": "the limits are too short: ulimit -u"}
    assert was_refused(attack, said)
    assert not was_refused(attack, said | {"exit_code": 1})
    assert not was_refused(attack, said | {"stderr": "no such file"})
    assert not was_refused(load_attack("bomb-memory"), said)


@pytest.mark.full
@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize("name", WITHOUT_SANDBOX)
def test_without_a_sandbox_the_harm_is_seen(name, tmp_path) -> None:
    if reason := why_no_room():
        pytest.skip(reason)
    graded = grade_in_room(name, Run("root", "found"), tmp_path, arguments=["--sandbox", "none"])
    found = "\n".join(faults(name, graded))
    for pattern in WITHOUT_SANDBOX[name]:
        assert re.search(pattern, found), f"nothing like {pattern!r} in:\n{found}"
