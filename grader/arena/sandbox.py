"""Two layers of bubblewrap: an outer one with a network of its own for the arena, an inner one a student process tree.

Only command lines are made here; nothing is run but the probe that asks whether they work.
"""

from __future__ import annotations

import os
import random
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

from grader.arena.ros_env import RosInstallation
from grader.arena.standins import copy_standins
from grader.errors import HostError, SandboxMissing
from grader.model.record import Record

Mode = Literal["auto", "require", "none"]

HOME = "/home/student"
INSIDE_WORKSPACE = f"{HOME}/catkin_ws"
OUTPUT = "/run/grader/out"
BUILT_WORKSPACE = "/run/grader/ws"
LARGE = "/run/grader/large"
SHIMS = "/run/grader/bin"
STANDINS = "/run/grader/standins"
ETC = (
    "alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "timezone", "nsswitch.conf",
    "os-release", "debian_version", "lsb-release", "python3", "python3.11", "mime.types", "catkin", "ros",
    "ssl/openssl.cnf",
)  # fmt: skip
SYNTAX = Path(__file__).parent / "ros" / "syntax.py"
TERMINAL = Path(__file__).parent / "ros" / "terminal.sh"
TERMINALS = (
    "gnome-terminal", "konsole", "lxterminal", "mate-terminal", "rxvt", "terminator", "tilix", "urxvt",
    "x-terminal-emulator", "xfce4-terminal", "xterm",
)  # fmt: skip
OPENER = (Path(__file__).parent / "ros" / "open.sh", Path(__file__).parent / "ros" / "opener.py")
BROWSERS = (
    "brave-browser", "chromium", "chromium-browser", "firefox", "firefox-esr", "google-chrome", "google-chrome-stable",
    "opera", "sensible-browser", "www-browser", "x-www-browser", "xdg-open",
)  # fmt: skip
TMP_BYTES = 256 << 20
FILE_BYTES = 64 << 20
OPEN_FILES = 1024
TASKS = 512
ADDRESS_SPACE_BYTES = 8 << 30
INSTALL_HINT = "apt-get install bubblewrap (in a container: allow user namespaces, or run it privileged)"


class Limits(Record):
    """Of one run. Bytes and counts are of one process tree, one channel or one console."""

    memory_bytes: int = 1 << 30
    processes: int = 200
    output_lines: int = 20_000
    output_bytes: int = 8 << 20
    channel_messages: int = 20_000
    channel_bytes: int = 64 << 20


class Sandbox(Record):
    """`bubblewrap` or nothing; `uid` is the student's where root has to become somebody else."""

    bubblewrap: bool
    uid: int | None
    reason: str = ""

    @property
    def label(self) -> str:
        if not self.bubblewrap:
            return f"none ({self.reason})" + (", but for an unprivileged user" if self.uid else "")
        return "bubblewrap, as root for an unprivileged user" if self.uid else "bubblewrap, unprivileged"

    def outer(self, argv: Sequence[str]) -> list[str]:
        """The arena's own layer: a network namespace with nothing but its loopback."""
        if not self.bubblewrap:
            return list(argv)
        return ["bwrap", "--dev-bind", "/", "/", "--unshare-net", "--die-with-parent", "--", *argv]

    def inner(
        self,
        argv: Sequence[str],
        *,
        ros: RosInstallation,
        place: Path,
        binds: Sequence[str],
        net: bool,
        info: bool,
    ) -> list[str]:
        """One process tree's layer. `place` is the run's own folder (see `prepare`), `binds` bubblewrap arguments."""
        limits = ["prlimit", f"--fsize={FILE_BYTES}", f"--nofile={OPEN_FILES}", "--core=0"]
        limits += [f"--as={ADDRESS_SPACE_BYTES}", *([f"--nproc={TASKS}"] if self.uid else []), "--"]
        drop = ["setpriv", f"--reuid={self.uid}", f"--regid={self.uid}", "--clear-groups"] if self.uid else []
        if not self.bubblewrap:
            return [*drop, *limits, *argv]
        return [
            *drop, *limits, "bwrap", *_system(ros), "--proc", "/proc", "--dev", "/dev",
            "--size", str(TMP_BYTES), "--tmpfs", "/tmp",  # noqa: S108 - the sandbox's own
            "--size", str(TMP_BYTES), "--tmpfs", HOME,
            "--ro-bind", str(place / "etc" / "passwd"), "/etc/passwd",
            "--ro-bind", str(place / "etc" / "group"), "/etc/group",
            "--ro-bind", str(place / "etc" / "hosts"), "/etc/hosts",
            "--ro-bind", str(place / "bin"), SHIMS, "--ro-bind", str(place / "standins"), STANDINS, *binds,
            "--remount-ro", "/", "--uid", "1000", "--gid", "1000", "--hostname", "localhost", "--chdir", HOME,
            "--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try",
            *([] if net else ["--unshare-net"]),
            "--cap-drop", "ALL", "--new-session", "--die-with-parent",
            *(["--info-fd", "{info_fd}"] if info else []), "--", *argv,
        ]  # fmt: skip


