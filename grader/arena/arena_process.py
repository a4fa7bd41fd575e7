"""The arena's own process: started, spoken to, ended. Its output comes to the event loop that started it."""

from __future__ import annotations

import array
import asyncio
import atexit
import json
import os
import signal
import socket
import struct
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from grader.errors import ArenaError

READ_BYTES = 1 << 18
STDERR_BYTES = 4096
CLOSE_S = 1.5
ANSWER = struct.Struct("<id")
ANSWER_S = 15.0
TEMPLATE_END_S = 2.0


class ArenaProcess:
    """`take` gets each piece of its output, and empty bytes at the end. `cpu_s` is what making it took.

    Raises ArenaError where it cannot be started.
    """

    def __init__(self, argv: Sequence[str], env: dict[str, str], take: Callable[[bytes], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._open: set[int] = set()
        self._errors = b""
        # Plain pipes, since the child is the template's and not this process's: asyncio cannot start it.
        pipes = [os.pipe() for _ in range(3)]
        (commands_r, self._commands), (self._output, output_w), (self._words, words_w) = pipes
        try:
            self._template, self.pid, self.cpu_s = start_arena(argv, env, [commands_r, output_w, words_w])
        except BaseException:
            for number in (self._commands, self._output, self._words):
                os.close(number)
            raise
        finally:
            for number in (commands_r, output_w, words_w):
                os.close(number)
        self._watch(self._output, take)
        self._watch(self._words, self._keep_errors)

    def send(self, command: dict[str, Any]) -> None:
        """Send a command as a line of JSON. The end of the arena's output tells that the arena has ended."""
        data = memoryview(json.dumps(command).encode() + b"\n")
        with suppress(BrokenPipeError):
            while data:
                data = data[os.write(self._commands, data) :]

    def last_words(self) -> str:
        """Return the last line that it wrote to stderr."""
        return (self._errors.decode(errors="replace").strip().splitlines() or [""])[-1]

    async def end(self) -> None:
        """End it: closed commands first, so that it ends what it started; then by force."""
        try:
            os.close(self._commands)
            timer = self._loop.call_later(CLOSE_S, self._ended.set)
            await self._ended.wait()
            timer.cancel()
        finally:
            # With its group: a bubblewrap that is killed while it starts leaves a second process that waits for ever.
            with suppress(ProcessLookupError):  # all of it has ended
                os.killpg(self.pid, signal.SIGKILL)
            # Only after the kill: until the template has waited for it, its id and group cannot belong to others.
            self._template.forget(self.pid)
            for descriptor in self._open:
                self._loop.remove_reader(descriptor)
            for descriptor in (self._output, self._words):
                os.close(descriptor)

    def _watch(self, descriptor: int, take: Callable[[bytes], None]) -> None:
        os.set_blocking(descriptor, False)
        self._open.add(descriptor)

        def readable() -> None:
            try:
                chunk = os.read(descriptor, READ_BYTES)
            except BlockingIOError:
                return
            if not chunk:
                self._loop.remove_reader(descriptor)
                self._open.discard(descriptor)
                if not self._open:
                    self._ended.set()
            take(chunk)

        self._loop.add_reader(descriptor, readable)

    def _keep_errors(self, chunk: bytes) -> None:
        self._errors = (self._errors + chunk)[-STDERR_BYTES:]


class Template:
    """The process that has imported ROS already, of which arenas are copies (`stand_by` in `ros/__main__.py`): one for
    each grader and the processes that are copies of it. It ends with the last socket to it, at the latest with them.
    """

    def __init__(self, argv: Sequence[str], env: Mapping[str, str]) -> None:
        self.user = os.getpid()
        self._lock = threading.Lock()
        # Packets, so that a request and its descriptors come as one.
        self._sock, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._sock.settimeout(ANSWER_S)
        with theirs:
            self._popen: subprocess.Popen[bytes] | None = subprocess.Popen(
                argv,
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=dict(env),
                cwd="/",
                start_new_session=True,
            )

    def take_over(self) -> None:
        """Get a socket of this process's own, where it is a copy of the one that had this object."""
        # A new lock, too: another thread may have held the old one while this process was copied.
        self.user, self._popen, self._lock = os.getpid(), None, threading.Lock()
        own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        own.settimeout(ANSWER_S)
        with theirs, self._sock, suppress(OSError):  # it has ended, as the first request will show
            socket.send_fds(self._sock, [b"c"], [theirs.fileno()])
        self._sock = own

    def start(self, descriptors: Sequence[int]) -> tuple[int, float]:
        """Start an arena with these as stdin, stdout and stderr; return its process id and the CPU seconds that making
        it took.

        Raises OSError where the template has ended or does not answer.
        """
        passed = array.array("i", descriptors)
        return self._ask(b"s", [(socket.SOL_SOCKET, socket.SCM_RIGHTS, passed)])

    def forget(self, pid: int) -> None:
        """Wait for an arena that has ended or was killed. Only after that can its id become another process's."""
        with suppress(OSError):  # a template that has ended left it to someone who waits for all
            self._ask(b"e" + struct.pack("<i", pid))

    def close(self) -> None:
        """End the template, or leave it to its other users; the arenas that it made are not touched."""
        self._sock.close()
        if self._popen is None:
            return
        try:
            self._popen.wait(TEMPLATE_END_S)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()
        if self._popen.stderr is not None:
            self._popen.stderr.close()

    def last_words(self) -> str:
        """Return the last line that the template wrote before it ended."""
        self._sock.close()
        if self._popen is None:
            return "it said nothing"
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(TEMPLATE_END_S)
        self._popen.kill()
        _, errors = self._popen.communicate()
        lines = errors[-STDERR_BYTES:].decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def _ask(
        self, request: bytes, passed: Sequence[tuple[int, int, array.array[int]]] = ()
    ) -> tuple[int, float]:
        with self._lock:
            # One request at a time: an answer does not say which one it is for.
            try:
                self._sock.sendmsg([request], passed)
                answer = self._sock.recv(ANSWER.size)
            except OSError:
                self._sock.close()  # a late answer would be taken for that to the next request
                raise
        if len(answer) != ANSWER.size:
            raise ConnectionResetError("the template has ended")
        pid, cpu_s = ANSWER.unpack(answer)
        return int(pid), float(cpu_s)


_templates: dict[tuple[object, ...], Template] = {}
_making = threading.Lock()


def template_of(argv: Sequence[str], env: Mapping[str, str]) -> Template:
    """Return the template for that command and environment; start one where there is none yet."""
    key = (tuple(argv), tuple(sorted(env.items())))
    with _making:
        if key not in _templates:
            if not _templates:
                atexit.register(_close_all)
            _templates[key] = Template(argv, env)
        if _templates[key].user != os.getpid():
            _templates[key].take_over()
        return _templates[key]


def start_arena(
    argv: Sequence[str], env: Mapping[str, str], descriptors: Sequence[int]
) -> tuple[Template, int, float]:
    """Start an arena; a template that has ended is made again, once. Raises ArenaError."""
    template = template_of(argv, env)
    try:
        return template, *template.start(descriptors)
    except OSError:
        _drop(template)
    template = template_of(argv, env)
    try:
        return template, *template.start(descriptors)
    except OSError as error:
        _drop(template)
        message = f"the managed roscore did not start: {template.last_words()}"
        raise ArenaError(message, hint="grader doctor") from error


def _drop(template: Template) -> None:
    with _making:
        for key in [key for key, known in _templates.items() if known is template]:
            del _templates[key]


def _close_all() -> None:
    for template in list(_templates.values()):
        # A copied process must not end the template that its parent still uses.
        if template.user == os.getpid():
            template.close()
