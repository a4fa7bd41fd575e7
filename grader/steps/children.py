"""The grader waits for every process that it starts. A program that uses its API may have switched that off."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from grader.errors import HostError

HINT = "signal.signal(signal.SIGCHLD, signal.SIG_DFL) in the program's main thread, before it grades"


@contextmanager
def waited_for() -> Iterator[None]:
    """Inside, programs that end are waited for, also where this process ignores SIGCHLD: how they ended is not known
    there, and bubblewrap, which inherits it, waits for ever. Afterwards it is ignored again.

    Raises HostError in a thread that cannot change that.
    """
    if sys.platform == "win32" or signal.getsignal(signal.SIGCHLD) is not signal.SIG_IGN:
        yield
        return
    if threading.current_thread() is not threading.main_thread():
        raise HostError(
            "this program ignores SIGCHLD, so nothing that it starts can be waited for", hint=HINT
        )
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        yield
    finally:
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)
