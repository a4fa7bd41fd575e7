"""The wall around a student process tree: bubblewrap's command line. Whether it can be had here: `probe.py`.

Only command lines are made here; nothing is run. The arena itself has a network of its own (`ros/network.py`).
"""

from __future__ import annotations

import platform
import re
import stat
import tempfile
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

from grader.arena.cgroups import Cgroups
from grader.arena.inside import HOME, SHIMS, STANDINS
from grader.arena.limits import Limits
from grader.arena.ros_env import RosInstallation
from grader.errors import HostError
from grader.model.record import Record

Mode = Literal["auto", "require", "none"]

ETC = (
    "alternatives", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "timezone", "nsswitch.conf",
    "os-release", "debian_version", "lsb-release", "python3", "python3.11", "mime.types", "catkin", "ros",
    "ssl/openssl.cnf",
)  # fmt: skip
OWN_FOLDER = Path(__file__).resolve().parent.parent
NETWORK = Path(__file__).parent / "ros" / "network.py"
WALLS = ("--unshare-user", "--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
NO_NESTING = "--disable-userns"
COUNTS_BY_NAMESPACE = (5, 14)
"""Since this kernel RLIMIT_NPROC counts the processes of a user namespace, before it all of the user's."""


class Sandbox(Record):
    """`bubblewrap` or nothing; `uid` is the student's where root has to become somebody else. `nesting` is true where
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
        return f"bubblewrap, {who}; memory held by {self.cgroups.label}"

    def command(
        self,
        argv: Sequence[str],
        *,
        ros: RosInstallation,
        place: Path,
        limits: Limits,
        binds: Sequence[str],
        net: bool,
        info: bool,
    ) -> list[str]:
        """The command that runs `argv`, and all that it starts, inside of the walls. `place` is the run's own folder
        (see `inside.prepare`), `binds` bubblewrap arguments. Only tmpfs of fixed size can be written, and what `binds`
        give."""
        drop = ["setpriv", f"--reuid={self.uid}", f"--regid={self.uid}", "--clear-groups"] if self.uid else []
        drop += ["prlimit", *self.rlimits(limits), "--"]
        if not self.bubblewrap:
            return [*drop, *argv]
        return [
            *drop, "bwrap", *_system(ros), "--proc", "/proc",
            "--dev", "/dev", *_tmpfs("/dev/shm", limits.shared_bytes), "--remount-ro", "/dev",  # noqa: S108 - its own
            *_tmpfs("/tmp", limits.tmp_bytes), *_tmpfs(HOME, limits.home_bytes),  # noqa: S108 - its own
            "--ro-bind", str(place / "etc" / "passwd"), "/etc/passwd",
            "--ro-bind", str(place / "etc" / "group"), "/etc/group",
            "--ro-bind", str(place / "etc" / "hosts"), "/etc/hosts",
            "--ro-bind", str(place / "bin"), SHIMS, "--ro-bind", str(place / "standins"), STANDINS, *binds,
            "--remount-ro", "/", "--uid", "1000", "--gid", "1000", "--hostname", "localhost", "--chdir", HOME,
            *WALLS, *([] if self.nesting else [NO_NESTING]), *([] if net else ["--unshare-net"]),
            "--cap-drop", "ALL", "--new-session", "--die-with-parent",
            *(["--info-fd", "{info_fd}"] if info else []), "--", *argv,
        ]  # fmt: skip

    def first_words(self, limits: Limits) -> str:
        """What a process tree's shell does before anything else: the number of its tasks, where it is counted apart."""
        return f"ulimit -u {limits.tasks}; " if self._counts_apart() else ""

    def _counts_apart(self) -> bool:
        """Otherwise all trees of one user share a number, and one of them can leave the others none."""
        return self.bubblewrap and _counts_by_namespace()

    def rlimits(self, limits: Limits) -> Iterator[str]:
        """The arguments of prlimit."""
        yield f"--fsize={limits.file_bytes}"
        yield f"--nofile={limits.open_files}"
        yield f"--as={limits.address_space_bytes}"
        yield f"--cpu={limits.cpu_s:.0f}:{limits.cpu_s + 10:.0f}"
        yield "--core=0"
        if self.uid and not self._counts_apart():
            yield f"--nproc={limits.tasks}"


def _tmpfs(path: str, size_bytes: int) -> list[str]:
    return ["--size", str(size_bytes), "--tmpfs", path]


def _system(ros: RosInstallation) -> list[str]:
    """The system's programs, and not the grader: where it lies among them, its folder is empty."""
    argv = ["--ro-bind", "/usr", "/usr"]
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
        argv += _tmpfs(str(OWN_FOLDER), 4096)
    return argv


@lru_cache(maxsize=1)
def _counts_by_namespace() -> bool:
    version = re.match(r"(\d+)\.(\d+)", platform.release())
    return version is not None and (int(version[1]), int(version[2])) >= COUNTS_BY_NAMESPACE


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
