"""Runs one of the grader's own functions on hostile data in a child process with limits on memory, CPU, files and time.

The arguments, and each value that the function yields, travel as JSON. The child is this Python without site-packages,
and inherits none of the user's variables but those that a program needs to be loaded. To start it takes as long as most
of what it is started for, so where the system can, each but a process's first is a copy of a template: a process that
has imported the function and has never seen any data. A process for many jobs is not its business (`workers.py`, whose
workers are such copies too), and neither are students' programs (`arena/`).
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))  # noqa: PTH100, PTH120 - see above
BOOTSTRAP = "import sys; sys.path.append(sys.argv[1]); from grader.limited_child import main; main()"
COMMAND = [sys.executable, "-I", "-S", "-B", "-c", BOOTSTRAP, ROOT]
STAND_BY = "stand-by"
COLLECT_AFTER = 50_000
"""So many new objects until Python looks for cycles: what is parsed is many small objects without any."""
COPY, STATUS = b"c", b"s"
REQUEST_BYTES, NUMBER_BYTES = 256, 8
TEMPLATE_S = 60.0
"""How long a template may take to answer: it begins by importing."""
CAN_COPY = hasattr(os, "pidfd_open")
"""Linux only."""


class ChildLimits(NamedTuple):
    """What the child may take: `memory_bytes` of address space, `cpu_s` of processor time, `wall_s` in all,
    `file_bytes` for each file that it writes; of its answer, `answer_bytes` are read."""

    memory_bytes: int
    cpu_s: int
    wall_s: float
    file_bytes: int
    answer_bytes: int = 8 << 20


class Answer(NamedTuple):
    """What the function yielded, a line of JSON each; `done` if it came to its end, `timed_out` if it took longer than
    `cpu_s` or `wall_s`. Where it is neither, the child went beyond another limit, or crashed."""

    lines: bytes
    done: bool
    timed_out: bool = False


def run_limited(function: str, *arguments: object, limits: ChildLimits) -> Answer:
    """Call `function` (`module:name`), which yields values for JSON, with these arguments."""
    import tempfile  # noqa: PLC0415 - the child does not need it

    request = {"function": function, "arguments": arguments, "limits": limits._asdict()}
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as out:
        given.write(json.dumps(request).encode("ascii"))
        given.seek(0)
        code = _run(function, given.fileno(), out.fileno(), limits.wall_s)
        out.seek(0)
        return Answer(lines=out.read(limits.answer_bytes), done=code == 0, timed_out=code in _OUT_OF_TIME)


def _run(function: str, stdin: int, stdout: int, wall_s: float) -> int | None:
    """Return the child's exit code; None where it took too long."""
    from grader.host_programs import loading_environment  # noqa: PLC0415 - as above

    env = loading_environment(os.environ)
    is_first = os.getpid() not in _have_had_one
    _have_had_one.add(os.getpid())
    if CAN_COPY and not is_first:  # a template is worth its own start from the second child on
        with contextlib.suppress(OSError):  # the kernel is too old, or the template was ended
            copy = TemplateCopy(_own_template(env), stdin, stdout, function.partition(":")[0])
            try:
                return copy.wait(wall_s)
            except subprocess.TimeoutExpired:
                return None
            finally:
                copy.kill()
                copy.wait()
    with contextlib.suppress(subprocess.TimeoutExpired):
        return subprocess.run(
            COMMAND,
            cwd="/",
            env=env,
            stdin=stdin,
            stdout=stdout,
            stderr=subprocess.DEVNULL,
            timeout=wall_s,
            check=False,
        ).returncode
    return None


_OUT_OF_TIME = (None, -signal.SIGXCPU if resource else None)
_have_had_one: set[int] = set()
_templates: dict[int, Template] = {}
"""Both by process: a copy of the process that made a template makes its own."""


def _own_template(env: Mapping[str, str]) -> Template:
    """Return this process's template, which ends with it. Raises OSError."""
    known = _templates.get(os.getpid())
    if known is None or known.ended:
        known = _templates[os.getpid()] = Template([*COMMAND, STAND_BY], env, cwd="/", quiet=True)
        atexit.register(known.close)
    return known


class Template:
    """A process that imports modules and does no job: others begin as copies of it (Linux only).

    `command` is a program that calls `stand_by`. It ends with this object's socket, at the latest with its parent; its
    copies live on. `quiet`: what they write to stderr is thrown away.
    """

    def __init__(
        self, command: Sequence[str], env: Mapping[str, str], *, cwd: str | None = None, quiet: bool = False
    ) -> None:
        self._lock = threading.Lock()
        # a socket that keeps messages apart: each `recv` gets one whole request or answer
        self._sock, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._sock.settimeout(TEMPLATE_S)
        self.ended = False
        with theirs:
            self._popen = subprocess.Popen(
                command,
                env=env,
                cwd=cwd,
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL if quiet else None,
                start_new_session=True,
            )

    def ask(self, request: bytes, descriptors: Sequence[int] = ()) -> int:
        """Return the template's answer. Raises OSError where it has ended."""
        with self._lock:
            try:
                socket.send_fds(self._sock, [request], descriptors)
                answer = self._sock.recv(NUMBER_BYTES)
            except OSError:
                answer = b""
            if len(answer) < NUMBER_BYTES:
                self.ended = True
                self._sock.close()  # a late answer would be taken for that to the next request
                raise ConnectionResetError("the template has ended")
        return int.from_bytes(answer, "little", signed=True)

    def close(self) -> None:
        """End the template."""
        self._sock.close()
        self._popen.wait()


