"""Moves this process to a control group of its own, if students' memory could not be limited well otherwise: a
delegated scope of systemd, as `systemd-run --scope -p Delegate=yes` makes one.

The process keeps its id, terminal, folder and variables. Only processes of a person's login move. What runs in a
service (cron, a CI runner, a cluster's job) stays where its administrator put it; so does what would then be ended when
its user logs out.

Sources: man 5 org.freedesktop.systemd1 (StartTransientUnit), man 1 busctl, man 1 loginctl (enable-linger).
"""

from __future__ import annotations

import os
import secrets
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from grader.arena.control_groups import SYSTEMD, find_cgroups, has_memory, own_group
from grader.host_programs import HOST_ENV, find_host_program
from grader.portable import system

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
    if find_cgroups().memory is None and has_memory() and _may_move() and _moved():
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


def _environment() -> dict[str, str]:
    return {**HOST_ENV, "XDG_RUNTIME_DIR": str(RUNTIME / str(os.geteuid()))}


def _moved() -> bool:
    """Ask for the move and wait until it is done: the answer only says that it will be."""
    busctl, pid = find_host_program("busctl"), os.getpid()
    if busctl is None:
        return False
    scope = f"grader-{pid}-{secrets.token_hex(4)}.scope"
    manager = "--system" if os.geteuid() == 0 else "--user"
    properties = ["PIDs", "au", "1", str(pid), *DELEGATED]
    command = [
        busctl,
        manager,
        f"--timeout={ANSWER_S}",
        "call",
        *METHOD,
        scope,
        "fail",
        "3",
        *properties,
        "0",
    ]
    try:
        subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=True,
            timeout=ANSWER_S + 1,
            env=_environment(),
            cwd="/",
        )
    except (OSError, subprocess.SubprocessError):
        return False
    until = time.monotonic() + ANSWER_S
    while not own_group().endswith(f"/{scope}") and time.monotonic() < until:
        time.sleep(0.01)
    return own_group().endswith(f"/{scope}")
