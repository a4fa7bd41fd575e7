"""The arena's own process: started, spoken to, ended. Its output comes to the event loop that started it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
from collections.abc import Callable, Sequence
from typing import IO, Any

READ_BYTES = 1 << 18
STDERR_BYTES = 4096
CLOSE_S = 1.5


class ArenaProcess:
    """`take` gets each piece of its output, and empty bytes at the end.

    Started from the calling thread, because a sandbox ends with the thread that made it.
    """

    def __init__(self, argv: Sequence[str], env: dict[str, str], take: Callable[[bytes], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._open: set[int] = set()
        self._errors = b""
        self._popen = subprocess.Popen(
            argv,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            env=env,
            cwd="/",
            start_new_session=True,
        )
        self._watch(self._popen.stdout, take)
        self._watch(self._popen.stderr, self._keep_errors)

    @property
    def pid(self) -> int:
        return self._popen.pid

    def send(self, command: dict[str, Any]) -> None:
        """One command, as a line of JSON. That it has ended is told by its output's end."""
        if self._popen.stdin is not None:
            with contextlib.suppress(BrokenPipeError):
                self._popen.stdin.write(json.dumps(command).encode() + b"\n")

    def last_words(self) -> str:
        """The last line that it wrote to stderr."""
        return (self._errors.decode(errors="replace").strip().splitlines() or [""])[-1]

    async def end(self) -> None:
        """End it: closed commands first, so that it ends what it started; then by force."""
        try:
            if self._popen.stdin is not None:
                self._popen.stdin.close()
            timer = self._loop.call_later(CLOSE_S, self._ended.set)
            await self._ended.wait()
            timer.cancel()
        finally:
            self._kill()
            self._popen.wait()
            for descriptor in self._open:
                self._loop.remove_reader(descriptor)
            for pipe in (self._popen.stdout, self._popen.stderr):
                if pipe is not None:
                    pipe.close()

    def _kill(self) -> None:
        """With its group: a bubblewrap that is killed while it starts leaves a second process that waits for ever."""
        if self._popen.poll() is None:
            os.killpg(self._popen.pid, signal.SIGKILL)

    def _watch(self, pipe: IO[bytes] | None, take: Callable[[bytes], None]) -> None:
        if pipe is None:
            return
        descriptor = pipe.fileno()
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
