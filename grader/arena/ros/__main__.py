"""The managed roscore: reads commands (one JSON object a line) on stdin, writes frames (`wire`) on stdout.

Runs under ROS's own interpreter and imports nothing but the standard library and ROS. Every arena is a copy of one
process, the template, which has imported all that an arena needs and does nothing else (`stand_by`).

The first line of its stdin configures an arena:
`master` (false for a build, which needs none), `calibrated` (whether the calibration publisher runs), `port`, `limits`,
`suffix` (of its nodes' names), `stage` (the folder over which what sandboxes see is mounted, and the user who writes
there; null without a sandbox). When stdin ends, all ends.
"""

import array
import base64
import contextlib
import gc
import importlib
import json
import os
import resource
import select
import signal
import socket
import struct
import threading

from calibration import Calibration, Lateness, peak_bytes
from loop import Loop
from namespaces import LIBC, Stage, enter_own_namespaces, leave_keys_behind
from process_tree import Groups
from processes import WATCH_S, Process, kill_orphans, reap_all
from sockets import buffer_bytes
from wire import Wire, set_clock

PR_SET_CHILD_SUBREAPER = 36
ROS = ("actor", "guard", "master", "recorder", "rpc", "services", "sockets", "tcpros")
"""What a run needs, and a build does not."""
UNSEEN = ("encodings.idna",)
"""What Python itself imports late: where it first looks up an address."""
# An arena ends after that even if a killed process is still in the kernel.
FINISH_S = 2.0
REAP_S = 1.0
ANSWER = struct.Struct("<id")
DESCRIPTORS = 3
REQUEST_BYTES = 64
OPEN_MAX = 4096
COLLECT_AFTER = 10000
"""So many new objects until Python looks for cycles, of which an arena makes few."""
PYTHONS = (signal.SIGPIPE, signal.SIGXFSZ)
"""Ignored by Python itself, and not in what it starts."""


