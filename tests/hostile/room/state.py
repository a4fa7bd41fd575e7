"""What is in the room at one moment: files that differ from the machine's, processes, sockets, kernel settings."""

from __future__ import annotations

import hashlib
import io
import os
import re
import stat
import tarfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.hostile.room.canaries import OTHER, RUNTIME
from tests.hostile.room.container import DOCUMENT
from tests.hostile.room.world import ORDINARY_UID, World

Entry = tuple[object, ...]
HASHED_BYTES_MAX = 32 << 20
SETTINGS = (
    "kernel/core_pattern",
    "kernel/modprobe",
    "kernel/hostname",
    "vm/overcommit_memory",
    "kernel/sysrq",
)
LISTENS, TIME_WAIT = "0A", "06"
KEPT = re.compile(
    r"(?:root|home/[^/]+)/\.cache(?:/grader(?P<base>/(?:workspace|course)-[0-9a-f]{32}\.tar)?)?"
)
LOCKS = re.compile(str(RUNTIME).lstrip("/") + r"/ros-lab-grader(?P<file>/(turn|runs|lateness|start-\d+))?")
LOCK_BYTES_MAX = 1024
BASE_MEMBERS = re.compile(r"grader-known(/[a-z_]+ [a-z-]+)?|build/CMakeCache\.txt|build/CMakeFiles/[\w./]+")


def files(world: World, results: Path) -> dict[str, Entry]:
    """Whatever differs from the machine's own files, by path, without the new results."""
    return dict(_walk(world, results))


def _walk(world: World, results: Path) -> Iterator[tuple[str, Entry]]:
    for top, folders, names, descriptor in os.fwalk(".", dir_fd=world.changes):
        here = top.removeprefix(".").lstrip("/")
        if here == str(results).lstrip("/"):
            folders[:] = [name for name in folders if name == OTHER.name]
            names[:] = [name for name in names if name != DOCUMENT.name]
        for name in (*folders, *names):
            path = _join(here, name)
            found = os.stat(name, dir_fd=descriptor, follow_symlinks=False)
            if _keeps(path, name, descriptor, found):
                continue
            owner = (stat.filemode(found.st_mode), found.st_uid, found.st_gid)
            if stat.S_ISDIR(found.st_mode):
                if not _same_folder(world, path, found):
                    yield path, owner
            else:
                yield (
                    path,
                    (
                        *owner,
                        found.st_size,
                        found.st_mtime_ns,
                        found.st_rdev,
                        _content(name, descriptor, found),
                    ),
                )


def _keeps(path: str, name: str, descriptor: int, found: os.stat_result) -> bool:
    """What graders share: locks without content, and the base workspace with nothing in it but what belongs there; the
    oldest of many base workspaces and course packages goes."""
    kept, lock = KEPT.fullmatch(path), LOCKS.fullmatch(path)
    if lock is not None:
        plain = stat.S_ISREG(found.st_mode) if lock["file"] else stat.S_ISDIR(found.st_mode)
        return (
            plain
            and found.st_uid in {0, ORDINARY_UID}
            and (not lock["file"] or found.st_size <= LOCK_BYTES_MAX)
        )
    if kept is None or found.st_uid not in {0, ORDINARY_UID}:
        return False
    if kept["base"] is not None and stat.S_ISCHR(found.st_mode) and found.st_rdev == 0:
        return True  # so an overlay says that a file is gone
    if kept["base"] is None or not stat.S_ISREG(found.st_mode):
        return stat.S_ISDIR(found.st_mode)
    with os.fdopen(os.open(name, os.O_RDONLY | os.O_NOFOLLOW, dir_fd=descriptor), "rb") as file:
        data = file.read()[hashlib.sha256().digest_size :]
    with tarfile.open(fileobj=io.BytesIO(data)) as tar:
        return all(BASE_MEMBERS.fullmatch(member) for member in tar.getnames()) and b"HARM" not in data


def _join(folder: str, name: str) -> str:
    return f"{folder}/{name}" if folder else name


def _same_folder(world: World, path: str, found: os.stat_result) -> bool:
    """The overlay holds a folder as soon as something in it was touched."""
    try:
        before = os.stat(path, dir_fd=world.machine, follow_symlinks=False)
    except OSError:
        return False
    return (before.st_mode, before.st_uid, before.st_gid) == (found.st_mode, found.st_uid, found.st_gid)


def _content(name: str, descriptor: int, found: os.stat_result) -> str:
    if stat.S_ISLNK(found.st_mode):
        return os.readlink(name, dir_fd=descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_size > HASHED_BYTES_MAX:
        return ""
    with os.fdopen(os.open(name, os.O_RDONLY | os.O_NOFOLLOW, dir_fd=descriptor), "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def changed(before: dict[str, Entry], after: dict[str, Entry]) -> list[str]:
    """A line for each path that is new, gone or different."""
    lines = [
        f"{path}: {before[path]} became {after[path]}"
        for path in before
        if path in after and before[path] != after[path]
    ]
    lines += [f"{path}: gone" for path in before.keys() - after.keys()]
    return sorted(lines + [f"{path}: new: {after[path]}" for path in after.keys() - before.keys()])


def folder(path: Path) -> list[str]:
    """Everything below it, whatever it is."""
    return sorted(str(found.relative_to(path)) for found in path.rglob("*"))


def processes(own: int) -> list[str]:
    """What still runs beside this program, whose process id is `own`."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):  # noqa: PTH208 - names alone
        try:
            state = Path("/proc", pid, "stat").read_bytes().rpartition(b")")[2].split()[0]
            command = Path("/proc", pid, "cmdline").read_bytes()
        except OSError:  # it has ended since
            continue
        if int(pid) != own and state not in {b"Z", b"X"}:
            found.append(f"{pid} {state.decode()} {command.decode(errors='replace')[:120]!r}")
    return found


def sockets() -> set[str]:
    """What listens or has a name, in this network namespace."""
    found = set()
    for protocol in ("tcp", "tcp6", "udp", "udp6", "raw"):
        for fields in _rows(protocol):
            if fields[3] != TIME_WAIT:
                found.add(f"{protocol} {fields[1]} {'listens' if fields[3] == LISTENS else ''}".rstrip())
    return found | {f"unix {fields[7]}" for fields in _rows("unix") if len(fields) > 7}


def _rows(name: str) -> list[list[str]]:
    path = Path("/proc/self/net", name)
    return [line.split() for line in path.read_text().splitlines()[1:]] if path.is_file() else []


def packets() -> int:
    """Sent over the loopback, which is where everything would go."""
    lines = Path("/proc/self/net/dev").read_text().splitlines()
    return next(int(line.split(":")[1].split()[1]) for line in lines if line.strip().startswith("lo:"))


def settings() -> dict[str, str]:
    found = {}
    for name in SETTINGS:
        path = Path("/proc/sys", name)
        found[name] = path.read_text() if path.is_file() else ""
    return found


def control_groups(own: Iterable[str]) -> set[str]:
    """Below the room's own ones."""
    return {str(path) for group in own for path in Path(group).rglob("*") if path.is_dir()}
