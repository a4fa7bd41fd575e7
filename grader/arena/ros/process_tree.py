"""A tree of processes: what /proc shows of it (man 5 proc), and the control groups that hold its memory and tasks."""

import contextlib
import itertools
import os
import secrets

TICKS_HZ = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
PROCESSES_MAX = 5000
MAPS_MAX = 100000
# So /proc names anonymous memory that is shared (man 2 mmap, MAP_SHARED | MAP_ANONYMOUS).
SHARED = b" /dev/zero (deleted)\n"
PIECE_BYTES = 64 << 20
READ_BYTES = 1 << 16
KEYS = {
    ("memory", 1): "memory.limit_in_bytes",
    ("memory", 2): "memory.max",
    ("pids", 1): "pids.max",
    ("pids", 2): "pids.max",
}
# Version 1 limits memory and swap together, version 2 swap alone.
SWAP = {1: "memory.memsw.limit_in_bytes", 2: "memory.swap.max"}
PEAK = "memory.max_usage_in_bytes"
NEAR_BYTES = 4 << 20  # the kernel charges in pieces, the largest is a huge page
KILLS = {1: "memory.oom_control", 2: "memory.events"}


def descendants(pid):
    """Return the ids of all that runs below a process, of as many as a look may cost."""
    found = []
    waiting = [pid]
    while waiting and len(found) < PROCESSES_MAX:
        children = _children(waiting.pop())
        found.extend(children)
        waiting.extend(children)
    return found


def _children(pid):
    return [child for thread in _threads(pid) for child in _children_of_thread(pid, thread)]


def _threads(pid):
    try:
        return os.listdir("/proc/{}/task".format(pid))
    except OSError:
        return []  # it has ended


def _read(path):
    """Return what the kernel says in a file of a few lines: `open` would take three times as long. Raise OSError."""
    number = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        return os.read(number, READ_BYTES)
    finally:
        os.close(number)


def _children_of_thread(pid, thread):
    try:
        with open("/proc/{}/task/{}/children".format(pid, thread)) as file:
            return [int(child) for child in file.read().split()]
    except OSError:
        return []


def cpu_s(pid):
    """Return the CPU seconds of a process and of the children that it waited for."""
    return read_stat(pid)[1]


def read_stat(pid):
    """Return a process's parent, 0 where it has ended, its CPU seconds with those of waited-for children, and how often
    it has touched memory that was new to it."""
    try:
        fields = _read("/proc/{}/stat".format(pid)).rpartition(b")")[2].split()  # its name may be any bytes
        return int(fields[1]), sum(map(int, fields[11:15])) / TICKS_HZ, int(fields[7])
    except (OSError, IndexError, ValueError):
        return 0, 0.0, 0


def descriptors(pid):
    """Return the numbers of the files, pipes and sockets that it has open."""
    try:
        return os.listdir("/proc/{}/fd".format(pid))
    except OSError:
        return []  # it has ended, or is not ours to look into


def waits_in(pid, thread):
    """Return where in the kernel a thread waits, or "" where that is not shown."""
    try:
        return _read("/proc/{}/task/{}/wchan".format(pid, thread)).decode()
    except OSError:
        return ""


def _call(pid, thread):
    """Return the system call in which a thread waits, its number and its arguments; nothing where that is not shown."""
    try:
        return _read("/proc/{}/task/{}/syscall".format(pid, thread)).split()
    except OSError:
        return []


def _waits_for_others(pid, thread):
    """Return whether a thread waits for another one, a connection or what comes over one, and sets itself no limit:
    without the others, it never does anything again (man 2 futex: the fourth argument is the limit)."""
    where = waits_in(pid, thread)
    if "futex" not in where:
        return any(name in where for name in ("accept", "wait_woken", "sk_wait_data"))
    return _call(pid, thread)[4:5] == [b"0x0"]


def _naps(pid, thread):
    """Return whether a thread sleeps for a time: in `nanosleep`, or in a `select` of no files, as Python 3.8 does."""
    where = waits_in(pid, thread)
    return "nanosleep" in where or ("poll" in where and _call(pid, thread)[1:2] == [b"0x0"])


def _wakes(pid, thread):
    """Return how often a thread has waited for something so far."""
    try:
        text = _read("/proc/{}/task/{}/status".format(pid, thread))
        return int(text.rpartition(b"\nvoluntary_ctxt_switches:")[2].split(None, 1)[0])
    except (OSError, IndexError, ValueError):
        return 0


def _is_compiled(pid):
    """Return whether it is no Python, of which some versions do not show that a thread sleeps."""
    try:
        return "python" not in os.path.basename(os.readlink("/proc/{}/exe".format(pid)))
    except OSError:
        return False


