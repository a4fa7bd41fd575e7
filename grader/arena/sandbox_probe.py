"""Whether a sandbox can be had here, and which one is used.

Going without is for machines that lack a program or whose kernel forbids it. A probe that says nothing, or something
that is not known, stops the grading: what keeps it from working now may be gone with the next run, and until then
students' code would have run without a wall.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

from grader.arena.control_groups import find_cgroups
from grader.arena.sandbox import NAMESPACES, NO_NESTING, WALLS, RunLimits, Sandbox, system_call_filter
from grader.errors import HostError, SandboxMissing
from grader.host_programs import HOST_ENV, find_host_program
from grader.model import SandboxMode

UID_MAP = Path("/proc/self/uid_map")
UNUSED_UIDS = (1_900_000_000, 2_000_000_000)
"""Left alone by distributions and by systemd (systemd.io/UIDS-GIDS)."""
FEW_UIDS = (30_000, 60_000)
PROGRAMS = ("bwrap", "setpriv", "prlimit")
PROBE_S = 20.0
SAID_CHARS = 200
FORBIDDEN = "Operation not permitted|Permission denied"
LACKING = "No space left on device|Invalid argument|Function not implemented"
"""ENOSPC is the kernel's word for a bound on the number of namespaces that is reached, mostly 0."""
KNOWN = re.compile(
    rf"bwrap: No permissions to creat(e|ing) (a )?new namespace\b.*"
    rf"|bwrap: Creating new namespace failed, likely because the kernel does not support user namespaces\b.*"
    rf"|bwrap: Creating new namespace failed: nesting depth or /proc/sys/user/max_\S+ exceeded \(ENOSPC\)"
    rf"|bwrap: Creating new namespace failed: ({FORBIDDEN}|{LACKING})"
    rf"|bwrap: (setting up [ug]id map|Failed to make / slave|Failed to mount tmpfs): ({FORBIDDEN})"
    rf"|bwrap: unshare user ns: ({FORBIDDEN}|{LACKING})"
    rf"|bwrap: Can't (re)?(mount|bind mount) [^:]*: ({FORBIDDEN})"
    rf"|bwrap: pivot_root(\(/newroot\))?: ({FORBIDDEN}|Invalid argument)"
    rf"|bwrap: loopback: Failed RTM_NEW(ADDR|LINK): ({FORBIDDEN})"
    rf"|(\[Errno \d+\] )?(no namespaces of its own|nothing can be mounted): ({FORBIDDEN}|{LACKING})"
    rf"|\[Errno \d+\] ({FORBIDDEN})(: '/proc/self/(setgroups|[ug]id_map)')?"
)
"""What bubblewrap (bubblewrap.c, bind-mount.c, utils.c) and `ros/namespaces.py` print where the kernel, or what guards
a container, forbids what they need: user or network namespaces, mounts in them."""
NESTS = re.compile(
    r"bwrap: (.*--disable-userns\b.*|.*\buser\.max_user_namespaces\b.*|.*/max_user_namespaces\b.*"
    r"|creation of new user namespaces was not disabled as requested)"
)
"""What it prints where it makes a sandbox, but cannot keep processes from making user namespaces in there."""
ULIMIT_HINT = "raise what this shell allows (`ulimit -Ha` shows it), then grade again"
ROOT_HINT = "grade as an ordinary user, or let root become one (in a container: CAP_SETUID and CAP_SETGID)"
INSTALL_HINT = "apt-get install bubblewrap (in a container: allow user namespaces, or run it privileged)"
UNKNOWN_HINT = (
    "`grader doctor` looks at each part; grade again, or with `--sandbox none` where that is what you want"
)


