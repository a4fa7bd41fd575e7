"""How commands print, and the one place that prints errors and picks exit codes.

What a student wrote is shown on one line, and never obeyed by a terminal.
"""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from grader.cli.declare import STDOUT
from grader.errors import ExitCode, GraderError, RubricError
from grader.files import atomic_write
from grader.untrusted_text import json_text, line, visible

LINE_CHARS = 4000


def say(text: str) -> None:
    """Print one line to stdout."""
    print(line(text, LINE_CHARS))


def say_beside(text: str) -> None:
    """Print one line to stderr."""
    print(f"grader: {line(text, LINE_CHARS)}", file=sys.stderr)


def say_json(data: object) -> None:
    """Print JSON to stdout."""
    say_document(lambda ascii_only: json_text(data, ascii_only=ascii_only))


def say_document(made: Callable[[bool], str]) -> None:
    """Print a document that is harmless already. `made` is told whether stdout takes only ASCII: a letter that the
    encoding lacks needs an escape of the document's own format."""
    # Python calls one encoding by several names: `utf8`, `UTF-8`
    encoding = (sys.stdout.encoding or "ascii").lower().replace("-", "")
    sys.stdout.write(made(encoding != "utf8"))


def write_document(out: str, made: Callable[[bool], str], *, public: bool = False) -> None:
    """Write a document as `say_document` takes it to the file `out`, or print it for `-`. Raises OutputError."""
    if out == STDOUT:
        say_document(made)
    else:
        atomic_write(Path(out), made(False).encode(), public=public)  # a file is UTF-8, whatever stdout is


ERROR_CHARS, NARROWEST = 2000, 40
SIGPIPE_CODE = 141  # what a shell reports for a program that a closed pipe ended


def guarded(command: Callable[[], int], *, debug: bool) -> int:
    """Run the command and turn what it raises into lines on stderr and an exit code."""
    try:
        code = int(command())
        flush()
    except BrokenPipeError:
        # else the interpreter's own flush at its end would complain
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return SIGPIPE_CODE
    except KeyboardInterrupt:
        _say("grader: interrupted")
        return ExitCode.INTERRUPTED
    except GraderError as error:
        _trace(debug)
        report(error)
        return error.exit_code
    except Exception as error:  # noqa: BLE001 - the last place: no caller could show it on one line
        _trace(debug)
        _say(f"grader: internal error: {type(error).__name__}: {_line(error)}{'' if debug else DEBUG_HINT}")
        return ExitCode.NOT_GRADED
    return code


DEBUG_HINT = " (run with --debug for the traceback)"


def report(error: GraderError) -> None:
    """Print a line that says what is wrong, one that says what to do, and one that says what became of the result. Each
    fault of a rubric has its own line."""
    faults = error.faults if isinstance(error, RubricError) else [error.message]
    for fault in faults:
        _say(_wrap_for_terminal(f"grader: error: {_line(fault)}"))
    if error.hint:
        _say(_wrap_for_terminal(f"  hint: {_line(error.hint)}"))
    if error.note:
        _say(_wrap_for_terminal(f"  note: {_line(error.note)}"))


def _wrap_for_terminal(text: str) -> str:
    """Return the line as it is, or on a terminal in lines that end between words."""
    if sys.stderr is None or not sys.stderr.isatty():
        return text
    width = max(shutil.get_terminal_size().columns, NARROWEST)
    return textwrap.fill(
        text, width, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )


def flush() -> None:
    """Send what was printed, so that a closed pipe is noticed here and not at the interpreter's exit."""
    if sys.stdout is not None:
        sys.stdout.flush()


def _line(text: object) -> str:
    return line(str(text), ERROR_CHARS)


def _say(text: str) -> None:
    with suppress(OSError, ValueError):  # a closed stderr leaves nowhere to complain to
        print(text, file=sys.stderr, flush=True)


def _trace(debug: bool) -> None:
    if debug:
        with suppress(OSError, ValueError):
            sys.stderr.write(visible(traceback.format_exc(), lines=True))
