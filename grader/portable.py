"""What Linux has and other systems have in part. Judging files alone works without the rest.

On Windows, files have no executable bit, and folders cannot be opened or locked. Unknown flags are 0.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import IO, Any

from grader.errors import HostError

NONBLOCK: int = getattr(os, "O_NONBLOCK", 0)
NOFOLLOW: int = getattr(os, "O_NOFOLLOW", 0)
DIRECTORY: int = getattr(os, "O_DIRECTORY", 0)
CLOEXEC: int = getattr(os, "O_CLOEXEC", 0)
BINARY: int = getattr(os, "O_BINARY", 0)
READ = os.O_RDONLY | NONBLOCK | CLOEXEC | BINARY
"""For files that others wrote: opening a pipe does not block."""
MODES_ON_DISK = os.name == "posix"
"""Whether files on the disk have an executable bit."""
SYSTEMS = {"win32": "Windows", "darwin": "macOS"}


def system() -> str:
    """Return the name of this system; "" for Linux, the only one on which ROS 1's nodes are run."""
    return "" if sys.platform == "linux" else SYSTEMS.get(sys.platform, sys.platform)


def user_id() -> int | None:
    """Return the effective user id; None on systems without one."""
    return getattr(os, "geteuid", lambda: None)()


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def open_folder(path: os.PathLike[str]) -> int:
    """Open a folder, to lock or to flush it; return -1 where folders cannot be opened. Raises OSError."""
    return os.open(path, os.O_RDONLY | DIRECTORY | CLOEXEC) if DIRECTORY else -1


def close(descriptor: int) -> None:
    """Close a descriptor that `open_folder` returned."""
    if descriptor >= 0:
        os.close(descriptor)


@contextmanager
def own_session(
    command: Sequence[str],
    *,
    cwd: os.PathLike[str],
    env: Mapping[str, str],
    stdout: IO[bytes] | int,
    stderr: IO[bytes] | int,
    pass_fds: Sequence[int] = (),
) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program without input in a session of its own. It ends with the block, and all that it started too, even if
    Ctrl-C comes while it is started. Raises OSError."""
    process = None
    try:
        with _interrupt_held():
            process = subprocess.Popen(
                command,
                cwd=cwd,
                env=env,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
                pass_fds=pass_fds,
            )
        yield process
    finally:
        if process is not None:
            _end_group(process)


@contextmanager
def on_interrupt(handler: Callable[[int, FrameType | None], Any] | signal.Handlers) -> Iterator[None]:
    """Let Ctrl-C do this in the block. Only the main thread hears of one, and can say what it does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        # None: the handler is not Python's, and Python cannot put it back
        signal.signal(signal.SIGINT, signal.default_int_handler if before is None else before)


@contextmanager
def _interrupt_held() -> Iterator[None]:
    """Let a Ctrl-C that comes inside take effect at the end. Only the main thread is interrupted by one."""
    before = signal.getsignal(signal.SIGINT)
    # where it is ignored, or left to the system, there is no Python handler to hold back
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        for number in came[:1]:  # several of them mean no more than one
            signal.raise_signal(number)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """Kill everything in the session of a process, and itself, and wait for it."""
    with suppress(ProcessLookupError):
        if sys.platform != "win32":
            os.killpg(process.pid, signal.SIGKILL)  # not waited for yet, so its id is still its own
        elif process.poll() is None:
            process.kill()
    process.wait()


@contextmanager
def wait_for_children() -> Iterator[None]:
    """Make sure that processes which end inside can be waited for, also where this process ignores SIGCHLD.

    Where it is ignored, exit codes get lost, and bubblewrap, which inherits that, waits for ever. Afterwards it is
    ignored again. Raises HostError in a thread that cannot change it.
    """
    if sys.platform == "win32" or signal.getsignal(signal.SIGCHLD) is not signal.SIG_IGN:
        yield
        return
    if threading.current_thread() is not threading.main_thread():
        raise HostError(
            "this program ignores SIGCHLD, so nothing that it starts can be waited for",
            hint="call signal.signal(signal.SIGCHLD, signal.SIG_DFL) in the program's main thread before it grades",
        )
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
