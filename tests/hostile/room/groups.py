"""Control groups of the room: what they say of its memory, and whether a grading in it can make its own."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from tests.hostile.room.world import run

MOUNTINFO = Path("/proc/self/mountinfo")
CACHE = ("total_cache", "total_shmem")


def enter(groups: Iterable[str], may_make: str, uid: int) -> None:
    """This process, and all that it starts, belong to `groups`. Below them the user `uid` can then make groups
    (`with`), or nobody can (`without`): all control groups are only read."""
    for group in groups:
        Path(group, "cgroup.procs").write_text("0", encoding="utf-8")
        if may_make == "with":
            os.chown(group, uid, uid)
    if may_make == "without":
        for point in _mounted():
            run("mount", "-o", "remount,bind,ro", point)


def memory_bytes(groups: Sequence[str]) -> int:
    """What processes, files in memory, the kernel and sockets hold for the room, without the cache of files on disk;
    0 where no group counts it."""
    for group in groups:
        if Path(group, "memory.usage_in_bytes").exists():
            rows = (line.split() for line in Path(group, "memory.stat").read_text().splitlines())
            stat = {key: int(value) for key, value in rows}
            cache, shared = (stat[name] for name in CACHE)
            return _number(group, "memory.usage_in_bytes") + _number(group, "memory.kmem.tcp.usage_in_bytes") - (
                cache - shared
            )  # fmt: skip
    return 0


def _number(group: str, name: str) -> int:
    path = Path(group, name)
    return int(path.read_text()) if path.exists() else 0


def _mounted() -> list[str]:
    """The last mounted first: one may lie on another."""
    lines = [line.split() for line in MOUNTINFO.read_text().splitlines()]
    return [line[4] for line in reversed(lines) if line[line.index("-") + 1] in {"cgroup", "cgroup2"}]
