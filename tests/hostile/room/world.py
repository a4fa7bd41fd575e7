"""The room's file system: this machine's, under an overlay that shows and keeps apart every change."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOM_MB = 400
SHARED_MB = 64
ORDINARY_UID = 4711
ORDINARY_NAME = "instructor"


@dataclass(frozen=True, kw_only=True)
class World:
    """Descriptors of folders: `changes` is what differs from this machine, `machine` is its own root."""

    changes: int
    machine: int

    def used_bytes(self) -> int:
        found = os.fstatvfs(self.changes)
        return (found.f_blocks - found.f_bfree) * found.f_frsize


def run(*argv: str | Path) -> None:
    subprocess.run(
        [str(word) for word in argv], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )


def enter(scratch: Path) -> World:
    """Make the overlay on a tmpfs at `scratch`, and let it take the root's place. Needs a mount namespace."""
    run("mount", "-t", "tmpfs", "-o", f"size={ROOM_MB}M,mode=755", "room", scratch)
    changes, work, root = (scratch / name for name in ("changes", "work", "root"))
    for folder in (changes, work, root):
        folder.mkdir()
    layers = f"lowerdir=/,upperdir={changes},workdir={work}"
    run("mount", "-t", "overlay", "-o", layers, "overlay", root)
    for path in _elsewhere():
        run("mount", "--rbind", path, f"{root}{path}")
    run("mount", "-t", "proc", "proc", root / "proc")
    run("mount", "--rbind", "/sys", root / "sys")
    run("mount", "--rbind", "/dev", root / "dev")
    run("mount", "-t", "tmpfs", "-o", f"size={SHARED_MB}M,mode=1777", "shm", root / "dev" / "shm")
    world = World(changes=os.open(changes, os.O_RDONLY), machine=os.open("/", os.O_RDONLY))
    before = root / ".before"
    before.mkdir()
    run("pivot_root", root, before)
    os.chdir("/")
    run("umount", "--lazy", "/.before")
    Path("/.before").rmdir()
    return world


def _elsewhere() -> list[Path]:
    """What the grader needs and the root's own file system does not hold."""
    device = Path("/").stat().st_dev
    needed = (
        Path(__file__).resolve().parents[3],
        Path(sys.prefix),
        Path(sys.base_prefix),
        Path("/usr"),
        Path("/opt"),
    )
    return [path for path in needed if path.is_dir() and path.stat().st_dev != device]


def add_user() -> None:
    """An ordinary user, with the way to the interpreter and the grader open to them, in this room alone."""
    run("useradd", "--create-home", "--uid", str(ORDINARY_UID), "--shell", "/bin/bash", ORDINARY_NAME)
    for path in (Path(__file__).resolve().parents[3], Path(sys.prefix), Path(sys.base_prefix)):
        for folder in (path, *path.parents):
            folder.chmod(folder.stat().st_mode | 0o011)


def install() -> Path:
    """A copy of the grader among the system's Python packages, laid out as a wheel lays it out."""
    target = Path("/usr/local/lib/python3.11/dist-packages")
    own = Path(__file__).resolve().parents[3]
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(own / "grader", target / "grader", ignore=ignored)
    for name in ("rubrics", "reference_solutions"):
        shutil.copytree(own / name, target / "grader" / "_data" / name, ignore=ignored)
    return target


def bring_up_loopback() -> None:
    """Every address there is leads to the loopback, so that its counters show whatever is sent to anybody."""
    run("ip", "link", "set", "lo", "up")
    run("ip", "route", "add", "local", "default", "dev", "lo")
