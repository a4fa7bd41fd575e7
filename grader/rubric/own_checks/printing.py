"""What an instructor's check prints goes to stderr, with what a student wrote in it made visible."""

from __future__ import annotations

import io
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import TextIO

from grader.untrusted_text import visible

LINE_CHARS = 65_536
_STREAMS = threading.RLock()
"""Stdout is the whole process's: two threads would leave each other's behind."""


class Shown(io.TextIOBase):
    """Writes whole lines to another stream, so that a command to a CI system is known wherever it was cut."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._rest = ""

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        """Write what is complete of it."""
        whole, newline, self._rest = (self._rest + text).rpartition("\n")
        self._stream.write(visible(whole + newline, lines=True))
        if len(self._rest) > LINE_CHARS:
            self.finish()
        return len(text)

    def finish(self) -> None:
        """Write what no line end came for."""
        rest, self._rest = self._rest, ""
        if rest:
            self._stream.write(f"{visible(rest)}\n")


@contextmanager
def printing_to_stderr() -> Iterator[None]:
    """Stdout may be JSON: nothing that is printed in the block gets there."""
    with _STREAMS:
        shown = Shown(sys.stderr)
        try:
            with redirect_stdout(shown), redirect_stderr(shown):
                yield
        finally:
            shown.finish()
