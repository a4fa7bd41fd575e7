"""Runs processes, reads what they print, stops them, counts what they used, and looks at the files that they left."""

import base64
import contextlib
import json
import os
import signal
import stat
import time
from pathlib import PurePosixPath

from launching import launch
from process_tree import (
    LOOK_OFTEN_S,
    LOOK_RARELY_S,
    LOOK_S,
    MAPS_MAX,
    PROGRAMS_MAX,
    TreeRest,
    cpu_s,
    descendants,
    descriptors,
    resident_bytes,
    shared_memory,
)

WATCH_S = 0.5
ENDS_COMPUTING, STILL_COMPUTES = 0.2, 0.1
"""A program that computes behind Ctrl-C for so large a part of the time that it has to end in, will not end by it: the
second, where it computed before. `roslaunch`, whose nodes hear of it later, has more time than a script."""
COMPUTES_BEHIND_TERM_S = 0.2
WORDS_BYTES = 200
INFO_BYTES_MAX = 4096
LINE_BYTES_MAX = 4096
READ_BYTES = 65536
PIPE_READS = 16


class Process:
    """One process tree. `spec` is made by `ProcessEnvironment.spec` (arena/process_environment.py): name,
    role, argv, env, outer, bwrap, wall, filter, shell, collect, script, repairs, stdin (whether it has one), keeps,
    again (whether it may be started once more: `scratches` are then those of its earlier life).

    `keeps` are patterns of files: what the process leaves is listed, and what fits is handed over.

    `collect` names a file for what the process writes to `{collect}`, and how many bytes of it are taken.
    """

    def __init__(self, loop, wire, spec, limits, on_exit, *, groups=None, stage=None, scratches=()):
        self.name = spec["name"]
        self.role = spec["role"]
        self.alive = True
        self.loop = loop
        self._wire = wire
        self._limits = limits
        self._on_exit = on_exit
        self._lines = 0
        self._bytes = 0
        self.printed_too_much = False
        self._stopped_by = None
        self._entered = False
        self._last_line = ""
        self._peak_bytes = 0
        self._cpu_s = 0.0
        self._inner_pid = None
        self._open_streams = 0
        self._status = None
        self._groups = groups
        self._stage = stage
        self._collected = None
        self._keeps = spec["keeps"]
        self.again = spec["again"]
        self._spawn(spec, scratches)
        self._event("start", argv=spec["argv"], script=spec["script"], repairs=spec["repairs"])
        loop.call_later(WATCH_S, self._watch)
        self._rest, self._rest_told, self._ends_within_s = TreeRest(), (None, 0), 0.0
        if self.role == "student":
            loop.call_later(LOOK_S, self._look)

    def stop(self, int_s, term_s):
        """Send INT to the whole process group, as Ctrl-C in a terminal does, TERM after `int_s`, KILL after another
        `term_s`."""
        if not self.alive:
            return
        self._stopped_by = "INT"
        computed = self._rest_told[0] in ("computes", "stuck")
        # Counted from the signal on: what it computed before is no sign that it ignores it.
        self._rest = TreeRest()
        self._ends_within_s = int_s * (STILL_COMPUTES if computed else ENDS_COMPUTING)
        self._signal_group(signal.SIGINT)
        self.loop.call_later(int_s, self._terminate)
        self.loop.call_later(int_s + term_s, self.kill)

    def kill(self):
        if self.alive:
            self._stopped_by = "KILL"
            self._signal_group(signal.SIGKILL)
            if self._status is None:
                with contextlib.suppress(ProcessLookupError, PermissionError):  # already over
                    # bubblewrap's own process stands outside of the namespace, in another group.
                    os.killpg(self.pid, signal.SIGKILL)

    def type(self, data):
        """Write to its standard input. What a full pipe does not take is lost, and noted."""
        try:
            written = os.write(self._popen.stdin.fileno(), data) if self._popen.stdin else 0
        except OSError:  # it reads no more, or the pipe is full
            written = 0
        if written < len(data):
            detail = "did not take what was typed: it reads no standard input"
            self._wire.event("/grader/actor", {"action": "note", "actor": self.name, "detail": detail})

    def reap(self):
        """Take the exit status if there is one; tell it once the last output is read.

        bubblewrap's own process does not wait for its namespace, so the usage of what ran in there comes with the
        namespace's init, which the arena inherits.
        """
        if self._status is None:
            # Not `Popen.poll`: it would throw the usage away.
            pid, status, usage = os.wait4(self.pid, os.WNOHANG)
            if pid == 0:
                return
            self._popen.returncode = status
            self._status = status
            self._count(usage)
            if self._inner_pid is None:
                # Without a sandbox no namespace ends with the first process: what it left in its group would go on.
                self._signal_group(signal.SIGKILL)
            # What still holds stdout open (a daemon, say) is not waited for.
            self.loop.call_later(WATCH_S, self._finish)
        if self._inner_pid is not None:
            try:
                pid, _, usage = os.wait4(self._inner_pid, os.WNOHANG)
            except ChildProcessError:
                return  # bubblewrap's still: it comes to the arena when that ends
            if pid == 0:
                return
            self._inner_pid = None
            self._count(usage)
        self._finish_when_read()

    def _count(self, usage):
        self._cpu_s += usage.ru_utime + usage.ru_stime
        self._peak_bytes = max(self._peak_bytes, usage.ru_maxrss * 1024)

    def _spawn(self, spec, scratches):
        launched = launch(spec, self._stage, self._groups, scratches)
        self._popen = launched.popen
        self.scratches = launched.scratches
        self._places = _places(spec["wall"] or [], launched.scratches, self._stage)
        self.pid = self._popen.pid
        if launched.info is not None:
            self._read_info(launched.info)
        if self._popen.stdin:
            os.set_blocking(self._popen.stdin.fileno(), False)
        self._give_leave(launched.lifeline)
        for name, pipe in (("stdout", self._popen.stdout), ("stderr", self._popen.stderr)):
            self._open_streams += 1
            Lines(self, name, pipe)
        if launched.collect is not None:
            self._open_streams += 1
            self._collected = Collected(self, launched.collect, **spec["collect"])

    def _give_leave(self, lifeline):
        """Let the process run its program as soon as it says that it is in its sandbox, which ends with the arena."""

        def readable():
            self.loop.remove_reader(lifeline)
            with contextlib.suppress(OSError):  # it has ended already
                if lifeline.recv(1):
                    self._entered = True
                    if self._groups is not None:
                        self._groups.take(self.tree())
                    lifeline.sendall(b"\n")
            lifeline.close()

        self.loop.add_reader(lifeline, readable)

    def _read_info(self, info_r):
        """Read from bubblewrap which process is the first one of the new PID namespace."""
        text = b""

        def readable():
            nonlocal text
            chunk = os.read(info_r, INFO_BYTES_MAX)
            text += chunk
            if chunk and b"}" not in text and len(text) < INFO_BYTES_MAX:
                return
            self.loop.remove_reader(info_r)
            os.close(info_r)
            with contextlib.suppress(ValueError, KeyError, TypeError):  # it ended before it could say it
                self._inner_pid = int(json.loads(text.decode())["child-pid"])

        self.loop.add_reader(info_r, readable)

    def _signal_group(self, number):
        """Send a signal to the group of the inner process, which leads a session of its own. (The init of its
        namespace, in the same group, ignores a signal that it has no handler for.)"""
        with contextlib.suppress(ProcessLookupError, PermissionError):  # already over
            os.killpg(self._inner_pid or self.pid, number)

    def _terminate(self):
        if self.alive and self._stopped_by != "KILL":
            self._stopped_by = "TERM"
            self._rest, self._ends_within_s = TreeRest(), COMPUTES_BEHIND_TERM_S
            # Each process, not the group: roslaunch starts its nodes in groups of their own.
            for pid in self._tree():
                _kill(pid, signal.SIGTERM)

    def _tree(self):
        """Return the student's own processes, without bubblewrap's two."""
        return [pid for pid in self._below() if pid != self._inner_pid]

    def tree(self):
        """Return the ids of all its processes, bubblewrap's own too."""
        return [self.pid, *self._below()]

    def _below(self):
        """Return the ids of those below the first. In a sandbox, its control group knows them all at once."""
        in_group = (
            self._groups.pids() if self._groups is not None and self._inner_pid and self._entered else []
        )
        return [pid for pid in in_group if pid != self.pid] if self.pid in in_group else descendants(self.pid)

    def cpu_used_s(self):
        """Return the CPU seconds of the whole tree so far, ended processes included. A control group also counts
        children that nobody waited for, and is asked faster than each process."""
        counted_s = self._groups.cpu_s() if self._groups is not None else None
        if counted_s:
            return max(counted_s, self._cpu_s)
        roots = [pid for pid in (self._inner_pid, None if self._status is not None else self.pid) if pid]
        tree = {pid for root in roots for pid in (root, *descendants(root))}
        return self._cpu_s + sum(map(cpu_s, tree))

    def left_behind(self):
        """Return the process ids of the tree that still run."""
        return self._tree() if self.alive else []

    def _watch(self):
        if not self.alive:
            return
        excess = self._excess(self.tree()) if self.role != "grader" else None
        if excess is None:
            self.loop.call_later(WATCH_S, self._watch)
        else:
            self.stop_for(excess)

    def _look(self):
        """Tell the grader when the tree comes to rest, and when it moves again. One that computes on behind a signal
        will not end by it."""
        if not self.alive:
            return
        tree = self._tree() if self._entered else []
        found = self._rest.look(tree, time.monotonic())
        if self._stopped_by is not None and self._rest.computed_s > self._ends_within_s:
            if self._stopped_by == "INT":
                self._terminate()
            else:
                self.kill()
        if found != self._rest_told:
            self._rest_told = found
            rest, programs = found
            self._wire.status("rest", name=self.name, rest=rest, programs=programs)
        look_s = LOOK_S if self._stopped_by is None else LOOK_OFTEN_S
        self.loop.call_later(look_s if len(tree) <= PROGRAMS_MAX else LOOK_RARELY_S, self._look)

    def _excess(self, tree):
        """Return what the tree has too much of, in words, or None."""
        resident = sum(map(resident_bytes, tree))
        self._peak_bytes = max(self._peak_bytes, resident)
        used_s = self.cpu_used_s()
        if self._groups is not None and self._groups.memory_kills():
            return self._too_much_memory()
        held = self._groups is not None and self._groups.holds_memory
        if not held and self._holds_too_much(tree, resident):
            return self._too_much_memory()
        if len(tree) > self._limits["processes"]:
            return "more than {} processes".format(self._limits["processes"])
        if used_s > self._limits["cpu_s"]:
            return "more than {:g} s of CPU time".format(self._limits["cpu_s"])
        if sum(len(descriptors(pid)) for pid in tree) > self._limits["descriptors"]:
            return "more than {} files, pipes and sockets open".format(self._limits["descriptors"])
        return None

    def _holds_too_much(self, tree, resident):
        """Return whether the tree has too much memory, where no control group counts it: besides the pages of its
        processes, files in memory and shared memory."""
        shared, maps = shared_memory(tree)
        written = sum(self._stage.used_bytes(name) for name in self.scratches)
        return resident + written + shared > self._limits["memory_bytes"] or maps > MAPS_MAX

    def descriptors(self):
        """Return how many files, pipes and sockets the whole tree has open."""
        return sum(len(descriptors(pid)) for pid in self.tree())

    def _too_much_memory(self):
        return "more than {} MB of memory".format(self._limits["memory_bytes"] >> 20)

    def stop_for(self, excess):
        """Kill it, and say what it had too much of."""
        if self.alive:
            self._limit("stopped by the grader: {}".format(excess))
            self.kill()

    def _limit(self, detail):
        self._wire.event("/grader/actor", {"action": "limit", "actor": self.name, "detail": detail})

    def line(self, stream, data, cut):
        """Handle one line of output; past the limits, output is read and thrown away."""
        if not self._entered:
            self._last_line = data[:WORDS_BYTES].decode("utf-8", "replace")
        self._lines += 1
        self._bytes += len(data)
        if self.printed_too_much:
            return
        if self._lines > self._limits["output_lines"] or self._bytes > self._limits["output_bytes"]:
            self.printed_too_much = True
            self._console(stream, "… output past the limit is left out", True)
            most = self._limits["output_lines"], self._limits["output_bytes"] >> 20
            self._limit("printed more than {} lines or {} MB".format(*most))
            return
        self._console(stream, data.decode("utf-8", "replace"), cut)

    def _console(self, stream, text, cut):
        record = {"process": self.name, "stream": stream, "line": text, "truncated": cut}
        self._wire.event("/grader/console", record)

    def too_much_collected(self, limit_bytes):
        size = "{} MB".format(limit_bytes >> 20) if limit_bytes >> 20 else "{} kB".format(limit_bytes >> 10)
        self._limit("what the build left is more than {}".format(size))

    def stream_closed(self):
        self._open_streams -= 1
        self._finish_when_read()

    def _finish_when_read(self):
        if self._status is not None and self._open_streams == 0 and self._inner_pid is None:
            self._finish()

    def _finish(self):
        if not self.alive:
            return
        self.alive = False
        if self._popen.stdin:
            with contextlib.suppress(OSError):  # nothing is buffered
                self._popen.stdin.close()
        if self._collected is not None:
            self._collected.close()
        if self._groups is not None:
            self._cpu_s = max(self._cpu_s, self._groups.cpu_s() or 0.0)
        self._leave_groups()
        if not self.again:
            self.give_up()
        if not self._entered and self._stopped_by is None:
            why = "its sandbox was not made: {}".format(self._last_line or "it said nothing")
            self._wire.status("spawn-failed", name=self.name, detail=why)
        status = self._status
        code = os.WEXITSTATUS(status) if os.WIFEXITED(status) else None
        self._event(
            "exit",
            exit_code=code,
            signal=os.WTERMSIG(status) if os.WIFSIGNALED(status) else _signal_of(code),
            stopped_by=self._stopped_by,
            cpu_s=round(self._cpu_s, 4),
            max_rss_bytes=self._peak_bytes,
        )
        self._on_exit(self)

    def give_up(self):
        """Tell which files it left, and give up its memory with them."""
        if self._keeps:
            for file in left_files(self._places, self._keeps, self._limits):
                self._wire.status("left", name=self.name, **file)
        for name in self.scratches:
            self._stage.give_up(name)

    def _leave_groups(self):
        if self._groups is None:
            return
        # The kernel may have ended the whole tree between two looks of `_watch`.
        if self._groups.memory_kills() and self._stopped_by != "KILL":
            self._stopped_by = "KILL"
            self._limit("stopped by the grader: {}".format(self._too_much_memory()))
        if not self._groups.remove():
            self.loop.call_later(WATCH_S, self._groups.remove)

    def _event(self, event, **fields):
        fields.update(event=event, name=self.name, role=self.role)
        self._wire.event("/grader/process", fields)


