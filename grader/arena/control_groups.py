"""Where this machine lets the grader make control groups: they hold the memory and the tasks of a whole process tree.

`enter_scope` moves this process to a delegated scope of systemd, as `systemd-run --scope -p Delegate=yes` makes one, if
students' memory could not be limited well otherwise. The process keeps its id, terminal, folder and variables. Only
processes of a person's login move. What runs in a service (cron, a CI runner, a cluster's job) stays where its
administrator put it; so does what would then be ended when its user logs out.

Sources: the kernel's documentation, admin-guide/cgroup-v2 and admin-guide/cgroup-v1/memory; man 5
org.freedesktop.systemd1 (StartTransientUnit), man 1 busctl, man 1 loginctl (enable-linger).
"""

from __future__ import annotations

import os
import re
import secrets
import subprocess
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Literal

from grader.host_programs import HOST_ENV, find_host_program
from grader.model.record import Record
from grader.portable import system

MOUNTINFO = Path("/proc/self/mountinfo")
MEMBERSHIP = Path("/proc/self/cgroup")
# No start takes so long from making a group to putting a process into it.
ABANDONED_S = 600.0
KEYS = {
    ("memory", 1): "memory.limit_in_bytes",
    ("memory", 2): "memory.max",
    ("pids", 1): "pids.max",
    ("pids", 2): "pids.max",
    ("cpuacct", 1): "cpuacct.usage",
    ("cpuacct", 2): "cpu.stat",
}
WEAKER = (
    "no control group of this process can be written, so memory, sockets' buffers and files in memory are looked at "
    "twice a second, and of what the kernel keeps for pipes and other descriptors only their number is bounded"
)
WEAKER_CPU = "CPU time of children that were not waited for is not counted"


class Cgroup(Record):
    """One controller: new groups are made below `folder`."""

    version: Literal[1, 2]
    folder: str


class Cgroups(Record):
    """The controllers that can be used, None for one that cannot."""

    memory: Cgroup | None = None
    pids: Cgroup | None = None
    cpuacct: Cgroup | None = None

    @property
    def label(self) -> str:
        return f"cgroup v{self.memory.version}" if self.memory else "a watchdog"


@lru_cache(maxsize=1)
def find_cgroups() -> Cgroups:
    """Return the control groups that work here: a group is made, limited and removed to see it."""
    return Cgroups(memory=_find("memory"), pids=_find("pids"), cpuacct=_find("cpuacct"))


def remove_groups(cgroups: Cgroups, arena: int) -> bool:
    """Remove the groups that an arena left which was killed, by its process id. False while processes are in them."""
    found = filter(None, (cgroups.memory, cgroups.pids, cgroups.cpuacct))
    groups = [group for one in found for group in Path(one.folder).glob(f"grader-{arena}-*")]
    for group in groups:
        with suppress(OSError):
            group.rmdir()
    return not any(group.exists() for group in groups)


def describe() -> str:
    """Return for `grader doctor` what limits memory and tasks, and what is weaker where no control group does."""
    found = find_cgroups()
    memory = f"memory by {found.label}"
    tasks = f"tasks by cgroup v{found.pids.version}" if found.pids else "tasks by rlimits and a watchdog"
    counted = "" if found.cpuacct else f"; {WEAKER_CPU}"
    return f"{memory}, {tasks}; {_where(found.memory)}{counted}"


def has_memory() -> bool:
    """Return whether groups of version 2 can hold memory on this machine at all."""
    there = [Path(mount[4], "cgroup.controllers") for mount in _mounts() if _type(mount) == "cgroup2"]
    return any("memory" in path.read_text().split() for path in there if path.is_file())


def own_group() -> str:
    """Return the name of this process's group of version 2; empty where there is none."""
    return next((path for _, names, path in _memberships() if names == ""), "")


def _where(memory: Cgroup | None) -> str:
    if memory is None:
        return WEAKER
    if memory.version == 2 and (Path(memory.folder) / LEAF).is_dir():
        return f"in {Path(memory.folder).name}, which was delegated to the grader"
    return "below its own group"


def _find(controller: str) -> Cgroup | None:
    for version, own in own_groups(controller):
        folder = place_for_runs(own) if version == 2 else own
        _sweep(folder)
        if _usable(folder, KEYS[controller, version]):
            return Cgroup(version=version, folder=str(folder))
    return None


