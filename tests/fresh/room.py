"""Fresh roots: a Debian 12 with nothing of this machine in it, to run the steps of an installation in.

    with Rooms(folder) as rooms:
        bare = rooms.fresh_root()
        bare.run(["apt-get", "update"], network=True)
        rooms.fresh_root(on=bare).run(["true"])  # begins as `bare` is now; `bare` must not change any more

A root is an overlay in memory, in a mount namespace that a waiting process holds: when that process ends, however this
one may have ended, nothing is mounted any more. Commands run in it as root, or as another user, in namespaces of their
own, without a network unless they ask for it. With a network they have the settings of this machine for apt and pip.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from typing_extensions import Self

from tests.fresh import debian
from tests.fresh.kept import kept, sweep
from tests.fresh.settings import HOST, network_settings

SIZE = "8g"
CAPABILITIES = (
    "CHOWN", "DAC_OVERRIDE", "FSETID", "FOWNER", "MKNOD", "NET_RAW", "SETGID", "SETUID", "SETFCAP", "SETPCAP",
    "NET_BIND_SERVICE", "SYS_CHROOT", "KILL", "AUDIT_WRITE",
)  # fmt: skip
"""What root may do in a container, as Docker has it where nobody asked for more."""
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
ALONE = (
    "unshare",
    "--mount",
    "--pid",
    "--net",
    "--ipc",
    "--uts",
    "--fork",
    "--kill-child",
    "--propagation",
    "private",
)
PRIVILEGED = f"""
set -e
cd "$1"
mount --bind . . && cd "$1"
mount -t proc proc proc
mount --rbind /dev dev
mount --rbind /sys sys
ip link set lo up
mkdir -p .{HOST} && mount -t tmpfs none .{HOST}
[ -z "$2" ] || {{ mkdir .{HOST}/locks && mount --bind "$2" .{HOST}/locks; }}
mkdir -p mnt/outside && pivot_root . mnt/outside && umount -l /mnt/outside
cd "$3" && shift 3 && exec "$@"
"""
"""The root becomes this process's own: one that is only changed into (chroot) may make no user namespaces."""
NEEDED_KIB = 6_000_000
"""Of memory: a root with ROS takes 2 GB, and each that stands on it what it adds."""


def missing() -> str:
    """Why there can be no fresh roots here; empty where there can."""
    if os.geteuid() != 0:
        return "fresh roots take root's rights"
    if without := [
        name
        for name in ("mmdebstrap", "bwrap", "nsenter", "unshare", "mount", "ip")
        if not shutil.which(name)
    ]:
        return f"no {', '.join(without)} here"
    if _available_kib() < NEEDED_KIB:
        return f"less than {NEEDED_KIB // 1_000_000} GB of memory are free"
    trial = ["unshare", "--mount", "--propagation", "private", "mount", "-t", "tmpfs", "none", "/mnt"]
    tried = subprocess.run(trial, check=False, capture_output=True, text=True)
    return f"nothing can be mounted here: {tried.stderr.strip()}" if tried.returncode else debian.missing()


def _available_kib() -> int:
    line = next(x for x in Path("/proc/meminfo").read_text().splitlines() if x.startswith("MemAvailable:"))
    return int(line.split()[1])


class Failed(AssertionError):
    """A command in a root ended otherwise than it should have."""


@dataclass
class Root:
    """`path` is where it is seen from outside, as long as its rooms last; links in it that begin with / lead astray."""

    rooms: Rooms
    place: str
    lower: tuple[str, ...]
    env: dict[str, str] = field(default_factory=dict)

    @property
    def path(self) -> Path:
        """The root's folder, for files to be written and read by the test."""
        return self.rooms.seen / self.place / "root"

    def run(
        self,
        argv: Sequence[str],
        *,
        env: Mapping[str, str] | None = None,
        network: bool = False,
        locks: Path | None = None,
        cwd: str = "/",
        user: str | None = None,
        privileged: bool = False,
        check: bool = True,
        timeout: float = 280,
    ) -> subprocess.CompletedProcess[str]:
        """Run a command in the root as root, or as `user` (a name or a number), with what a container may do.

        `privileged` is as on a machine of its own: with all rights and the kernel's control groups, but no network
        beyond itself.

        With the folder of their `locks`, graders in the root and those of this machine take turns.
        Raises Failed where `check` is set and it ends with another code than 0.
        """
        groups = "--clear-groups" if (user or "").isdecimal() else "--init-groups"  # a number may be nobody's
        who = ["setpriv", f"--reuid={user}", f"--regid={user}", groups, "--inh-caps=-all"] if user else []
        box = self._box(env or {}, cwd, locks, network=network, privileged=privileged)
        command = [*self.rooms.enter, *box, *who, *argv]
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
            encoding="utf-8",
            errors="backslashreplace",
        )
        if check and done.returncode != 0:
            raise Failed(
                f"{' '.join(argv)} ended with {done.returncode}:\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
            )
        return done

    def _box(
        self, env: Mapping[str, str], cwd: str, locks: Path | None, *, network: bool, privileged: bool
    ) -> list[str]:
        """Return the command that runs another one in the root."""
        settings, binds = network_settings() if network else ({}, [])
        if locks is not None:
            binds = [*binds, "--bind", str(locks), f"{HOST}/locks"]
            settings["XDG_RUNTIME_DIR"] = f"{HOST}/locks"
        variables = {"PATH": PATH, "HOME": "/root", **settings, **self.env, **env}
        place = f"{self.rooms.tmpfs}/{self.place}/root"
        if privileged:
            assert not network
            box = [*ALONE, "sh", "-c", PRIVILEGED, "sh", place, str(locks or ""), cwd]
            return [*box, "env", "-i", *(f"{name}={value}" for name, value in variables.items())]
        return [
            "bwrap", "--die-with-parent", "--bind", place, "/",
            "--proc", "/proc", "--dev", "/dev", "--unshare-pid", "--unshare-ipc", "--unshare-uts",
            *([] if network else ["--unshare-net"]), "--tmpfs", HOST, *binds, "--clearenv",
            *(word for capability in CAPABILITIES for word in ("--cap-add", f"CAP_{capability}")),
            *(word for name, value in variables.items() for word in ("--setenv", name, value)),
            "--chdir", cwd, "--",
        ]  # fmt: skip

    def copy_in(self, source: Path, target: str) -> None:
        """Copy a file or a folder to the path `target` in the root, modes and links as they are."""
        goal = self.path / target.lstrip("/")
        goal.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, goal, symlinks=True, dirs_exist_ok=True)
        else:
            shutil.copy2(source, goal)