class Arena:
    def __init__(self, wire, config, calibration):
        self._wire = wire
        self._calibration = calibration
        self._limits = config["limits"]
        self._cgroups = config["cgroups"]
        self._groups = []
        self._stage = Stage(**config["stage"]) if config["stage"] else None
        self._processes = {}
        self._earlier = {}
        self._students = []
        self._finishing = False
        self._clock = None
        self._master = None
        self._input = b""
        self.loop = Loop()
        self.loop.on_child(self._reap)
        self._lateness = Lateness(wire, self._used_s)
        self._lateness.start()
        self.loop.call_later(WATCH_S, self._watch_sockets)
        if config["master"]:
            self._start_master(config)
        # `run_arena` read the first line from the same descriptor, and had to wait for it.
        os.set_blocking(0, False)
        self.loop.add_reader(0, self._command_bytes)
        wire.status("ready", uri=os.environ.get("ROS_MASTER_URI", ""))

    def _start_master(self, config):
        from actor import Actor, SlaveApi  # noqa: PLC0415 - a build needs no ROS imports
        from guard import Guard  # noqa: PLC0415
        from master import RecordingMaster  # noqa: PLC0415
        from rpc import serve  # noqa: PLC0415
        from sockets import Owners  # noqa: PLC0415
        from topic_recorder import Recorder  # noqa: PLC0415

        name = "/grader_{}" + config["suffix"]
        guard, own_ports = Guard(self._wire), set()
        owners = Owners(self._trees, whole=bool(self._stage))
        self._recorder = Recorder(
            self.loop, self._wire, name.format("recorder"), self._limits, guard=guard, own_ports=own_ports
        )
        self._actor = Actor(self.loop, self._wire, name.format("actor"), guard, owners)
        self._master = RecordingMaster(
            self.loop,
            self._wire,
            self._recorder,
            self._actor.caller_id,
            guard=guard,
            owners=owners,
            own_ports=own_ports,
        )
        server = serve(config["port"], self._master.answer, guard, owners, title="the master")
        self._master.uri = os.environ["ROS_MASTER_URI"] = server.uri
        api = serve(0, SlaveApi(self._actor, guard).answer, guard, owners, title="the grader's node")
        self._actor.uri = api.uri
        own_ports.update((server.port, api.port, self._actor.port))
        if self._calibration:
            self._calibration.record(self.loop, self._wire, name.format("calibration"))
        self._actor.stand_in_for_rosout(self._master)
        self._recorder.on_log = self._actor.pass_on_log

    def _command_bytes(self):
        try:
            chunk = os.read(0, 1 << 16)
        except BlockingIOError:
            return
        if not chunk:
            self.loop.remove_reader(0)
            self._finish({})
            return
        *lines, self._input = (self._input + chunk).split(b"\n")
        for line in lines:
            command = json.loads(line.decode())
            getattr(self, "_" + command.pop("do"))(command)

    def _start(self, command):
        self._spawn(command["spec"])

    def _spawn(self, spec):
        spec["env"]["ROS_MASTER_URI"] = os.environ.get("ROS_MASTER_URI", "http://127.0.0.1:11311")
        try:
            groups = self._new_groups() if spec["role"] != "grader" else None
            earlier = self._earlier.pop(spec["name"], None)
            process = Process(
                self.loop,
                self._wire,
                spec,
                self._limits,
                self._on_exit,
                groups=groups,
                stage=self._stage,
                scratches=earlier.scratches if earlier else (),
            )
            self._processes[process.name] = process
            if process.role == "student":
                self._students.append(process)
        except OSError as error:
            self._wire.status("spawn-failed", name=spec["name"], detail=str(error))

    def _new_groups(self):
        groups = Groups(self._cgroups, self._limits)
        self._groups.append(groups)
        return groups

    def clear(self):
        """Once everything has been stopped: nothing of the run shall be left on the machine."""
        kill_orphans()
        reap_all(REAP_S)
        for groups in self._groups:
            groups.remove()

    def _trees(self):
        """Return each process of the run by its name, with the ids of all that runs below it."""
        # A copy of the list: threads that answer calls ask while the loop starts and ends processes.
        return [(process.name, process.tree()) for process in list(self._processes.values())]

    def _used_s(self):
        """Return the CPU seconds of the student's processes so far."""
        return sum(process.cpu_used_s() for process in list(self._students))

    def _interrupt(self, command):
        process, action = self._processes.get(command["name"]), command["action"]
        if process is None:
            return
        self._wire.event("/grader/actor", {"action": action, "actor": "grader", "detail": process.name})
        if action == "kill":
            process.kill()
        else:
            process.stop(command["int_s"], command["term_s"])

    def _type(self, command):
        process = self._processes.get(command["name"])
        if process is not None:
            if command["record"]:
                self._wire.event("/grader/actor", command["record"])
            process.type(base64.b64decode(command["data"]))

    def _advertise(self, command):
        """An action's client takes a server for there only where one node has all five topics: the recorder subscribes
        to the goals, so that the other three are to be its too."""
        if command.pop("of_server", False):
            command["fields"]["known_as"] = self._recorder.caller_id
        self._actor.advertise(self._master, command["fields"])

    def _serve(self, command):
        self._actor.serve(self._master, command["fields"])

    def _publish(self, command):
        self._actor.publish(command["topic"], base64.b64decode(command["data"]))
        if command["record"]:
            self._wire.event("/grader/actor", command["record"])

    def _set_param(self, command):
        self._master.setParam(self._actor.caller_id, command["name"], command["value"])
        self._wire.event("/grader/actor", command["record"])

    def _call(self, command):
        """Call a service, beside the loop: its answer goes to the grader, who can read it."""
        import tcpros  # noqa: PLC0415 - a build needs no ROS imports

        service, uri = command["service"], self._master.service_api(command["service"])
        self._wire.event("/grader/actor", command["record"])
        if uri is None:
            self._wire.status("answer", id=command["id"], error="no such service")
            return

        def ask():
            request = base64.b64decode(command["data"])
            try:
                data = tcpros.call_service(
                    service,
                    uri,
                    self._actor.caller_id,
                    type_=command["type"],
                    request=request,
                    timeout_s=command["timeout_s"],
                )
            except tcpros.ProtocolError as error:
                self._wire.status("answer", id=command["id"], error=str(error))
            else:
                self._wire.status("answer", id=command["id"], data=base64.b64encode(data).decode())

        threading.Thread(target=ask, daemon=True).start()

    def _warp(self, command):
        from actor import CLOCK, Clock  # noqa: PLC0415 - only where there is a master

        self._master.setParam(self._actor.caller_id, "/use_sim_time", True)
        self._actor.advertise(self._master, CLOCK)
        self._clock = Clock(self._actor, command["warp"], command["step_s"], self._helpers)
        self._note_clock(value=command["warp"])
        self._clock.start()

    def _helpers(self):
        """Return the processes that run beside the student's."""
        return {process.name for process in list(self._processes.values()) if process.role == "grader"}

    def _rewarp(self, command):
        self._clock.set_warp(command["warp"])
        self._note_clock(value=command["warp"], detail=command["detail"])

    def _note_clock(self, **fields):
        self._wire.event("/grader/actor", dict(fields, action="clock", actor="grader", topic="/clock"))

    def _hold_clock(self, _command):
        if self._clock:
            self._clock.stop()

    def _graph(self, _command):
        """Ask the nodes for their connections, beside the loop: a node that never answers must not stop it."""

        def ask():
            found, answered = self._master.tell_connections()
            self._wire.status("graph", connections=found, answered=answered)

        threading.Thread(target=ask, daemon=True).start()

    def _finish(self, _command):
        """Stop what is left, say what that was, and end."""
        if self._finishing:
            return
        self._finishing = True
        if self._clock:
            self._clock.stop()
        for process in list(self._processes.values()):
            left = process.left_behind() if process.role == "student" else []
            if left:
                detail = "{} of its processes were still running at the end and were stopped".format(
                    len(left)
                )
                self._wire.event("/grader/actor", {"action": "note", "actor": process.name, "detail": detail})
            process.kill()
        if self._master:
            self._recorder.finish()
        self.loop.call_later(FINISH_S, self.loop.stop)
        self._end_when_empty()

    def _watch_sockets(self):
        """No process is charged for what sockets hold: past the limit, the tree with the most of them is stopped."""
        students = [process for process in self._processes.values() if process.role != "grader"]
        limit_bytes = self._limits["socket_bytes"]
        if self._stage and students and buffer_bytes(limit_bytes) > limit_bytes:
            excess = "more than {} MB in sockets".format(limit_bytes >> 20)
            max(students, key=Process.descriptors).stop_for(excess)
        self.loop.call_later(WATCH_S, self._watch_sockets)

    def _on_exit(self, process):
        del self._processes[process.name]
        if process.again:
            self._earlier[process.name] = process
        self._end_when_empty()

    def _end_when_empty(self):
        if self._finishing and not self._processes:
            for process in self._earlier.values():
                process.give_up()
            self._earlier.clear()
            self._lateness.stop()
            if self._master:
                self._master.finish()
            self.loop.stop()

    def _reap(self):
        for process in list(self._processes.values()):
            process.reap()


