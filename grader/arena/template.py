"""Starts arenas as copies of one process that has imported ROS already: one for each grader, as long as it lives."""

from __future__ import annotations

import array
import atexit
import os
import socket
import struct
import subprocess
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress

from grader.errors import ArenaError

ANSWER = struct.Struct("<id")
ANSWER_S = 15.0
TEMPLATE_CLOSE_S = 2.0
ERROR_BYTES = 4096


class Template:
    """The template's process (`ros/template.py`). It ends with this object's socket, at the latest with the grader."""

    def __init__(self, argv: Sequence[str], env: Mapping[str, str]) -> None:
        self._lock = threading.Lock()
        self._sock, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._sock.settimeout(ANSWER_S)
        with theirs:
            self._popen = subprocess.Popen(
                argv,
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=dict(env),
                cwd="/",
                start_new_session=True,
            )

    def start(self, descriptors: Sequence[int]) -> tuple[int, float]:
        """A new arena with these as stdin, stdout and stderr: its process id, and the CPU seconds that making it took.

        Raises OSError where the template has ended or does not answer.
        """
        passed = array.array("i", descriptors)
        return self._ask(b"s", [(socket.SOL_SOCKET, socket.SCM_RIGHTS, passed)])

    def forget(self, pid: int) -> None:
        """That arena has ended, or was killed: wait for it. Only from then on its id may be another process's."""
        with suppress(OSError):  # a template that has ended left it to somebody who waits for all
            self._ask(b"e" + struct.pack("<i", pid))

    def close(self) -> None:
        """End the template; the arenas that it made are not touched."""
        self._sock.close()
        try:
            self._popen.wait(TEMPLATE_CLOSE_S)
        except subprocess.TimeoutExpired:
            self._popen.kill()
            self._popen.wait()
        if self._popen.stderr is not None:
            self._popen.stderr.close()

    def last_words(self) -> str:
        """What the template said before it ended, its last line."""
        self._sock.close()
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(TEMPLATE_CLOSE_S)
        self._popen.kill()
        _, errors = self._popen.communicate()
        lines = errors[-ERROR_BYTES:].decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def _ask(
        self, request: bytes, passed: Sequence[tuple[int, int, array.array[int]]] = ()
    ) -> tuple[int, float]:
        with self._lock:
            self._sock.sendmsg([request], passed)
            answer = self._sock.recv(ANSWER.size)
        if len(answer) != ANSWER.size:
            raise ConnectionResetError("the template has ended")
        pid, cpu_s = ANSWER.unpack(answer)
        return int(pid), float(cpu_s)


_templates: dict[tuple[object, ...], Template] = {}
_making = threading.Lock()


def template_of(argv: Sequence[str], env: Mapping[str, str]) -> Template:
    """This process's template for that command and environment, started where there is none yet."""
    key = (os.getpid(), tuple(argv), tuple(sorted(env.items())))
    with _making:
        if key not in _templates:
            if not _templates:
                atexit.register(_close_all)
            _templates[key] = Template(argv, env)
        return _templates[key]


def start_arena(
    argv: Sequence[str], env: Mapping[str, str], descriptors: Sequence[int]
) -> tuple[Template, int, float]:
    """A new arena of the template; a template that somebody has ended is made anew, once. Raises ArenaError."""
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
    for key, template in list(_templates.items()):
        if key[0] == os.getpid():
            template.close()
