"""The limits that the grader inherits from the shell, service or container that started it, against what a run needs.

Students' processes inherit them too. Under a limit that is too short, a node that cannot start its threads loses marks
for its student, so nothing is run there. Standard library only, and asked early: what short limits break includes the
loading of the grader itself.
"""

from __future__ import annotations

import os
import re
import resource
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from grader.errors import HostError

PROC = Path("/proc")
STATUS = re.compile(rb"^Uid:\s+(\d+)\s.*^Threads:\s+(\d+)$", re.MULTILINE | re.DOTALL)
ALL_UIDS = ["0", "0", "4294967295"]
MB = 1 << 20
TASKS = 512
"""What one process tree may have, as in `RunLimits` (`limits.py`); a test compares the two."""
OTHER_TASKS = 256
"""All others of one grading: the grader, its arenas, and the trees beside that one. The Leeds lab has 110 at most."""
FURTHER_TASKS = 128
"""Of each grading beside it."""
STACK_BYTES = 8 * MB
"""What Linux gives. A thread takes that much of its process's address space, so more of it leaves room for fewer."""


class Need(NamedTuple):
    """One limit: `option` is prlimit's, `flag` ulimit's. `run` is what a run needs of it, `own` without which the
    grader does not get as far as to say that."""

    number: int
    option: str
    flag: str
    what: str
    run: int
    own: int = 0


NEEDS = (
    Need(resource.RLIMIT_NPROC, "nproc", "-u", "processes", TASKS + OTHER_TASKS, 64),
    Need(resource.RLIMIT_NOFILE, "nofile", "-n", "open files", 1024, 32),
    Need(resource.RLIMIT_AS, "as", "-v", "address space", 8 << 30, 160 * MB),
    Need(resource.RLIMIT_DATA, "data", "-d", "data", 8 << 30, 128 * MB),
    Need(resource.RLIMIT_STACK, "stack", "-s", "stack", STACK_BYTES, MB),
    Need(resource.RLIMIT_FSIZE, "fsize", "-f", "size of a file", 256 * MB),
    Need(resource.RLIMIT_CPU, "cpu", "-t", "CPU seconds", 310, 10),
)
COUNTS = {"nproc", "nofile"}


class Checked(NamedTuple):
    """One limit as it is here: its `name`, of `what` it is one, what it leaves in words, what a run needs in words, and
    the `command` that changes it, "" where it is enough. `hopeless` where the grader would not get as far as to say
    that."""

    name: str
    what: str
    found: str
    needed: str
    command: str
    hopeless: bool


def make_room(*, gradings: int = 1, begin: bool = False) -> None:
    """Raise what this process may raise by itself, for itself and all that it starts; it stays raised.

    Raises HostError where that is not enough for so many gradings side by side; with `begin`, only where it is not
    enough for the grader to begin.
    """
    _raise_soft()
    for found in (limits(gradings), group(gradings)):  # in this order: the second loads more
        short = [limit for limit in found if limit.command]
        if any(limit.hopeless or not begin for limit in short):
            words = "; ".join(
                f"{one.name} ({one.what}) is {one.found}, a run needs {one.needed}" for one in short
            )
            raise HostError(
                f"the limits that the grader was started with are too short: {words}",
                hint=f"{' && '.join(one.command for one in short)}, then grade again",
            )


def limits(gradings: int = 1) -> Iterator[Checked]:
    """Yield every limit, as it is once it has been raised as far as this process may raise it."""
    for need in NEEDS:
        hard = resource.getrlimit(need.number)[1]
        processes = need.option == "nproc"
        running = _running(hard) if processes else 0
        wanted = need.run + (FURTHER_TASKS * (gradings - 1) if processes else 0)
        yield Checked(
            name=f"ulimit {need.flag}",
            what=need.what,
            found=_amount_text(need, hard) + (f", with {running} in use" if running else ""),
            needed=f"{wanted} more" if running else _amount_text(need, wanted),
            command=_command(need, wanted + running) if 0 <= hard < wanted + running else "",
            hopeless=0 <= hard < need.own + running,
        )


def group(gradings: int = 1) -> Iterator[Checked]:
    """Yield the control group around this process with the least room for processes, where one has a limit."""
    wanted = NEEDS[0].run + FURTHER_TASKS * (gradings - 1)
    for room, most, folder in sorted(_rooms())[:1]:
        used = most - room
        yield Checked(
            name="pids.max",
            what="processes of the control group",
            found=f"{most}, with {used} in use",
            needed=f"{wanted} more",
            command=f"echo {used + wanted} > {folder}/pids.max" if room < wanted else "",
            hopeless=room < NEEDS[0].own,
        )


def _raise_soft() -> None:
    """Raise soft limits to the hard ones. The stack's is set to the usual value, as more does harm too."""
    for need in NEEDS:
        soft, hard = resource.getrlimit(need.number)
        wanted = _soft(need, soft, hard)
        if wanted == soft:
            continue
        with suppress(OSError, ValueError):  # a kernel that refuses that leaves it short, which is said
            resource.setrlimit(need.number, (wanted, hard))
        if need.option == "stack" and 0 <= soft < wanted:
            threading.stack_size(wanted)  # that of new threads follows what was there when the process began


def _soft(need: Need, soft: int, hard: int) -> int:
    """Return the soft limit to set. Files get no more than a run needs: older programs expect small numbers (man 2
    select)."""
    most = need.run if need.option in {"nofile", "stack"} else resource.RLIM_INFINITY
    if need.option not in {"nproc", "stack"} and (soft < 0 or soft >= need.run):
        return soft
    return max(most, hard) if most < 0 or hard < 0 else min(most, hard)


def _running(hard: int) -> int:
    """Return how many tasks count against the limit of processes: all of the user's, on the whole machine. Root's do
    not count, and its students have a user of their own, which runs nothing yet."""
    return 0 if hard < 0 or _is_root() else tasks_of(os.getuid())


def _rooms() -> Iterator[tuple[int, int, Path]]:
    from grader.arena.control_groups import own_groups  # noqa: PLC0415 - it loads more than the standard library

    for _, own in own_groups("pids"):
        for folder in (own, *own.parents):
            with suppress(OSError, ValueError):  # no such file, or `max`
                most = int((folder / "pids.max").read_text())
                yield most - int((folder / "pids.current").read_text()), most, folder


def tasks_of(uid: int) -> int:
    """Return how many tasks (threads count) this user has, as far as /proc shows them."""
    found = 0
    for folder in PROC.glob("[0-9]*"):
        with suppress(OSError):  # it has ended
            if folder.stat().st_uid in {uid, 0}:  # root's, where no one may look into it
                status = STATUS.search((folder / "status").read_bytes())
                found += int(status[2]) if status and int(status[1]) == uid else 0
    return found


def _is_root() -> bool:
    """Return whether the user is the machine's root, and not that of a user namespace."""
    with suppress(OSError):  # a kernel without user namespaces
        return os.geteuid() == 0 and (PROC / "self" / "uid_map").read_text().split() == ALL_UIDS
    return os.geteuid() == 0


def _amount_text(need: Need, amount: int) -> str:
    if amount < 0:
        return "unlimited"
    if need.option in COUNTS:
        return f"{amount}"
    if need.option == "cpu":
        return f"{amount} s"
    return f"{amount / MB:.0f} MB" if amount >= 10 * MB else f"{amount / 1024:.0f} kB"


def _command(need: Need, wanted: int) -> str:
    sudo = "" if os.geteuid() == 0 else "sudo "
    return f"{sudo}prlimit --pid $$ --{need.option}={wanted}:{wanted}"
