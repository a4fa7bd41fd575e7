"""`grader`: parse, dispatch, exit code."""

from __future__ import annotations

import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from io import TextIOWrapper
from types import FrameType

from grader.cli.errors import guarded
from grader.cli.inherited_limits import make_room
from grader.cli.parsing import build_parser

RUNNING = {"batch", "check", "ci", "grade", "record", "regrade", "rubric_new", "rubric_test"}
"""Commands that run what students wrote."""


def run(argv: Sequence[str]) -> int:
    """Run one command line and return its exit code. Prints its errors itself; raises nothing."""
    _prepare_streams()
    _prepare_signals()
    if not sys.warnoptions:  # Python's remarks on a student's code quote it, and are for nobody here
        warnings.simplefilter("ignore")
    return guarded(lambda: _dispatch(argv), debug="--debug" in argv)


def _dispatch(argv: Sequence[str]) -> int:
    try:
        options = vars(build_parser().parse_args(argv))
    except SystemExit as done:  # --help and --version end this way
        return int(done.code or 0)
    options.pop("debug", None)
    name = options.pop("module")
    with _uninterrupted():
        if name in RUNNING and not options.get("static"):
            make_room(begin=True)  # before more is loaded: under short limits that would end without a word
        module = import_module(f"grader.cli.commands.{name}")
    if name in {*RUNNING, "doctor"} and not options.get("static"):  # doctor says what the others would find
        import_module("grader.cli.systemd_scope").enter_scope()
    return int(module.run(**options))


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back for a moment: a compiled module that is interrupted while it loads panics."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare_streams() -> None:
    """A character that the terminal's encoding lacks is written out; a closed stream swallows."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_WRONLY)
            setattr(sys, name, os.fdopen(descriptor, "w", encoding="utf-8"))
        stream = getattr(sys, name)
        if isinstance(stream, TextIOWrapper):
            with suppress(ValueError):
                stream.reconfigure(errors="backslashreplace")


def _prepare_signals() -> None:
    """A terminated grader cleans up as an interrupted one does. A shell's `&` leaves SIGINT alive too.

    It waits for what it starts, and hears every signal, whatever who started it ignores or holds back.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, _interrupt)
        if sys.platform != "win32":
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, ())


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