def _late_s(pid, thread):
    """Return how long a thread has waited for a processor so far."""
    try:
        return int(_read("/proc/{}/task/{}/schedstat".format(pid, thread)).split()[1]) / 1e9
    except (OSError, IndexError, ValueError):
        return 0.0


def shared_memory(pids):
    """Return (bytes, maps): the memory without a name that processes share, each piece once, and how many maps were
    looked at.

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
        return int(_read("/proc/{}/statm".format(pid)).split()[1]) * PAGE_BYTES
    except (OSError, IndexError, ValueError):
        return 0


LOOK_S, LOOK_OFTEN_S, LOOK_RARELY_S = 0.25, 0.1, 2.0
PROGRAMS_MAX, THREADS_MAX = 30, 200
"""Past these, a tree is not looked at closely and counts as busy."""
ASLEEP_S = 0.8
"""`rospy.spin()` wakes every 0.5 s."""
WORKING = 0.4
# Twice a second, with room for what a callback or a log message wakes.
SPIN_HZ = 3.2
TURNS, TURNS_S = 3, 3.0
"""A program of one thread, so no node, that sleeps again and again: so many times, for so long."""
COMPUTES_S, STUCK_S = 0.6, 5.0
"""CPU seconds in one stretch, without new memory: so many, and a program computes; so many, and it does only that."""
GROWS = 25
"""A program that touches more pages of new memory than these from look to look imports or loads something."""


class Rest:
    """Whether a program has come to rest: it does little, and wakes again and again, as a loop or `spin()` does.

    A long sleep is not a rest, since no one knows what comes after it; a compiled program whose main thread waits for
    others (`MultiThreadedSpinner`, `rosbag record`) rests as a loop does, and so does any whose threads all wait for
    each other, or for what comes (a lock that is taken twice). `since_s` is when the rest began, or None. It
    `spins` while its main thread wakes about twice a second (rospy), or waits for callbacks alone (roscpp).
    `computed_s` are the CPU seconds of its last stretch of work in the same memory, as `while True: pass` does.
    """

    def __init__(self, pid, now_s):
        self._pid = pid
        self.since_s = None
        self.spins = False
        self.computed_s = 0.0
        self._wakes = self._wakes_before = 0
        self._woke_s = self._looked_s = now_s
        self._late_s = {}
        self._used_s, self._pages = 0.0, 0
        self._naps = {}
        self._awake = {}
        self._turns, self._turning_s = 0, now_s

    def look(self, now_s, used_s, pages):
        """`used_s` are the CPU seconds that the program has used so far, `pages` those of its memory that it
        touched."""
        wakes = _wakes(self._pid, self._pid)
        if wakes != self._wakes:
            self._woke_s = now_s
        threads = _threads(self._pid)
        napping, asleep = self._others(threads, now_s)
        late_s = {thread: _late_s(self._pid, thread) for thread in threads[:THREADS_MAX]}
        waited_s = max((late_s[thread] - self._late_s.get(thread, 0.0) for thread in late_s), default=0.0)
        work_s = used_s - self._used_s + waited_s
        # The first look has nothing to compare with. Waiting for a processor is work that others keep it from.
        working = self._late_s == {} or work_s > WORKING * (now_s - self._looked_s)
        sleeps, waits = now_s - self._woke_s > ASLEEP_S, "futex" in waits_in(self._pid, self._pid)
        if working or asleep or (sleeps and not (waits and self._rests_asleep(threads, now_s))):
            self.since_s = None
        elif self.since_s is None:
            self.since_s, self._wakes_before = now_s, wakes
            self._only_callbacks, self._napping = True, False
        if self.since_s is not None:
            self._only_callbacks = self._only_callbacks and waits
            self._napping = self._napping or napping
            # One more for a wake-up that falls on the edge of the time that is looked at.
            rarely = wakes - self._wakes_before <= SPIN_HZ * (now_s - self.since_s) + 1
            self.spins = not (self._napping or sleeps) and (rarely or self._only_callbacks)
        grows = pages - self._pages > GROWS
        if working or grows or len(threads) > 1 or not _naps(self._pid, self._pid):
            self._turns, self._turning_s = 0, now_s
        else:
            self._turns += wakes != self._wakes
        self.computed_s = self.computed_s + used_s - self._used_s if working and not grows else 0.0
        self._used_s, self._pages, self._late_s = used_s, pages, late_s
        self._wakes, self._looked_s = wakes, now_s

    @property
    def kind(self):
        """Return `spins`, `loops`, `naps` (it loops, and is no node), `computes`, `stuck` (it has computed for
        long), or None where it is not at rest."""
        if self._turns >= TURNS and self._looked_s - self._turning_s >= TURNS_S:
            return "naps"
        if self.since_s is not None:
            return "spins" if self.spins else "loops"
        return (
            "stuck" if self.computed_s >= STUCK_S else "computes" if self.computed_s >= COMPUTES_S else None
        )

    def _rests_asleep(self, threads, now_s):
        """Return whether a program whose main thread waits for others does nothing by itself: none of these sleeps."""
        if _is_compiled(self._pid):
            return True
        awake = {}
        for thread in threads:
            if _naps(self._pid, thread):
                return False
            if not _waits_for_others(self._pid, thread):
                wakes, before = _wakes(self._pid, thread), self._awake.get(thread)
                awake[thread] = before if before and before[0] == wakes else (wakes, now_s)
        self._awake = awake
        return str(self._pid) not in awake and all(
            now_s - since_s <= ASLEEP_S for _, since_s in awake.values()
        )

    def _others(self, threads, now_s):
        """Return whether one of the other threads sleeps for a time, and whether for long (a timer, say)."""
        naps = {}
        if len(threads) > THREADS_MAX:
            return True, True
        for thread in threads:
            if thread != str(self._pid) and "nanosleep" in waits_in(self._pid, thread):
                wakes = _wakes(self._pid, thread)
                before = self._naps.get(thread)
                naps[thread] = before if before and before[0] == wakes else (wakes, now_s)
        self._naps = naps
        return bool(naps), any(now_s - since_s > ASLEEP_S for _, since_s in naps.values())


KINDS = (None, "computes", "stuck", "naps", "loops", "spins")
"""The kinds of rest: a tree's is the first of these that one of its programs has."""