def kill_orphans():
    """End whatever still descends from the arena: without a sandbox, a student's daemon is adopted by it."""
    for pid in descendants(os.getpid()):
        _kill(pid, signal.SIGKILL)


def reap_all(patience_s):
    """Wait for every child that has been killed; one that the kernel holds on to is not waited for."""
    # `sigtimedwait` sees only signals that are blocked.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGCHLD})
    deadline = time.monotonic() + patience_s
    with contextlib.suppress(ChildProcessError):  # there is none left
        while True:
            pid, _ = os.waitpid(-1, os.WNOHANG)
            left_s = deadline - time.monotonic()
            if pid == 0 and (left_s <= 0 or signal.sigtimedwait({signal.SIGCHLD}, left_s) is None):
                return


def _places(wall, scratches, stage):
    """Return the folders in which a process may leave files: by their paths in its sandbox, where they are outside of
    it. Nothing in `/dev/shm` is a result."""
    inside = [wall[n + 1] for n, word in enumerate(wall) if isinstance(word, dict) and "scratch" in word]
    found = {path: os.path.join(stage.folder, scratches[n]) for n, path in enumerate(inside)}
    return {path: folder for path, folder in found.items() if not path.startswith("/dev/")}


def _signal_of(code):
    """Return the signal that ended a process whose shell or bubblewrap exited with this code: they give 128 + n."""
    return code - 128 if code is not None and 128 < code < 160 else None


