"""A tree of processes as /proc shows it (man 5 proc)."""

import contextlib
import itertools
import os

TICKS_HZ = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
PROCESSES_MAX = 5000
MAPS_MAX = 100000
SHARED = b" /dev/zero (deleted)\n"
PIECE_BYTES = 64 << 20


def descendants(pid):
    """Ids of all that runs below a process, of as many as a look may cost."""
    found = []
    waiting = [pid]
    while waiting and len(found) < PROCESSES_MAX:
        children = _children(waiting.pop())
        found.extend(children)
        waiting.extend(children)
    return found


def _children(pid):
    try:
        threads = os.listdir("/proc/{}/task".format(pid))
    except OSError:
        return []  # it has ended
    return [child for thread in threads for child in _children_of_thread(pid, thread)]


def _children_of_thread(pid, thread):
    try:
        with open("/proc/{}/task/{}/children".format(pid, thread)) as file:
            return [int(child) for child in file.read().split()]
    except OSError:
        return []


def cpu_s(pid):
    """Of a process and of the children that it waited for."""
    try:
        with open("/proc/{}/stat".format(pid), "rb") as file:  # with a name that it gave itself, in any bytes
            fields = file.read().rpartition(b")")[2].split()
        return sum(int(ticks) for ticks in fields[11:15]) / TICKS_HZ
    except (OSError, IndexError, ValueError):
        return 0.0


def descriptors(pid):
    """How many files, pipes and sockets it has open."""
    try:
        return len(os.listdir("/proc/{}/fd".format(pid)))
    except OSError:
        return 0


def shared_memory(pids):
    """(bytes, maps): memory without a name that processes share, each piece once, and how many maps were looked at.

    The kernel keeps a piece for as long as any of it is mapped, though no process is shown to hold what it let go: a
    piece counts up to the last byte that is mapped, and for no less than `PIECE_BYTES`.
    """
    ends, maps = {}, 0
    for pid in pids:
        with contextlib.suppress(OSError), open("/proc/{}/maps".format(pid), "rb") as file:
            for line in itertools.islice(file, max(0, MAPS_MAX + 1 - maps)):
                maps += 1
                if line.endswith(SHARED):
                    where, _, offset, _, inode, _ = line.split(None, 5)
                    first, last = (int(part, 16) for part in where.split(b"-"))
                    ends[inode] = max(ends.get(inode, PIECE_BYTES), int(offset, 16) + last - first)
    return sum(ends.values()), maps


def resident_bytes(pid):
    try:
        with open("/proc/{}/statm".format(pid)) as file:
            return int(file.read().split()[1]) * PAGE_BYTES
    except (OSError, IndexError, ValueError):
        return 0
