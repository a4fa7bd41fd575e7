"""A control group of version 2 that belongs to the grader is made ready: groups of runs can be made in it.

The kernel lets a group have either processes, or controllers for the groups below it. So the grader's own processes
move into a group of their own, and those of the runs are made beside it.

Sources: the kernel's documentation, admin-guide/cgroup-v2 ("No Internal Process Constraint");
systemd.io/CGROUP_DELEGATION.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

LEAF = "grader-main"
PROCESSES = "cgroup.procs"
SWITCHED_ON = "cgroup.subtree_control"
CONTROLLERS = ("memory", "pids")
MARKS = ("user.delegate", "trusted.delegate")
"""How systemd marks what it leaves alone. The second can be read by root only, and older versions have no other."""
SCOPES = re.compile(r"(grader|run)-[\w-]+\.scope")
"""Those that the grader asks for (`cli/scope.py`), and those of `systemd-run --scope`."""
USERS_OWN = "/user@"
"""Below it all groups are the user's, also those that the user's systemd manages."""
SYSTEMD = Path("/run/systemd/system")
ROUNDS = 5


def place_for_runs(own: Path) -> Path:
    """Where groups of runs are to be made, for the group that this process is in; it is made ready where it may be."""
    if own.name == LEAF:
        return own.parent
    with suppress(OSError):  # it stays as it was: `cgroups._usable` finds out what it can do
        if _lacks_memory(own) and _belongs_to_the_grader(own):
            _make_ready(own)
    return own


def _lacks_memory(group: Path) -> bool:
    """Groups below it cannot be limited, and could be."""
    could, can = ((group / name).read_text().split() for name in ("cgroup.controllers", SWITCHED_ON))
    return "memory" in could and "memory" not in can


def _belongs_to_the_grader(group: Path) -> bool:
    """Nobody else manages it, and nobody else's processes are in it."""
    free = not SYSTEMD.exists() or SCOPES.fullmatch(group.name) is not None
    return (free or _handed_over(group)) and _all_ours(group, _processes(group))


def _handed_over(group: Path) -> bool:
    """All of it is for what runs in it: systemd says so, root gave it to this user, or it is a container's."""
    for mark in MARKS:
        with suppress(OSError):
            if os.getxattr(group, mark) == b"1":
                return True
    given = group.stat().st_uid == os.geteuid() != 0 and USERS_OWN not in str(group)
    containers = (
        os.path.ismount(group) and (group / "cgroup.type").exists()
    )  # the machine's own root has none
    return given or containers


def _all_ours(group: Path, pids: list[int]) -> bool:
    """This process and what it started; in a group that was handed over, what started it, too."""
    own = os.getpid()
    ours = {own, *(_ancestors(own) if _handed_over(group) else ())}
    return all(pid in ours or own in _ancestors(pid) for pid in pids)


def _ancestors(pid: int) -> Iterator[int]:
    """Those that this process can see: the number of one outside of its namespace is 0."""
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