def _kill(pid, number):
    with contextlib.suppress(ProcessLookupError, PermissionError):  # already over
        os.kill(pid, number)


class Lines:
    """One of a process's two output streams, cut into lines."""

    def __init__(self, process, name, pipe):
        self._process = process
        self._name = name
        self._pipe = pipe
        self._rest = b""
        os.set_blocking(pipe.fileno(), False)
        process.loop.add_reader(pipe, self._readable)

    def _readable(self):
        try:
            chunk = os.read(self._pipe.fileno(), READ_BYTES)
        except BlockingIOError:
            return
        if not chunk:
            if self._rest:
                self._process.line(self._name, self._rest, False)
            self._process.loop.remove_reader(self._pipe)
            self._pipe.close()
            self._process.stream_closed()
            return
        if self._process.printed_too_much:  # read, so that it does not wait for room, and thrown away
            self._rest = b""
            return
        *lines, self._rest = (self._rest + chunk).split(b"\n")
        for line in lines:
            self._line(line)
        if len(self._rest) > LINE_BYTES_MAX:
            self._line(self._rest)
            self._rest = b""

    def _line(self, line):
        cut = len(line) > LINE_BYTES_MAX
        self._process.line(self._name, line[:LINE_BYTES_MAX].rstrip(b"\r"), cut)