def run_arena():
    """Run one arena, from its start to its end."""
    set_clock()
    LIBC.prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    signal.signal(signal.SIGINT, lambda *_: None)  # ignored, it would be ignored by all that is started
    wire = Wire(os.dup(1))
    # A print of any library would otherwise break the frames.
    os.dup2(2, 1)
    # Unbuffered: the commands behind the first line are the loop's to read.
    with open(0, "rb", buffering=0, closefd=False) as commands:
        line = commands.readline()
    if not line:
        return  # the grader was ended before it could say anything
    config = json.loads(line.decode())
    leave_keys_behind()
    if config["stage"]:
        # Before the first thread: the kernel gives a user namespace only to a process with a single one.
        enter_own_namespaces()
    calibration = Calibration() if config["master"] and config["calibrated"] else None
    arena = Arena(wire, config, calibration)
    arena.loop.run()
    calibration_s = calibration.stop() if calibration else 0.0
    arena.clear()
    usage = resource.getrusage(resource.RUSAGE_SELF)
    own_s = usage.ru_utime + usage.ru_stime + calibration_s
    wire.status("done", cpu_s=own_s, max_rss_bytes=peak_bytes())
    wire.flush()
    # This is a copy of the template: it must not return into the template's code.
    os._exit(0)


def serve_requests(sock, live):
    """Start arenas, each of which is `live()` in a session of its own, until all sockets of packets have closed; they
    live on as long as their own stdin.

    `s` with three descriptors (an arena's stdin, stdout, stderr) starts an arena; the answer is its process id and the
    CPU seconds that this process took since the last answer. `e` with a process id waits for an arena that has ended,
    or was killed; the answer has the same id. Until then no other process gets that id. `c` with a descriptor is
    another such socket, of a copy of the grader, and has no answer.
    """
    gc.collect()
    gc.freeze()  # what is here is shared with every copy for as long as no one touches it
    told_s = 0.0
    socks = {sock.fileno(): sock}
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    while socks:
        for number, _ in poll.poll():
            sock = socks[number]
            try:
                request, descriptors = _receive(sock)
            except ConnectionError:
                request = b""
            if not request:
                poll.unregister(number)
                socks.pop(number).close()
                continue
            if request == b"c":
                for descriptor in descriptors:
                    socks[descriptor] = socket.socket(fileno=descriptor)
                    poll.register(descriptor, select.POLLIN)
                continue
            if request[:1] == b"s":
                pid = _start(socks.values(), descriptors, live)
            else:
                (pid,) = struct.unpack_from("<i", request, 1)
                with contextlib.suppress(ChildProcessError):  # none of ours
                    os.waitpid(pid, 0)
            used = resource.getrusage(resource.RUSAGE_SELF)
            used_s = used.ru_utime + used.ru_stime
            try:
                sock.send(ANSWER.pack(pid, used_s - told_s))
            except ConnectionError:  # who asked has ended, or no longer waits
                if request[:1] == b"s":
                    # Its pipes may be another arena's by now, whose commands it would take.
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
            told_s = used_s


