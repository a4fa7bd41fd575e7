"""A tree of processes: what /proc shows of it (man 5 proc), and the control groups that hold its memory and tasks."""

import contextlib
import itertools
import os
import secrets

TICKS_HZ = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
PROCESSES_MAX = 5000
MAPS_MAX = 100000
SHARED = b" /dev/zero (deleted)\n"
PIECE_BYTES = 64 << 20
KEYS = {
    ("memory", 1): "memory.limit_in_bytes",
    ("memory", 2): "memory.max",
    ("pids", 1): "pids.max",
    ("pids", 2): "pids.max",
}
SWAP = {1: "memory.memsw.limit_in_bytes", 2: "memory.swap.max"}
PEAK = "memory.max_usage_in_bytes"
NEAR_BYTES = 4 << 20  # the kernel charges in pieces, the largest is a huge page
KILLS = {1: "memory.oom_control", 2: "memory.events"}


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
    """Return the numbers of the files, pipes and sockets that it has open."""
    try:
        return os.listdir("/proc/{}/fd".format(pid))
    except OSError:
        return []  # it has ended, or is not ours to look into


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


class Groups:
    """`cgroups` maps `memory`, `pids` and `cpuacct` to {version, folder}, or to None.

    grader/arena/control_groups.py finds them.
    """

    def __init__(self, cgroups, limits):
        self._made = {}
        wanted = {"memory": limits["memory_bytes"], "pids": limits["tasks"], "cpuacct": None}
        for controller, amount in wanted.items():
            found = cgroups.get(controller)
            if found:
                self._make(controller, found["version"], found["folder"], amount)

    def _make(self, controller, version, parent, amount):
        folder = self._shared(version, parent)
        try:
            os.makedirs(folder, exist_ok=True)
            if amount is not None:
                _write(folder, KEYS[controller, version], amount)
        except OSError:  # then the watchdog is alone
            with contextlib.suppress(OSError):  # it was not made at all
                os.rmdir(folder)
            return
        self._made[controller] = (version, folder)
        if controller == "memory":
            with contextlib.suppress(OSError):  # a kernel without swap accounting
                _write(folder, SWAP[version], amount if version == 1 else 0)

    def _shared(self, version, parent):
        """Of version 2, a process is in one group only, which has all controllers."""
        made = [folder for known, folder in self._made.values() if known == version == 2]
        ours = "grader-{}-{}".format(os.getpid(), secrets.token_hex(6))
        return made[0] if made and os.path.dirname(made[0]) == parent else os.path.join(parent, ours)

    @property
    def holds_memory(self):
        return "memory" in self._made

    def take(self, pids):
        """These processes, and all that they start from now on, belong to the groups."""
        for folder in {folder for _, folder in self._made.values()}:
            for pid in pids:
                with contextlib.suppress(OSError):  # it has ended
                    _write(folder, "cgroup.procs", pid)

    def memory_kills(self):
        """How often the kernel killed a process because the tree had too much memory. What it kills because the whole
        machine has too little counts here too: then this group never came to its own limit."""
        if "memory" not in self._made:
            return 0
        version, folder = self._made["memory"]
        events = dict(_rows(folder, KILLS[version]))
        if version == 2:
            reached = events.get("oom", 0) > 0
        else:
            reached = _number(folder, PEAK) > _number(folder, KEYS["memory", 1]) - NEAR_BYTES
        return events.get("oom_kill", 0) if reached else 0

    def cpu_s(self):
        """Of all that ever ran in the tree, waited for or not; None where no group counts it."""
        if "cpuacct" not in self._made:
            return None
        version, folder = self._made["cpuacct"]
        if version == 1:
            return _number(folder, "cpuacct.usage") / 1e9
        return dict(_rows(folder, "cpu.stat")).get("usage_usec", 0) / 1e6

    def remove(self):
        """Once its processes have ended. Gives back whether nothing is left."""
        for folder in {folder for _, folder in self._made.values()}:
            with contextlib.suppress(OSError):  # a process of it is still ending
                os.rmdir(folder)
        self._made = {name: made for name, made in self._made.items() if os.path.exists(made[1])}
        return not self._made


def _rows(folder, name):
    try:
        with open(os.path.join(folder, name)) as file:
            return [(key, int(value)) for key, value in (line.split() for line in file)]
    except (OSError, ValueError):
        return []


def _number(folder, name):
    try:
        with open(os.path.join(folder, name)) as file:
            return int(file.read())
    except (OSError, ValueError):
        return 0


def _write(folder, name, value):
    with open(os.path.join(folder, name), "w") as file:
        file.write(str(value))