class Collected:
    """What a process hands over: a file that is there once the process has ended, and whole or not at all."""

    def __init__(self, process, descriptor, file, bytes):  # noqa: A002 - the spec's own words
        self._process = process
        self._descriptor = descriptor
        self._path = file
        self._limit_bytes = self._left_bytes = bytes
        self._file = open(file + ".part", "wb")  # noqa: SIM115 - stays open until the process has ended
        os.set_blocking(descriptor, False)
        process.loop.add_reader(descriptor, self._readable)

    def _readable(self):
        if not self._read():
            self._end()
            self._process.stream_closed()

    def _read(self):
        """Take a piece; False at the end."""
        try:
            chunk = os.read(self._descriptor, READ_BYTES)
        except BlockingIOError:
            return True
        self._left_bytes -= len(chunk)
        if self._left_bytes >= 0:
            self._file.write(chunk)
        return bool(chunk)

    def close(self):
        """Take what is still in the pipe, and no more."""
        for _ in range(PIPE_READS):
            if self._descriptor is None or not self._read():
                break
        self._end()

    def _end(self):
        if self._descriptor is None:
            return
        self._process.loop.remove_reader(self._descriptor)
        os.close(self._descriptor)
        self._descriptor = None
        self._file.close()
        part = self._path + ".part"
        if self._left_bytes >= 0:
            os.chmod(part, 0o644)
            os.replace(part, self._path)
        else:
            os.unlink(part)
            self._process.too_much_collected(self._limit_bytes)


