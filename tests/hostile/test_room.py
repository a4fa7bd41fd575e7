"""The checks of a room can fail: the same attacks without a sandbox, and reports of what must not be."""

from __future__ import annotations

import re

import pytest

from tests.hostile.form import Run
from tests.hostile.harness import faults, grade_in_room, machine_faults, why_no_room
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
