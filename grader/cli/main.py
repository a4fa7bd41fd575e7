"""`grader`: parse, dispatch, exit code."""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from io import TextIOWrapper
from types import FrameType

from grader.cli.declare import Command, loading
from grader.cli.errors import guarded
from grader.cli.parser import build_parser, overview
from grader.errors import ExitCode


def run(argv: Sequence[str]) -> int:
    """Run one command line and return its exit code. Prints its errors itself; raises nothing."""
    _prepare_streams()
    _prepare_signals()
    if not sys.warnoptions:  # Python's warnings about a student's code quote it, and are of no use here
        warnings.simplefilter("ignore")
    return guarded(lambda: _dispatch(argv), debug="--debug" in argv)


def _dispatch(argv: Sequence[str]) -> int:
    if not argv:
        print(f"usage: grader COMMAND ...\n\n{overview()}\nSee grader COMMAND --help.", file=sys.stderr)
        return ExitCode.USAGE
    try:
        options = vars(build_parser().parse_args(argv))
    except SystemExit as done:  # --help and --version end this way
        return int(done.code or 0)
    options.pop("debug", None)
    command: Command = options.pop("command")
    runs_code = command.runs_code and not options.get("static")
    with loading():
        if runs_code and sys.platform == "linux":
            inherited = import_module("grader.arena.inherited_limits")
            inherited.make_room(
                begin=True
            )  # before more is loaded: short limits would end that without a word
        if runs_code or command.looks_at_host:
            scope = import_module("grader.cli.systemd_scope")
    if runs_code or command.looks_at_host:
        scope.enter_scope()
    return int(command.run(**options))


def _prepare_streams() -> None:
    """Escape characters that the terminal's encoding lacks; let a closed stream swallow everything."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_WRONLY)
            setattr(sys, name, os.fdopen(descriptor, "w", encoding="utf-8"))
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper):
            with suppress(ValueError):
                stream.reconfigure(errors="backslashreplace")


def _prepare_signals() -> None:
    """Make SIGTERM clean up as SIGINT does, and keep SIGINT alive under a shell's `&`.

    The grader waits for its children and gets every signal, even if its parent ignores or blocks some.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _interrupt)
        if sys.platform != "win32":
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, ())


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