# ---- what they left in their memory, once they have ended
# It was written by students: it is listed and read as data. No link is followed and no pipe is waited for.

DEPTH_MAX = 12
LOOKED_AT_MAX = 20000
LISTED_MAX = 50
SHOWN = ".ros"
"""The one hidden folder in which results lie: nodes that roslaunch starts work there."""
LEFT_OUT = ("/.ros/log", "/catkin_ws/build", "/catkin_ws/devel", "/__pycache__")
OPEN = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


def left_files(places, patterns, limits):
    """Yield `path`, `bytes` and `data` of each file. `places` maps paths as processes see them to folders here.

    `data` is base64 where the path ends as one of the patterns says, as long as the limits last; else None.
    """
    room, files, listed = limits["kept_bytes"], limits["kept_files"], 0
    for inside, top in places.items():
        for path, size, name, folder in _regular_files(top, inside):
            data = None
            if files and size <= room and any(PurePosixPath(path).match(pattern) for pattern in patterns):
                data = _read_regular(name, folder, size)
            if data is not None:
                room, files = room - len(data), files - 1
                yield {"path": path, "bytes": len(data), "data": base64.b64encode(data).decode()}
            elif listed < LISTED_MAX:
                listed += 1
                yield {"path": path, "bytes": size, "data": None}


def _regular_files(top, inside):
    """Yield (path for the processes, size, name, descriptor of its folder) of each regular file that shows."""
    looked_at = 0
    for folder, folders, files, descriptor in os.fwalk(top):
        below = inside + folder[len(top) :]
        deep = below.count("/") >= DEPTH_MAX
        folders[:] = [] if deep else sorted(name for name in folders if _shows(below, name))
        for name in sorted(files):
            looked_at += 1
            if looked_at > LOOKED_AT_MAX:
                return
            with contextlib.suppress(OSError):  # it cannot be looked at
                about = os.stat(name, dir_fd=descriptor, follow_symlinks=False)
                if stat.S_ISREG(about.st_mode) and _shows(below, name):
                    path = os.fsencode(os.path.join(below, name)).decode("utf-8", "replace")
                    yield path, about.st_size, name, descriptor


def _shows(below, name):
    # rospack and rosstack write their caches into ROS_HOME in every run.
    hidden = name.startswith((".", "rospack_cache_", "rosstack_cache_")) and name != SHOWN
    return not hidden and not os.path.join(below, name).endswith(LEFT_OUT)


def _read_regular(name, folder, size):
    """Return the bytes of a regular file, `size` at most; None for anything else."""
    with contextlib.suppress(OSError), open(os.open(name, OPEN, dir_fd=folder), "rb") as file:
        if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            return file.read(size)
    return None
