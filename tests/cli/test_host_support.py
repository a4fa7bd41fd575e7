"""`grader doctor` on what is missing of the sandbox."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from grader import host_programs
from grader.arena import control_groups
from grader.arena.control_groups import Cgroup, Cgroups
from grader.arena.sandbox import Sandbox
from grader.cli import host_support
from grader.cli.host_support import DoctorRow, diagnose
from grader.errors import HostError, SandboxMissing


def rows() -> dict[str, DoctorRow]:
    return {row.name: row for row in host_support.sandbox_rows()}


def test_every_part_has_a_row_and_what_is_missing_a_command() -> None:
    found = rows()
    assert [name for name in found if name != "pids.max"] == [
        "bwrap", "setpriv", "prlimit", "user namespaces", "network", "limits", "ulimit -u", "ulimit -n", "ulimit -v",
        "ulimit -d", "ulimit -s", "ulimit -f", "ulimit -t", "ulimit", "sandbox",
    ]  # fmt: skip
    assert all(row.fix for row in found.values() if row.state != "ok")


@pytest.mark.parametrize(("program", "package"), [("bwrap", "bubblewrap"), ("setpriv", "util-linux")])
def test_a_program_that_is_not_installed(monkeypatch, program: str, package: str) -> None:
    monkeypatch.setattr(
        host_support, "find_host_program", lambda name: None if name == program else f"/usr/bin/{name}"
    )
    none = Sandbox(bubblewrap=False, uid=None, reason=f"{program} is not installed")
    monkeypatch.setattr(host_support, "choose_sandbox", lambda _: none)
    found = rows()
    assert (found[program].state, found[program].fix) == ("limited", f"apt-get install {package}")
    assert found["sandbox"].state == "limited"
    assert f"has no sandbox ({program} is not installed): students' code runs" in found["sandbox"].detail


@pytest.mark.parametrize(
    ("name", "value", "fix"),
    [
        ("kernel/unprivileged_userns_clone", "0", "sysctl -w kernel.unprivileged_userns_clone=1"),
        ("user/max_user_namespaces", "0", "sysctl -w user.max_user_namespaces=10000"),
        (
            "kernel/apparmor_restrict_unprivileged_userns",
            "1",
            "kernel.apparmor_restrict_unprivileged_userns=0",
        ),
        ("user/max_user_namespaces", "1000", "--security-opt seccomp=unconfined"),
    ],
)
def test_namespaces_that_are_forbidden(monkeypatch, tmp_path: Path, name: str, value: str, fix: str) -> None:
    (tmp_path / name).parent.mkdir()
    (tmp_path / name).write_text(f"{value}\n")
    refused = subprocess.CompletedProcess([], 1, b"", b"unshare: unshare failed: Operation not permitted\n")
    monkeypatch.setattr(host_support, "SETTINGS", tmp_path)
    monkeypatch.setattr(host_programs.subprocess, "run", lambda *_args, **_more: refused)
    row = host_support._probe("user namespaces", ["unshare"])
    assert (row.state, row.detail) == ("limited", "unshare: unshare failed: Operation not permitted")
    assert fix in row.fix


def test_a_probe_that_does_not_answer_is_not_taken_for_a_machine_without(monkeypatch) -> None:
    def no_answer(_mode: str) -> None:
        raise SandboxMissing("no answer within 20 s", hint="look at each part")

    monkeypatch.setattr(host_support, "choose_sandbox", no_answer)
    row = rows()["sandbox"]
    assert (row.state, row.detail, row.fix) == ("missing", "no answer within 20 s", "look at each part")


@pytest.mark.parametrize(
    ("user", "could", "fix"),
    [
        (1000, True, host_support.DELEGATE),
        (1000, False, host_support.OLD_GROUPS),
        (0, True, host_support.ROOTS_GROUPS),
    ],
)
def test_what_holds_memory_where_no_group_can_be_made(monkeypatch, user: int, could: bool, fix: str) -> None:
    for module in (host_support, control_groups):
        monkeypatch.setattr(module, "find_cgroups", Cgroups)
    monkeypatch.setattr(host_support, "user_id", lambda: user)
    monkeypatch.setattr(host_support, "has_memory", lambda: could)
    row = host_support._limits_of_trees()
    assert (row.state, row.fix) == ("limited", fix)
    assert "looked at twice a second" in row.detail
    assert "children that were not waited for is not counted" in row.detail


def test_what_holds_memory_where_groups_can_be_made(monkeypatch) -> None:
    held = Cgroups(memory=Cgroup(version=2, folder="/sys/fs/cgroup"))
    for module in (host_support, control_groups):
        monkeypatch.setattr(module, "find_cgroups", lambda: held)
    row = host_support._limits_of_trees()
    assert (row.state, row.fix) == ("ok", "")
    assert "memory by cgroup v2, tasks by rlimits and a watchdog; below its own group" in row.detail


def test_limits_that_cannot_be_set_keep_everything_from_being_graded(monkeypatch) -> None:
    def refuses(_mode: str) -> None:
        raise HostError("the limits cannot be set", hint="raise them")

    monkeypatch.setattr(host_support, "refused_limits", lambda: "prlimit: Operation not permitted")
    monkeypatch.setattr(host_support, "choose_sandbox", refuses)
    found = rows()
    assert (found["ulimit"].state, found["ulimit"].detail) == ("missing", "prlimit: Operation not permitted")
    assert (found["sandbox"].state, found["sandbox"].fix) == ("missing", "raise them")


@pytest.mark.parametrize(
    ("value", "state"),
    [("/usr/lib", "ok"), (":/usr/lib", "limited"), ("/a::/b", "limited"), ("lib", "limited")],
)
def test_an_entry_that_stands_for_the_current_folder_is_named(value, state, monkeypatch) -> None:
    monkeypatch.setenv("LD_LIBRARY_PATH", value)
    (row,) = (row for row in diagnose() if row.name == "search paths")
    assert row.state == state
    assert ("LD_LIBRARY_PATH" in row.detail) == (state != "ok")