class Rooms:
    """Holds the roots. `folder` is an empty one of this machine, for their mount."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.tmpfs = folder.resolve()
        self._count = 0
        script = 'mount -t tmpfs -o size="$1",mode=755 rooms "$2" && echo ready && read -r _'
        holder = [
            "unshare",
            "--mount",
            "--propagation",
            "private",
            "sh",
            "-c",
            script,
            "sh",
            SIZE,
            str(self.tmpfs),
        ]
        self._holder = subprocess.Popen(holder, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._holder.stdout is not None
        if self._holder.stdout.readline() != b"ready\n":
            raise Failed("no tmpfs could be mounted")
        self.enter = ["nsenter", f"--mount=/proc/{self._holder.pid}/ns/mnt", "--"]
        self.seen = Path(f"/proc/{self._holder.pid}/root{self.tmpfs}")
        self.seconds: dict[str, float] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the holder; the kernel unmounts everything."""
        self._holder.communicate()

    def fresh_root(self, *, on: Root | None = None) -> Root:
        """A new root: bare Debian, or what `on` has become."""
        if on is not None:
            return self._overlay((f"{on.place}/upper", *on.lower), dict(on.env))
        bare = self._unpacked(debian.ARCHIVE, lambda: kept(debian.ARCHIVE, debian.make))
        etc = self.seen / bare / "etc"
        (etc / "hosts").write_text("127.0.0.1 localhost\n")  # as containers have it
        (etc / "resolv.conf").write_text("")
        return self._overlay((bare,), {})

    def prepared_root(self, name: str, key: bytes, make: Callable[[Root], None]) -> Root:
        """A bare root that `make` has worked on. What came of it is kept for a day under the digest of `key`, which has
        to be all that `make` reads of this machine."""
        archive = f"{name}-{hashlib.sha256(key).hexdigest()[:16]}.tar.zst"
        made: list[Root] = []

        def pack(target: Path) -> None:
            made.append(self.fresh_root())
            make(made[0])
            tar = 'tar --numeric-owner -C "$0" -cf - . | zstd -q -1 -T0 -o "$1"'
            self._inside("sh", "-c", tar, f"{made[0].place}/root", str(target))

        if not shutil.which("zstd"):
            make(root := self.fresh_root())
            return root
        file = kept(archive, pack)
        sweep(f"{name}-*.tar.zst", but=archive)
        return made[0] if made else self._overlay((self._unpacked(archive, lambda: file),), {})

    def _overlay(self, lower: tuple[str, ...], env: dict[str, str]) -> Root:
        self._count += 1
        place = f"r{self._count}"
        for name in ("upper", "work", "root"):
            (self.seen / place / name).mkdir(parents=True)
        (self.seen / place / "upper").chmod(0o755)
        # relative paths, since the options of a mount have to be short
        options = f"lowerdir={':'.join(lower)},upperdir={place}/upper,workdir={place}/work"
        self._inside("mount", "-t", "overlay", "overlay", "-o", options, f"{place}/root")
        return Root(rooms=self, place=place, lower=lower, env=env)

    def _unpacked(self, archive: str, file: Callable[[], Path]) -> str:
        place = archive.partition(".")[0]
        if not (self.seen / place).exists():
            began = time.monotonic()
            source = file()
            (self.seen / place).mkdir()
            self._inside("tar", "--numeric-owner", "-xf", str(source), "-C", place)
            self.seconds[archive] = time.monotonic() - began
        return place

    def _inside(self, *argv: str) -> None:
        """Run a command of this machine in the roots' mount namespace, in their folder."""
        command = [*self.enter, "sh", "-c", 'cd "$0" && exec "$@"', str(self.tmpfs), *argv]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode:
            raise Failed(f"{' '.join(argv)}: {done.stderr}")
