"""The wall around a student process tree: bubblewrap's arguments, and whether it can be had here.

How much a process tree may use is in `limits.py`.

Of a wall, only arguments are made; the arena starts the programs (`ros/launching.py`) in namespaces of its own
(`ros/namespaces.py`). Going without (`choose_sandbox`) is for machines that lack a program or whose kernel forbids it.
A probe that says nothing, or something that is not known, stops the grading: what keeps it from working now may be gone
with the next run, and until then students' code would have run without a wall.
"""

from __future__ import annotations

import os
import platform
import random
import re
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from grader.arena.control_groups import Cgroups, find_cgroups
from grader.arena.limits import RunLimits
from grader.arena.sandbox_files import (
    COMPLETED,
    HOME,
    RECORD,
    RECORD_INSIDE,
    RECORD_SHIM,
    SHIMS,
    STANDINS,
    packages_without_program,
)
from grader.errors import HostError, SandboxMissing
from grader.host_programs import LOCALHOST, LOCALHOST_HINT, find_host_program, resolves, run_host_program
from grader.model import SandboxMode
from grader.model.record import Record
from grader.ros_env import RosInstallation

Word: TypeAlias = "str | dict[str, Any]"
"""An argument, or what the arena puts into its place (`ros/launching.py`)."""

ETC = (
    "alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "timezone", "nsswitch.conf",
    "os-release", "debian_version", "lsb-release", "python3", "python3.11", "mime.types", "catkin", "ros",
    "ssl/openssl.cnf",
)  # fmt: skip
OWN_ETC = ("passwd", "group", "hosts")
OWN_FOLDER = Path(__file__).resolve().parent.parent
NAMESPACES = Path(__file__).parent / "ros" / "namespaces.py"
FIRST_ENV = {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"}
"""Of the first shell behind the wall, which then sets what the process is to have."""
WALLS = ("--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
NO_NESTING = "--disable-userns"
COUNTS_BY_NAMESPACE = (5, 14)
"""Since this kernel RLIMIT_NPROC counts the processes of a user namespace, before it all of the user's."""
FILTERS = Path(__file__).parent / "filters"
MACHINES = ("x86_64", "aarch64")


def copy_of(path: Path) -> Word:
    """Return the placeholder of a copy of that file or folder in memory, which does not show where it comes from."""
    return {"copy": str(path)}


def scratch(size_bytes: int, files: int) -> Word:
    """Return the placeholder of new memory for files."""
    return {"scratch": [size_bytes, files]}


def descriptor(name: str) -> Word:
    """Return the placeholder of a descriptor that is passed on."""
    return {"descriptor": name}


class Sandbox(Record):
    """`bubblewrap` or nothing; `uid` is the student's where root has to become another user. `nesting` is true where
    bubblewrap cannot keep a process from making user namespaces of its own."""

    bubblewrap: bool
    uid: int | None
    reason: str = ""
    nesting: bool = False
    cgroups: Cgroups = Cgroups()

    @property
    def label(self) -> str:
        """What the report says."""
        if not self.bubblewrap:
            who = ", but for an unprivileged user" if self.uid else ""
            return f"none ({self.reason}){who}; memory held by {self.cgroups.label}"
        who = "as root for an unprivileged user" if self.uid else "unprivileged"
        calls = "" if system_call_filter() else "; system calls not filtered on this processor"
        return f"bubblewrap, {who}; memory held by {self.cgroups.label}{calls}"

    def outer(self, limits: RunLimits) -> list[str]:
        """Return the programs of this machine that come first: they take rights away and set limits."""
        drop = [f"--reuid={self.uid}", f"--regid={self.uid}", "--clear-groups"] if self.uid else []
        if not self.bubblewrap:  # it sees to that itself, and may be setuid
            drop.append("--no-new-privs")
        become = [_program("setpriv"), *drop] if drop and find_host_program("setpriv") else []
        return [*become, _program("prlimit"), *self.rlimits(limits), "--"]

    def wall(
        self, *, ros: RosInstallation, place: Path, limits: RunLimits, binds: Sequence[Word], net: bool
    ) -> list[Word] | None:
        """Return bubblewrap's arguments, or None without it. `place` is the run's own folder (`sandbox_files.prepare`),
        `binds` are more arguments. Only memory of fixed size can be written: the scratches, and what `binds` give."""
        if not self.bubblewrap:
            return None
        etc = [
            word for name in OWN_ETC for word in ("--ro-bind", copy_of(place / "etc" / name), f"/etc/{name}")
        ]
        return [
            *_system(ros), *_rosbag_record(ros, place), *_completed(ros, place), "--proc", "/proc", "--dev", "/dev",
            "--bind", scratch(limits.shared_bytes, limits.shared_files), "/dev/shm", "--remount-ro", "/dev",  # noqa: S108 - its own
            "--bind", scratch(limits.tmp_bytes, limits.tmp_files), "/tmp",  # noqa: S108 - its own
            "--bind", scratch(limits.home_bytes, limits.home_files), HOME, *etc,
            "--ro-bind", copy_of(place / "bin"), SHIMS, "--ro-bind", copy_of(place / "standins"), STANDINS, *binds,
            "--remount-ro", "/", "--uid", "1000", "--gid", "1000", "--hostname", "localhost", "--chdir", HOME,
            *WALLS, *([] if self.nesting else [NO_NESTING]), *([] if net else ["--unshare-net"]),
            "--cap-drop", "ALL", "--new-session", "--die-with-parent", "--info-fd", descriptor("info"),
            *(["--seccomp", descriptor("seccomp")] if system_call_filter() else []),
            "--clearenv", *(word for pair in FIRST_ENV.items() for word in ("--setenv", *pair)),
        ]  # fmt: skip

    def first_words(self, limits: RunLimits) -> str:
        """Return what the shell of a process tree does first: it limits the number of tasks, where the tree is counted
        apart."""
        return f"ulimit -u {limits.tasks}; " if self._counts_apart() else ""

    def _counts_apart(self) -> bool:
        """Return whether the tree's tasks are counted apart. Else one tree of the user could leave the others none."""
        return self.bubblewrap and _counts_by_namespace()

    def rlimits(self, limits: RunLimits) -> Iterator[str]:
        """Yield the arguments of prlimit."""
        yield f"--fsize={limits.file_bytes}"
        yield f"--nofile={limits.open_files}"
        yield f"--as={limits.address_space_bytes}"
        # The soft limit is a signal that a process may ignore, the hard one ends it.
        yield f"--cpu={limits.cpu_s:.0f}:{limits.cpu_s + 10:.0f}"
        # The core file of a crash would fill the little room that the sandbox has for files.
        yield "--core=0"
        yield f"--memlock={limits.locked_bytes}"
        # POSIX message queues hold memory that no process is charged for.
        yield "--msgqueue=0"
        yield "--rtprio=0"
        yield "--nice=0"
        yield f"--sigpending={limits.queued_signals}"
        # It counts all processes of a user: only a user of the student's own can have such a limit.
        if self.uid and not self._counts_apart():
            yield f"--nproc={limits.tasks}"


def _program(name: str) -> str:
    """Return where the machine has the program; `choose_sandbox` has seen that it does."""
    return find_host_program(name) or f"/usr/bin/{name}"


def _system(ros: RosInstallation) -> list[Word]:
    """Return the system's programs, and not the grader: where it lies among them, its folder is empty."""
    argv: list[Word] = ["--ro-bind", "/usr", "/usr"]
    shown = [Path("/usr")]
    for name in ("bin", "sbin", "lib", "lib32", "lib64", "libx32"):
        path = Path("/") / name
        if path.is_symlink():
            argv += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            argv += ["--ro-bind", str(path), str(path)]
    for name in ETC:
        argv += ["--ro-bind-try", f"/etc/{name}", f"/etc/{name}"]
    for prefix in ros.prefixes:
        argv += ["--ro-bind", prefix, prefix]
        shown.append(Path(prefix).resolve())
    if any(OWN_FOLDER.is_relative_to(folder) for folder in shown):
        # Otherwise students' code could read how it is judged.
        argv += ["--size", "4096", "--tmpfs", str(OWN_FOLDER)]
    return argv


def _rosbag_record(ros: RosInstallation, place: Path) -> Iterator[Word]:
    """Put what makes rosbag's recorder content with a sandbox's memory in its place, and the real one aside."""
    found = (Path(prefix) / RECORD for prefix in (*ros.prefixes, "/usr"))
    real = next((path for path in found if path.is_file()), None)
    if real is not None:
        yield from ("--ro-bind", str(real), RECORD_INSIDE)
        yield from ("--ro-bind", copy_of(place / "bin" / RECORD_SHIM), str(real))


def _completed(ros: RosInstallation, place: Path) -> Iterator[Word]:
    """Put the packages that this ROS has without a program, with the grader's, over the installed ones."""
    for installed, _ in packages_without_program(ros):
        yield from ("--ro-bind", copy_of(place / COMPLETED / installed.name), str(installed))


def is_shown(path: Path, ros: RosInstallation) -> bool:
    """Return whether a sandbox shows this path of the machine: its own `/tmp` and `/dev/shm` lie over the machine's."""
    shown = [Path("/usr"), *(Path(prefix).resolve() for prefix in ros.prefixes)]
    hidden = [Path("/tmp"), Path("/dev/shm"), Path(HOME)]  # noqa: S108 - the sandbox's own
    real = path.resolve()
    return any(real.is_relative_to(p) for p in shown) and not any(real.is_relative_to(p) for p in hidden)


@lru_cache(maxsize=1)
def _counts_by_namespace() -> bool:
    version = re.match(r"(\d+)\.(\d+)", platform.release())
    return version is not None and (int(version[1]), int(version[2])) >= COUNTS_BY_NAMESPACE


def temporary_base(sandbox: Sandbox | None) -> Path:
    """Return where run folders go: `$TMPDIR`, or where root's is closed to others, a place that the student's user can
    pass.

    Raises HostError where there is none.
    """
    first = Path(tempfile.gettempdir())
    if sandbox is None or sandbox.uid is None:
        return first
    for base in (first, Path("/var/tmp"), Path("/dev/shm")):  # noqa: S108 - the run's folder in it has a name of its own
        if base.is_dir() and all(p.stat().st_mode & stat.S_IXOTH for p in (base, *base.resolve().parents)):
            return base
    raise HostError(
        f"{first} is closed to other users, and so is /var/tmp", hint=f"chmod o+x {first}, or set TMPDIR"
    )


@lru_cache(maxsize=1)
def system_call_filter() -> bytes | None:
    """Return the filter of system calls (seccomp) that every sandbox gets; None for a processor that there is none for.

    libseccomp compiled it: `scripts/system_calls.py` says which calls are allowed, and writes the files that are read
    here. So grading needs no libseccomp, and what is allowed is the same on every machine.
    """
    machine = os.uname().machine
    return (FILTERS / f"{machine}.bpf").read_bytes() if machine in MACHINES else None


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


def choose_sandbox(mode: SandboxMode) -> Sandbox:
    """Return the sandbox to use: `require` raises SandboxMissing where there is none, `auto` goes without and says so.

    Raises SandboxMissing where it cannot be known whether there is one, and HostError where the limits that were
    inherited are too short, or those of students' processes cannot be set: every one would fail. So would a launch
    file without a sandbox where the machine does not know `localhost`.
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
    if reason and not resolves(LOCALHOST):
        detail = "localhost does not resolve on this machine, and without it roslaunch starts nothing"
        raise HostError(detail, hint=LOCALHOST_HINT)
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
    return last_error_line([*words_to_drop_root(), prlimit, *limits, "--", "/bin/true"])


def why_no_sandbox() -> str:
    """Return why to go without a sandbox, on one line; "" where the sandbox and the arena's own network work.

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
    # Without the word that was refused, there may be a sandbox all the same.
    if nesting:
        said = _refusal()
    if said and not KNOWN.fullmatch(said):
        raise SandboxMissing(f"it is not known whether there is a sandbox here: {said}", hint=UNKNOWN_HINT)
    return said, nesting and not said


def _unprivileged_uid() -> int:
    """Return the number of a user that nobody has, of a range that is unused where this machine has all numbers (a
    container may not)."""
    try:
        mapped = max(int(line.split()[0]) + int(line.split()[2]) for line in UID_MAP.read_text().splitlines())
    except (OSError, ValueError, IndexError):
        mapped = 0
    # A number that cannot be guessed: gradings of root's that run side by side do not share a user.
    return random.SystemRandom().randrange(*(UNUSED_UIDS if mapped >= UNUSED_UIDS[1] else FEW_UIDS))


def _refusal(*more: str) -> str:
    """Return why this machine refuses a sandbox with these arguments; "" where it makes one."""
    calls = ["--seccomp", "0"] if system_call_filter() else []
    files = ["--ro-bind", "/", "/", "--proc", "/proc", "--clearenv", "--setenv", "LANG", "C.UTF-8"]
    walls = [*files, *WALLS, *more, *calls, "--die-with-parent", "/bin/true"]
    # In a process of its own, since it leaves this process's namespaces.
    command = [sys.executable, "-I", str(NAMESPACES), *words_to_drop_root(), _program("bwrap")]
    return last_error_line([*command, *walls])


def words_to_drop_root() -> list[str]:
    """Return the words by which root becomes another user."""
    setpriv = find_host_program("setpriv") if os.geteuid() == 0 else None
    return [setpriv, "--reuid=65534", "--regid=65534", "--clear-groups"] if setpriv else []


def last_error_line(command: list[str]) -> str:
    """Return the last line that a command of this machine printed where it failed; empty where it did not fail."""
    try:
        done = run_host_program(command, PROBE_S, system_call_filter() or b"")
    except subprocess.TimeoutExpired:
        return f"no answer within {PROBE_S:g} s"
    except OSError as error:
        return f"{command[0]}: {error.strerror}"
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    return "" if done.returncode == 0 else (lines or [f"exit code {done.returncode}"])[-1][:SAID_CHARS]