def own_groups(controller: str) -> list[tuple[Literal[1, 2], Path]]:
    """Return this process's group as a folder, for each hierarchy that may have the controller."""
    mounts = _mounts()
    found: list[tuple[Literal[1, 2], Path]] = []
    for _, names, path in _memberships():
        if names == "":
            found += [(2, _below(m, path)) for m in mounts if _type(m) == "cgroup2"]
        elif controller in names.split(","):
            found += [
                (1, _below(m, path))
                for m in mounts
                if _type(m) == "cgroup" and controller in m[-1].split(",")
            ]
    return found


def _mounts() -> list[list[str]]:
    try:
        return [line.split() for line in MOUNTINFO.read_text().splitlines()]
    except OSError:
        return []


def _memberships() -> list[list[str]]:
    """Return the number, controllers and path of each group of this process; version 2 names no controllers."""
    try:
        return [line.split(":", 2) for line in MEMBERSHIP.read_text().splitlines()]
    except OSError:
        return []


def _type(mount: list[str]) -> str:
    """Return the file system of a line of mountinfo (man 5 proc_pid_mountinfo): the first field after the dash."""
    return mount[mount.index("-") + 1] if "-" in mount else ""


def _below(mount: list[str], path: str) -> Path:
    """Return where the group `path` is below a mount point, whose own root may be a group already."""
    root, point = mount[3], Path(mount[4])
    inside = os.path.relpath(path, root) if path.startswith(root) else "."
    return point / inside


def _sweep(folder: Path) -> None:
    """Remove what a killed arena left: its groups are empty, and too old to be just made."""
    for group in folder.glob("grader-*"):
        with suppress(OSError):  # someone's processes are in it, or it is gone
            if time.time() - group.stat().st_mtime > ABANDONED_S:
                group.rmdir()


def _usable(folder: Path, key: str) -> bool:
    trial = folder / f"grader-trial-{secrets.token_hex(4)}"
    try:
        trial.mkdir()
    except OSError:
        return False
    try:
        # It is only read: there is nothing to limit.
        if key.partition(".")[0].startswith("cpu"):
            return (trial / key).is_file()
        (trial / key).write_text("1073741824" if key.startswith("memory") else "512")
    except OSError:
        return False
    finally:
        with suppress(OSError):  # an empty group of ours: it hurts no one if it stays
            trial.rmdir()
    return True


# A control group of version 2 that belongs to the grader is made ready: groups of runs can be made in it.
#
# The kernel lets a group have either processes, or controllers for the groups below it. So the grader's own processes
# move into a group of their own, and those of the runs are made beside it.
#
# Sources: the kernel's documentation, admin-guide/cgroup-v2 ("No Internal Process Constraint");
# systemd.io/CGROUP_DELEGATION.

LEAF = "grader-main"
PROCESSES = "cgroup.procs"
SWITCHED_ON = "cgroup.subtree_control"
CONTROLLERS = ("memory", "pids")
MARKS = ("user.delegate", "trusted.delegate")
"""How systemd marks what it leaves alone. The second can be read by root only, and older versions have no other."""
SCOPES = re.compile(r"(grader|run)-[\w-]+\.scope")
"""Those that the grader asks for (`enter_scope`), and those of `systemd-run --scope`."""
USERS_OWN = "/user@"
"""Below it all groups are the user's, also those that the user's systemd manages."""
SYSTEMD = Path("/run/systemd/system")
ROUNDS = 5


def place_for_runs(own: Path) -> Path:
    """Return where groups of runs are to be made, given this process's group, and make it ready where that is
    allowed."""
    # This process has moved already, or comes of one that has.
    if own.name == LEAF:
        return own.parent
    with suppress(OSError):  # it stays as it was: `cgroups._usable` finds out what it can do
        if _lacks_memory(own) and _belongs_to_the_grader(own):
            _make_ready(own)
    return own


def _lacks_memory(group: Path) -> bool:
    """Return whether groups below it cannot have a memory limit now, but could be given one."""
    could, can = ((group / name).read_text().split() for name in ("cgroup.controllers", SWITCHED_ON))
    return "memory" in could and "memory" not in can


def _belongs_to_the_grader(group: Path) -> bool:
    """Return whether no other program manages it, and no other program's processes are in it."""
    free = not SYSTEMD.exists() or SCOPES.fullmatch(group.name) is not None
    return (free or _handed_over(group)) and _all_ours(group, _processes(group))


