"""The arena's own process: started, spoken to, ended. Its output comes to the event loop that started it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
from collections.abc import Callable, Sequence
from typing import Any

from grader.arena.template import start_arena

READ_BYTES = 1 << 18
STDERR_BYTES = 4096
CLOSE_S = 1.5


class ArenaProcess:
    """`take` gets each piece of its output, and empty bytes at the end. `cpu_s` is what making it took.

    Raises ArenaError where it cannot be started.
    """

    def __init__(self, argv: Sequence[str], env: dict[str, str], take: Callable[[bytes], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._ended = asyncio.Event()
        self._open: set[int] = set()
        self._errors = b""
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
        """One command, as a line of JSON. That it has ended is told by its output's end."""
        data = memoryview(json.dumps(command).encode() + b"\n")
        with contextlib.suppress(BrokenPipeError):
            while data:
                data = data[os.write(self._commands, data) :]

    def last_words(self) -> str:
        """The last line that it wrote to stderr."""
        return (self._errors.decode(errors="replace").strip().splitlines() or [""])[-1]

    async def end(self) -> None:
        """End it: closed commands first, so that it ends what it started; then by force."""
        try:
            os.close(self._commands)
            timer = self._loop.call_later(CLOSE_S, self._ended.set)
            await self._ended.wait()
            timer.cancel()
        finally:
            self._kill()
            self._template.forget(self.pid)
            for descriptor in self._open:
                self._loop.remove_reader(descriptor)
            for descriptor in (self._output, self._words):
                os.close(descriptor)

    def _kill(self) -> None:
        """With its group: a bubblewrap that is killed while it starts leaves a second process that waits for ever."""
        with contextlib.suppress(ProcessLookupError):  # all of it has ended
            os.killpg(self.pid, signal.SIGKILL)

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
