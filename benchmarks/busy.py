"""Busy loops beside what is measured, as another user's work would be: each in a session of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

LOOP = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: it never outlives the benchmark
if os.getppid() != int(sys.argv[1]):
    sys.exit()
print(flush=True)
while True:
    pass
"""


@contextmanager
def busy_loops(count: int) -> Iterator[None]:
    """So many processes of ordinary priority that compute all the time, ended with the block however it ends."""
    with ExitStack() as stack:
        for _ in range(count):
            stack.enter_context(_loop())
        yield


@contextmanager
def _loop() -> Iterator[None]:
    argv = [sys.executable, "-S", "-c", LOOP, str(os.getpid())]
    process = subprocess.Popen(argv, stdout=subprocess.PIPE, start_new_session=True)
    try:
        if process.stdout is not None:
            process.stdout.readline()  # it computes from here on
        yield
    finally:
        process.kill()
        process.communicate()
