"""How commands print: what a student wrote is shown on one line, and never obeyed by a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable

from grader.untrusted_text import json_text, line

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
    encoding = (sys.stdout.encoding or "ascii").lower().replace("-", "")
    sys.stdout.write(made(encoding != "utf8"))