def _handed_over(group: Path) -> bool:
    """Return whether all of the group is for what runs in it: by systemd's word, by root's, or because it is a
    container's."""
    for mark in MARKS:
        with suppress(OSError):
            if os.getxattr(group, mark) == b"1":
                return True
    given = group.stat().st_uid == os.geteuid() != 0 and USERS_OWN not in str(group)
    # the machine's own root group has no `cgroup.type`
    containers = os.path.ismount(group) and (group / "cgroup.type").exists()
    return given or containers


def _all_ours(group: Path, pids: list[int]) -> bool:
    """Return whether all of these are this process or its children; in a group that was handed over, or its parents."""
    own = os.getpid()
    ours = {own, *(_ancestors(own) if _handed_over(group) else ())}
    return all(pid in ours or own in _ancestors(pid) for pid in pids)


def _ancestors(pid: int) -> Iterator[int]:
    """Yield the parents that this process can see: a parent outside of its PID namespace has the number 0."""
    with suppress(OSError, IndexError):
        while pid := int(Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()[1]):
            yield pid


def _make_ready(group: Path) -> None:
    """Raises OSError where that is not possible; then all is as before."""
    leaf = group / LEAF
    leaf.mkdir(exist_ok=True)
    try:
        for _ in range(ROUNDS):  # processes started since the last look are in it, too
            if not (pids := _processes(group)) or not _all_ours(group, pids):
                break
            _move(pids, leaf)
        there = (group / "cgroup.controllers").read_text().split()
        (group / SWITCHED_ON).write_text(" ".join(f"+{name}" for name in CONTROLLERS if name in there))
    except OSError:
        _move(_processes(leaf), group)
        leaf.rmdir()
        raise


def _processes(group: Path) -> list[int]:
    return [int(pid) for pid in (group / PROCESSES).read_text().split()]


def _move(pids: list[int], group: Path) -> None:
    for pid in pids:
        with suppress(ProcessLookupError):  # it has ended
            (group / PROCESSES).write_text(str(pid))


LOGINS = "/user.slice/"
LINGER = Path("/var/lib/systemd/linger")
RUNTIME = Path("/run/user")
ANSWER_S = 5
METHOD = (
    "org.freedesktop.systemd1", "/org/freedesktop/systemd1", "org.freedesktop.systemd1.Manager", "StartTransientUnit",
    "ssa(sv)a(sa(sv))",
)  # fmt: skip

DELEGATED = ("Delegate", "b", "true", "CollectMode", "s", "inactive-or-failed")


def enter_scope() -> None:
    """Move this process to a scope of its own if its groups cannot limit memory and systemd grants one.

    Raises nothing.
    """
    if system() or not SYSTEMD.exists():
        return
    if find_cgroups().memory is None and has_memory() and _may_move() and _move_to_scope():
        find_cgroups.cache_clear()


def _may_move() -> bool:
    own = own_group()
    if not own.startswith(LOGINS):
        return False
    user = os.geteuid()
    return user == 0 or f"/user@{user}.service/" in own or _lingers(user)


def _lingers(user: int) -> bool:
    """Return whether the user's services continue after logging out."""
    import pwd  # noqa: PLC0415 - not on Windows

    with suppress(KeyError, OSError):
        return (LINGER / pwd.getpwuid(user).pw_name).exists()
    return False


def _move_to_scope() -> bool:
    """Ask for the move and wait until it is done: the answer only says that it will be."""
    busctl, pid = find_host_program("busctl"), os.getpid()
    if busctl is None:
        return False
    scope = f"grader-{pid}-{secrets.token_hex(4)}.scope"
    manager = "--system" if os.geteuid() == 0 else "--user"
    call = [busctl, manager, f"--timeout={ANSWER_S}", "call", *METHOD]
    properties = ["PIDs", "au", "1", str(pid), *DELEGATED]
    try:
        subprocess.run(
            [*call, scope, "fail", "3", *properties, "0"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=True,
            timeout=ANSWER_S + 1,
            env={**HOST_ENV, "XDG_RUNTIME_DIR": str(RUNTIME / str(os.geteuid()))},
            cwd="/",
        )
    except (OSError, subprocess.SubprocessError):
        return False
    until = time.monotonic() + ANSWER_S
    while not own_group().endswith(f"/{scope}") and time.monotonic() < until:
        time.sleep(0.01)
    return own_group().endswith(f"/{scope}")