def _start(socks, descriptors, live):
    pid = os.fork()
    if pid:
        for number in descriptors:
            os.close(number)
        return pid
    try:
        os.setsid()
        for sock in socks:
            # `closerange` closes the numbers: the object must not close one again when it belongs to something else.
            sock.detach()
        for target, number in enumerate(descriptors):
            os.dup2(number, target)
        os.closerange(DESCRIPTORS, OPEN_MAX)
        live()
    except BaseException as error:  # noqa: BLE001 - the copy must not go on as the template; the grader reads this
        os.write(2, "{}: {}\n".format(type(error).__name__, error).encode("utf-8", "replace"))
    finally:
        os._exit(1)


def _receive(sock):
    numbers = array.array("i")
    data, notes, _, _ = sock.recvmsg(REQUEST_BYTES, socket.CMSG_SPACE(DESCRIPTORS * numbers.itemsize))
    for level, kind, value in notes:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            numbers.frombytes(value[: len(value) - len(value) % numbers.itemsize])
    return data, list(numbers)


def reset_signals():
    """Signals that are ignored or blocked here would be so in all that is started from here, students' nodes too: how
    the grader was started must not change what they do."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    for number in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP, *PYTHONS}:
        signal.signal(number, signal.SIG_DFL)


def stand_by(live, modules):
    """Run the template, from its start to its end. `modules` are loaded now; one that cannot be loaded is missed by
    what needs it."""
    reset_signals()
    gc.set_threshold(COLLECT_AFTER)
    for name in modules:
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    serve_requests(socket.socket(fileno=os.dup(0)), live)
    os._exit(0)


if __name__ == "__main__":
    stand_by(run_arena, (*ROS, *UNSEEN))
