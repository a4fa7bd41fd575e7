"""How much memory a run may count on."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

MEMINFO = Path("/proc/meminfo")
CONTAINER = (
    (Path("/sys/fs/cgroup"), "memory.max", "memory.current", "inactive_file"),
    (
        Path("/sys/fs/cgroup/memory"),
        "memory.limit_in_bytes",
        "memory.usage_in_bytes",
        "total_inactive_file",
    ),
)
"""Where a container's limit stands, in control groups of version 2 and of version 1."""
UNLIMITED_BYTES = 1 << 62


def available_bytes() -> int:
    """What new processes can have without anything being swapped out, of the machine and of its container."""
    machine = _numbers(MEMINFO).get("MemAvailable", UNLIMITED_BYTES >> 10) * 1024
    return min([machine, *(_left_bytes(*place) for place in CONTAINER)])


def _left_bytes(folder: Path, limit: str, used: str, cache: str) -> int:
    """What a control group still gives; its page cache is given up where it is needed."""
    with suppress(OSError, ValueError):  # no such group, or no limit: it says "max"
        reclaimable = _numbers(folder / "memory.stat").get(cache, 0)
        return int((folder / limit).read_text()) - int((folder / used).read_text()) + reclaimable
    return UNLIMITED_BYTES


def _numbers(path: Path) -> dict[str, int]:
    """`name number` or `name: number`, a line each."""
    words = [line.replace(":", " ").split() for line in path.read_text().splitlines()]
    return {word[0]: int(word[1]) for word in words if len(word) > 1 and word[1].isdigit()}
