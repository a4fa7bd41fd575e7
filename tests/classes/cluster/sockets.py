"""What a process and all that it started listen on, as the kernel tells it."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from tests.support.processes import children_of

LISTENING = "0A"


def tree_of(pid: int) -> list[int]:
    """The process and all below it."""
    return [pid, *(below for child in children_of(pid) for below in tree_of(child))]


def listening_ports(pid: int) -> list[int]:
    """Ports of TCP, over IPv4 or IPv6, of the whole tree."""
    found = {inode: port for name in ("tcp", "tcp6") for inode, port in _listening(Path("/proc/net", name))}
    held = {inode for one in tree_of(pid) for inode in _inodes(one)}
    return sorted(port for inode, port in found.items() if inode in held)


def _listening(table: Path) -> list[tuple[str, int]]:
    rows = [row.split() for row in table.read_text().splitlines()[1:]]
    return [(row[9], int(row[1].rpartition(":")[2], 16)) for row in rows if row[3] == LISTENING]


def _inodes(pid: int) -> list[str]:
    inodes = []
    for link in Path(f"/proc/{pid}/fd").glob("*"):
        with suppress(OSError):
            inodes += re.findall(r"^socket:\[(\d+)\]$", str(link.readlink()))
    return inodes