class TreeRest:
    """The same of a tree: of all its programs. Shells that wait for the program that they started do not count.
    `computed_s` is that of the program that has computed longest."""

    def __init__(self):
        self.computed_s = 0.0
        self._programs = {}

    def look(self, pids, now_s):
        """Return (rest, programs): one of `KINDS`, and how many programs have no others below them."""
        if len(pids) > PROGRAMS_MAX:
            return None, PROGRAMS_MAX
        # The kernel's function behind `wait` (man 2): a shell whose child runs.
        pids = [pid for pid in pids if not waits_in(pid, pid).startswith("do_wait")]
        seen = {pid: read_stat(pid) for pid in pids}
        self._programs = {pid: self._programs.get(pid) or Rest(pid, now_s) for pid in pids}
        for pid, program in self._programs.items():
            program.look(now_s, *seen[pid][1:])
        self.computed_s = max((program.computed_s for program in self._programs.values()), default=0.0)
        parents = {parent for parent, _, _ in seen.values()}
        last = [pid for pid in pids if pid not in parents]
        above = [p for pid, p in self._programs.items() if pid in parents]
        if not last or any(program.kind is None for program in above):
            return None, len(last)
        # One program that is not at rest keeps the tree from it.
        return min((self._programs[pid].kind for pid in last), key=KINDS.index), len(last)


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
        folder = self._shared_groups(version, parent)
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

    def _shared_groups(self, version, parent):
        """Return the folder of the group to make. Of version 2, a process is in one group only, so that one has all
        controllers."""
        made = [folder for known, folder in self._made.values() if known == version == 2]
        ours = "grader-{}-{}".format(os.getpid(), secrets.token_hex(6))
        return made[0] if made and os.path.dirname(made[0]) == parent else os.path.join(parent, ours)

    @property
    def holds_memory(self):
        return "memory" in self._made

    def take(self, pids):
        """Put these processes, and all that they start from now on, into the groups."""
        for folder in {folder for _, folder in self._made.values()}:
            for pid in pids:
                with contextlib.suppress(OSError):  # it has ended
                    _write(folder, "cgroup.procs", pid)

    def pids(self):
        """Return the ids of all processes of the tree; none where no group knows them."""
        with contextlib.suppress(OSError, ValueError, StopIteration):  # no group was made, or it is gone
            _, folder = next(iter(self._made.values()))
            with open(os.path.join(folder, "cgroup.procs")) as file:
                return [int(pid) for pid in file]
        return []

    def memory_kills(self):
        """Return how often the kernel killed a process because the tree had too much memory. What it kills because the
        whole machine has too little is counted in the same place; then this group never came to its own limit."""
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
        """Return the CPU seconds of all that ever ran in the tree, waited for or not; None if no group counts them."""
        if "cpuacct" not in self._made:
            return None
        version, folder = self._made["cpuacct"]
        if version == 1:
            return _number(folder, "cpuacct.usage") / 1e9
        return dict(_rows(folder, "cpu.stat")).get("usage_usec", 0) / 1e6

    def remove(self):
        """Remove the groups once their processes have ended. Return whether nothing is left."""
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
        return int(_read(os.path.join(folder, name)))
    except (OSError, ValueError):
        return 0


def _write(folder, name, value):
    with open(os.path.join(folder, name), "w") as file:
        file.write(str(value))
