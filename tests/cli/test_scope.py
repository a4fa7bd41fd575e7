"""A command that runs students' code asks systemd for a control group of its own, where it has none."""

from __future__ import annotations

import os
import pwd
from pathlib import Path
from typing import NamedTuple

import pytest

from grader import host_programs
from grader.arena import control_groups
from grader.arena.control_groups import LEAF
from grader.cli import main
from tests.arena.fake_groups import FakeGroups

SYSTEMD = """#!/bin/sh
printf '%s\\n' "$@" > {notes}/asked
env > {notes}/env; pwd > {notes}/cwd; echo >> {notes}/times
for word; do case "$word" in grader-*.scope) scope=$word;; esac; done
new={groups}/user.slice/$scope; mkdir $new; cd $new
echo memory pids > cgroup.controllers; : > cgroup.subtree_control; echo {pid} > cgroup.procs
: > {groups}/{session}/cgroup.procs
echo 0::/user.slice/$scope > {notes}/cgroup
"""
LOGIN = "user.slice/user-61000.slice/session-3.scope"


class Account(NamedTuple):
    pw_name: str


class Machine:
    """Booted by systemd, with this process in a login's group of version 2; `busctl` is a stand-in that moves it."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder = folder
        self._patch = monkeypatch
        self.groups = FakeGroups(folder / "groups", monkeypatch)
        for name in ("bin", "runtime", "linger", "systemd"):
            (folder / name).mkdir()
        monkeypatch.setattr(control_groups, "SYSTEMD", folder / "systemd")
        monkeypatch.setattr(control_groups, "SYSTEMD", folder / "systemd")
        monkeypatch.setattr(control_groups, "LINGER", folder / "linger")
        monkeypatch.setattr(control_groups, "RUNTIME", folder / "runtime")
        monkeypatch.setattr(control_groups, "MOUNTINFO", folder / "mountinfo")
        monkeypatch.setattr(control_groups, "MEMBERSHIP", folder / "cgroup")
        monkeypatch.setattr(pwd, "getpwuid", self._account)
        monkeypatch.setattr(host_programs, "HOST_PATH", str(folder / "bin"))
        (folder / "mountinfo").write_text(
            f"31 20 0:27 / {folder / 'groups'} rw,nosuid - cgroup2 cgroup rw,nsdelegate\n"
        )
        self.user(0)
        self.stays_in(LOGIN)

    @staticmethod
    def _account(number: int) -> Account:
        if number != 61000:
            raise KeyError(number)
        return Account("lecturer")

    def user(self, number: int) -> None:
        self._patch.setattr(os, "geteuid", lambda: number)

    def stays_in(self, group: str, *, script: str = SYSTEMD) -> None:
        self.groups.group(group, os.getpid(), 1)
        (self.folder / "cgroup").write_text(f"0::/{group}\n")
        busctl = self.folder / "bin" / "busctl"
        words = {"notes": self.folder, "groups": self.groups.root, "session": group, "pid": os.getpid()}
        busctl.write_text(script.format(**words))
        busctl.chmod(0o755)

    def noted(self, name: str) -> list[str]:
        path = self.folder / name
        return path.read_text().splitlines() if path.exists() else []


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    control_groups.find_cgroups.cache_clear()
    host_programs.find_host_program.cache_clear()
    yield Machine(tmp_path, monkeypatch)
    control_groups.find_cgroups.cache_clear()
    host_programs.find_host_program.cache_clear()


def test_memory_is_held_by_a_scope_of_its_own_afterwards(machine: Machine) -> None:
    assert control_groups.find_cgroups().memory is None
    control_groups.enter_scope()
    found = control_groups.find_cgroups().memory
    assert found is not None
    own = Path(found.folder)
    assert own.name.startswith(f"grader-{os.getpid()}-")
    assert machine.groups.pids(own / LEAF) == [os.getpid()]


def test_what_systemd_is_asked_for(machine: Machine) -> None:
    control_groups.enter_scope()
    asked = machine.noted("asked")
    name = next(word for word in asked if word.endswith(".scope"))
    assert asked == [
        "--system", "--timeout=5", "call", "org.freedesktop.systemd1", "/org/freedesktop/systemd1",
        "org.freedesktop.systemd1.Manager", "StartTransientUnit", "ssa(sv)a(sa(sv))", name, "fail",
        "3", "PIDs", "au", "1", str(os.getpid()), "Delegate", "b", "true", "CollectMode", "s", "inactive-or-failed",
        "0",
    ]  # fmt: skip


def test_nothing_of_whoever_grades_reaches_it(machine: Machine, monkeypatch) -> None:
    monkeypatch.setenv("LD_LIBRARY_PATH", "/students")
    monkeypatch.setenv("DBUS_SESSION_BUS_ADDRESS", "unix:path=/students")
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/students")
    control_groups.enter_scope()
    assert machine.noted("cwd") == ["/"]
    env = dict(line.split("=", 1) for line in machine.noted("env"))
    shells = {"PWD", "OLDPWD", "SHLVL", "_"}
    assert {name: value for name, value in env.items() if name not in shells} == {
        **host_programs.HOST_ENV,
        "XDG_RUNTIME_DIR": str(machine.folder / "runtime" / "0"),
    }


def test_it_happens_once(machine: Machine) -> None:
    control_groups.enter_scope()
    control_groups.enter_scope()
    assert len(machine.noted("times")) == 1


@pytest.mark.parametrize(
    ("user", "group", "lingers", "asked"),
    [
        (0, LOGIN, False, "--system"),
        (0, "system.slice/cron.service", False, None),  # its administrator put it there
        (61000, "system.slice/slurmstepd.scope/job_7", True, None),
        (61000, LOGIN, False, None),  # it would end when its user logs out
        (61000, LOGIN, True, "--user"),
        (61001, LOGIN, True, None),
        (61000, "user.slice/user-61000.slice/user@61000.service/app.slice/vte-7.scope", False, "--user"),
        (61000, "user.slice/user-61001.slice/user@61001.service/app.slice/vte-7.scope", False, None),
    ],
)
def test_only_logins_are_left_for_a_scope(
    machine: Machine, user: int, group: str, lingers: bool, asked: str | None
) -> None:
    if group != LOGIN:
        machine.stays_in(group)
    machine.user(user)
    if lingers:
        (machine.folder / "linger" / "lecturer").touch()
    control_groups.enter_scope()
    assert machine.noted("asked")[:1] == ([] if asked is None else [asked])


@pytest.mark.full
@pytest.mark.parametrize(
    "script", ["#!/bin/sh\nexit 1\n", "#!/bin/sh\nexec sleep 60\n", "#!/bin/sh\n", "\x7f"]
)
def test_where_systemd_gives_none_all_stays_as_it_was(machine: Machine, monkeypatch, script: str) -> None:
    monkeypatch.setattr(control_groups, "ANSWER_S", 0.2)
    (machine.folder / "bin" / "busctl").write_text(script)
    control_groups.enter_scope()
    assert control_groups.find_cgroups().memory is None
    assert control_groups.own_group() == f"/{LOGIN}"


@pytest.mark.parametrize("missing", ["systemd", "bin/busctl", "memory"])
def test_where_it_cannot_be_had_nothing_is_asked(machine: Machine, missing: str) -> None:
    if missing == "memory":
        (machine.folder / "groups" / "cgroup.controllers").unlink()
    else:
        (machine.folder / missing).rename(machine.folder / "gone")
    control_groups.enter_scope()
    assert machine.noted("asked") == []


@pytest.mark.parametrize(
    ("argv", "enters"),
    [
        (["check", "--static", "/nowhere"], False),
        (["check", "/nowhere"], True),
        (["grade", "/nowhere", "--rubric", "nothing"], True),
        (["doctor"], True),
        (["labs"], False),
    ],
)
def test_only_commands_that_run_students_code_ask(monkeypatch, argv: list[str], enters: bool) -> None:
    entered: list[bool] = []
    monkeypatch.setattr(control_groups, "enter_scope", lambda: entered.append(True))
    main.run(argv)
    assert bool(entered) == enters