class TemplateCopy:
    """A new process, which begins as a copy of a template that has imported `module`. Nothing but `wait` waits for it,
    so its process id stays its own until then. Raises OSError where the template has ended, or the kernel is too old.
    """

    def __init__(self, template: Template, stdin: int, stdout: int, module: str = "") -> None:
        self._template = template
        self._pid = template.ask(COPY + module.encode(), [stdin, stdout])
        self._handle = os.pidfd_open(self._pid)
        self._code: int | None = None
        self._lock = threading.Lock()

    def poll(self) -> int | None:
        """Return its exit code, as `subprocess` has it; None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self.wait(0)
        return None

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit code once it has ended. Raises subprocess.TimeoutExpired."""
        poll = select.poll()
        poll.register(self._handle, select.POLLIN)
        if not poll.poll(None if timeout is None else timeout * 1000):
            raise subprocess.TimeoutExpired(str(self._pid), timeout or 0.0)
        with self._lock:
            if self._code is None:
                try:
                    status = self._template.ask(STATUS + self._pid.to_bytes(NUMBER_BYTES, "little"))
                    self._code = os.waitstatus_to_exitcode(status)
                except OSError:  # the template was ended, and nobody else may ask
                    self._code = -signal.SIGKILL
            return self._code

    def __del__(self) -> None:
        with contextlib.suppress(AttributeError):  # it was not made at all
            os.close(self._handle)

    def kill(self) -> None:
        """Kill it, unless it has ended."""
        self.send_signal(signal.SIGKILL)

    def send_signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)


# ---- inside the process


def main() -> None:
    """Answer the request on standard input, as the child; as its template, first stand by until this is a copy."""
    gc.set_threshold(COLLECT_AFTER)
    if STAND_BY in sys.argv and not stand_by():
        os._exit(0)  # as below
    request = json.load(sys.stdin)
    _set_limits(ChildLimits(**request["limits"]))
    module, _, name = request["function"].partition(":")
    for value in getattr(import_module(module), name)(*request["arguments"]):
        print(json.dumps(value), flush=True)
    os._exit(0)  # to take leave of every object takes a copy as long as half of what it did


def stand_by(warm_up: str = "") -> bool:
    """Answer a `Template`'s requests on standard input; False at their end, True in each copy.

    `warm_up` is a module, or a function without arguments (`module:name`), to be called before the first copy is made.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends with its socket
    # if an ignored SIGCHLD is inherited, the kernel keeps no exit code of the copies
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _import(warm_up)
    with socket.socket(fileno=os.dup(0)) as sock:
        while True:
            request, descriptors, _, _ = socket.recv_fds(sock, REQUEST_BYTES, 2)
            if not request:
                return False
            if request[:1] == STATUS:
                # asked only once the copy's handle says that it has ended, so this does not wait
                _, answer = os.waitpid(int.from_bytes(request[1:], "little"), 0)
            else:
                _import(request[1:].decode())
                answer = os.fork()
            if answer == 0 and request[:1] == COPY:
                break
            for number in descriptors:
                os.close(number)
            sock.send(answer.to_bytes(NUMBER_BYTES, "little", signed=True))
    os.setsid()
    for target, number in enumerate(descriptors):
        os.dup2(number, target)
        os.close(number)
    return True


def _import(warm_up: str) -> None:
    """Import a module, and call its function where one is named."""
    module, _, name = warm_up.partition(":")
    if not module or (module in sys.modules and not name):
        return
    gc.disable()  # until all is imported, to be looked through once
    with contextlib.suppress(Exception):  # then a job says what is wrong
        found = import_module(module)
        if name:
            getattr(found, name)()
    gc.collect()
    gc.freeze()  # what is here is shared with every copy for as long as no one touches it
    gc.enable()


def _set_limits(limits: ChildLimits) -> None:
    """macOS refuses to limit a process's memory, and Windows knows no such limits."""
    if resource is None:
        return
    refused = () if sys.platform == "linux" else (OSError, ValueError)
    for kind, value in (
        (resource.RLIMIT_AS, limits.memory_bytes),
        (resource.RLIMIT_CPU, limits.cpu_s),
        (resource.RLIMIT_FSIZE, limits.file_bytes),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(*refused):
            _, most = resource.getrlimit(kind)
            # the first limit of its time sends SIGXCPU, which tells it from all else that kills a process
            last = value + (kind == resource.RLIMIT_CPU)
            last = last if most == resource.RLIM_INFINITY else min(last, most)
            resource.setrlimit(kind, (min(value, last), last))