def _system(ros: RosInstallation) -> list[str]:
    argv = ["--ro-bind", "/usr", "/usr"]
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
    return argv


def prepare(place: Path, ros: RosInstallation) -> None:
    """Write what every inner layer binds: `etc/` with one user in it, `bin/` with `python` as ROS means it, stand-ins
    for terminals, which launch files name as their `launch-prefix`, and for browsers, and `standins/` with the
    packages that this ROS lacks."""
    etc, shims = place / "etc", place / "bin"
    for folder in (etc, shims, place / "home"):
        folder.mkdir(parents=True)
    (etc / "passwd").write_text(f"student:x:1000:1000:student:{HOME}:/bin/bash\n")
    (etc / "group").write_text("student:x:1000:\n")
    (etc / "hosts").write_text("127.0.0.1 localhost\n::1 localhost\n")
    for name in ("python", "python3"):
        (shims / name).symlink_to(ros.python)
    shutil.copyfile(SYNTAX, shims / "grader-syntax.py")
    _program(shims, TERMINAL, "grader-terminal", TERMINALS)
    _program(shims, OPENER[0], "grader-open", BROWSERS)
    shutil.copyfile(OPENER[1], shims / "grader-open.py")
    copy_standins(place / "standins", ros)


def _program(shims: Path, source: Path, name: str, called: Sequence[str]) -> None:
    """One program under the names that it is called by."""
    shutil.copyfile(source, shims / name)
    (shims / name).chmod(0o755)
    for other in called:
        (shims / other).symlink_to(name)


def temporary_base(sandbox: Sandbox | None) -> Path:
    """Where run folders go: `$TMPDIR`, or where root's is closed to others, a place that the student's user can pass.

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


def choose(mode: Mode) -> Sandbox:
    """The sandbox to use: `require` raises SandboxMissing where there is none, `auto` goes without and says so."""
    reason = "--sandbox none" if mode == "none" else why_not()
    if reason and mode == "require":
        raise SandboxMissing(f"no sandbox on this machine: {reason}", hint=INSTALL_HINT)
    can_drop = os.geteuid() == 0 and shutil.which("setpriv") is not None
    uid = random.SystemRandom().randrange(30_000, 60_000) if can_drop else None
    return Sandbox(bubblewrap=not reason, uid=uid, reason=reason)


@lru_cache(maxsize=1)
def why_not() -> str:
    """Empty where both layers work, else the reason in one line."""
    for program in ("bwrap", "setpriv", "prlimit"):
        if shutil.which(program) is None:
            return f"{program} is not installed"
    inner = [
        "bwrap",
        "--ro-bind",
        "/",
        "/",
        "--proc",
        "/proc",
        "--unshare-user",
        "--unshare-pid",
        "/bin/true",
    ]
    drop = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"] if os.geteuid() == 0 else []
    outer = ["bwrap", "--dev-bind", "/", "/", "--unshare-net", "--die-with-parent", "--"]
    done = subprocess.run([*outer, *drop, *inner], capture_output=True, check=False, timeout=20)
    return "" if done.returncode == 0 else done.stderr.decode(errors="replace").strip().splitlines()[-1][:200]