def choose(mode: SandboxMode) -> Sandbox:
    """Return the sandbox to use: `require` raises SandboxMissing where there is none, `auto` goes without and says so.

    Raises SandboxMissing where it cannot be known whether there is one, and HostError where the limits that were
    inherited are too short, or those of students' processes cannot be set: every one would fail.
    """
    from grader.arena.inherited_limits import make_room  # noqa: PLC0415 - elsewhere than on Linux nothing is run

    make_room()
    refused = refused_limits()
    if refused:
        hint = ROOT_HINT if refused.startswith("setpriv: ") else ULIMIT_HINT
        raise HostError(f"the limits of students' processes cannot be set here: {refused}", hint=hint)
    reason = "--sandbox none" if mode == "none" else why_no_sandbox()
    if reason and mode == "require":
        raise SandboxMissing(f"no sandbox on this machine: {reason}", hint=INSTALL_HINT)
    can_drop = os.geteuid() == 0 and find_host_program("setpriv") is not None
    uid = _unprivileged_uid() if can_drop else None
    nesting = not reason and _walls()[1]
    return Sandbox(bubblewrap=not reason, uid=uid, reason=reason, nesting=nesting, cgroups=find_cgroups())


@lru_cache(maxsize=1)
def refused_limits() -> str:
    """Return why this machine refuses the limits of students' processes; "" where it sets them, or has no prlimit.

    They are set by the user who has them: root may do more.
    """
    prlimit = find_host_program("prlimit")
    if prlimit is None:
        return ""
    limits = Sandbox(bubblewrap=False, uid=None).rlimits(RunLimits())
    return _said([*_drop(), prlimit, *limits, "--", "/bin/true"])


def why_no_sandbox() -> str:
    """Return why to go without a sandbox, in one line; "" where the sandbox and the arena's own network work.

    Raises SandboxMissing where that is not known.
    """
    return _walls()[0]


@lru_cache(maxsize=1)
def _walls() -> tuple[str, bool]:
    """Return why there is no sandbox, and whether what is in one can make namespaces. An error is not kept: it may
    pass."""
    for program in PROGRAMS:
        if find_host_program(program) is None:
            return f"{program} is not installed", False
    said = _refusal(NO_NESTING)
    nesting = bool(NESTS.fullmatch(said) or KNOWN.fullmatch(said))
    if nesting:
        said = _refusal()
    if said and not KNOWN.fullmatch(said):
        raise SandboxMissing(f"it is not known whether there is a sandbox here: {said}", hint=UNKNOWN_HINT)
    return said, nesting and not said


def _unprivileged_uid() -> int:
    """A user that no directory of users knows, where this machine has the whole range of them (a container may not)."""
    try:
        mapped = max(int(line.split()[0]) + int(line.split()[2]) for line in UID_MAP.read_text().splitlines())
    except (OSError, ValueError, IndexError):
        mapped = 0
    return random.SystemRandom().randrange(*(UNUSED_UIDS if mapped >= UNUSED_UIDS[1] else FEW_UIDS))


def _refusal(*more: str) -> str:
    """Return why this machine refuses a sandbox with these arguments; "" where it makes one."""
    calls = ["--seccomp", "0"] if system_call_filter() else []
    files = ["--ro-bind", "/", "/", "--proc", "/proc", "--clearenv", "--setenv", "LANG", "C.UTF-8"]
    walls = [*files, *WALLS, *more, *calls, "--die-with-parent", "/bin/true"]
    return _said(
        [sys.executable, "-I", str(NAMESPACES), *_drop(), find_host_program("bwrap") or "bwrap", *walls]
    )


def _drop() -> list[str]:
    """Return the words by which root becomes another user."""
    setpriv = find_host_program("setpriv") if os.geteuid() == 0 else None
    return [setpriv, "--reuid=65534", "--regid=65534", "--clear-groups"] if setpriv else []


def _said(command: list[str]) -> str:
    """Return the last line that a command of this machine printed where it failed; empty where it did not fail."""
    try:
        done = subprocess.run(
            command,
            input=system_call_filter() or b"",
            capture_output=True,
            check=False,
            timeout=PROBE_S,
            env=HOST_ENV,
            cwd="/",
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {PROBE_S:g} s"
    except OSError as error:
        return f"{command[0]}: {error.strerror}"
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    return "" if done.returncode == 0 else (lines or [f"exit code {done.returncode}"])[-1][:SAID_CHARS]
