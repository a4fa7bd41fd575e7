"""What the grader asks for is what systemd understands: its own manager of users runs in namespaces of its own."""

from __future__ import annotations

import os
import secrets
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

MANAGER = Path("/usr/lib/systemd/systemd")
HIERARCHIES = (Path("/sys/fs/cgroup/unified"), Path("/sys/fs/cgroup/systemd"))
ROOM = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--propagation", "private"]
GONE_S = 300.0
READY_S = 300.0

SCRIPT = """
set -e
for group in "$@"; do echo 0 > $group/cgroup.procs; done
mount -t tmpfs tmpfs /run
mkdir -p /run/systemd/system
mkdir -p -m 700 /run/user/1000
export XDG_RUNTIME_DIR=/run/user/1000 HOME=/run/user/1000
{manager} --user --unit=dbus.service --log-target=null > /run/log 2>&1 &
mkdir $1/login
echo 0 > $1/login/cgroup.procs
{python} -c "$PROGRAM" || exit 1  # not the first process of its namespace: systemd takes that for another manager
"""
PROGRAM = """
import os, subprocess, sys, time
from pathlib import Path
from grader.arena import control_groups
from grader.arena import control_groups as scope
asks = ["busctl", "--user", "--timeout=1", "--acquired", "--no-pager", "list"]
until = time.monotonic() + float(os.environ["READY_S"])
while b"org.freedesktop.systemd1 " not in subprocess.run(asks, capture_output=True).stdout and time.monotonic() < until:
    time.sleep(0.05)
# this machine's groups of version 2 hold no memory, and this process is root's in no login
os.geteuid = lambda: 1000
scope.LOGINS, scope.has_memory, scope._lingers = "/", lambda: True, lambda user: True
control_groups.find_cgroups.cache_clear()
scope.find_cgroups = lambda: control_groups.Cgroups()
scope.find_cgroups.cache_clear = lambda: None
pid = os.getpid()
scope.enter_scope()
print(control_groups.own_group(), pid == os.getpid())
(own,) = [folder for version, folder in control_groups.own_groups("none") if version == 2]
print(control_groups._belongs_to_the_grader(own))
control_groups._make_ready(own)
print(control_groups.own_group(), control_groups._processes(own))
"""


@pytest.fixture
def groups() -> Iterator[list[Path]]:
    """One in each hierarchy that systemd uses here."""
    if os.geteuid() or not MANAGER.exists() or shutil.which("dbus-daemon") is None:
        pytest.skip("needs root, systemd and dbus")
    if not all((folder / "cgroup.procs").exists() for folder in HIERARCHIES):
        pytest.skip("needs control groups as systemd's hybrid mode has them")
    name = f"grader-systemd-{secrets.token_hex(6)}"
    made = [folder / name for folder in HIERARCHIES]
    for group in made:
        group.mkdir()
    yield made
    until = time.monotonic() + GONE_S
    for group in made:
        while any(path.read_text() for path in group.rglob("cgroup.procs")) and time.monotonic() < until:
            time.sleep(0.05)
        for folder in (*sorted(filter(Path.is_dir, group.rglob("*")), reverse=True), group):
            folder.rmdir()


@pytest.mark.slow
def test_systemd_gives_the_scope_that_is_asked_for(groups: list[Path]) -> None:
    script = SCRIPT.format(manager=MANAGER, python=sys.executable)
    done = subprocess.run(
        [*ROOM, "/bin/sh", "-c", script, "sh", *map(str, groups)],
        env={
            **os.environ,
            "PROGRAM": PROGRAM,
            "READY_S": str(READY_S),
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    scope, belongs, leaf = done.stdout.splitlines()
    name, same = scope.split()
    assert name.startswith(f"/{groups[0].name}/app.slice/grader-")
    assert (same, belongs) == ("True", "True")
    assert leaf.split() == [f"{name}/grader-main", "[]"]
