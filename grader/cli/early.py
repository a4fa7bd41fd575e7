"""Shows what a package's files alone decide, while the build and the runs are still to come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.text import Text

from grader.cli.output import say
from grader.model.result import EarlyVerdict
from grader.report.terminal import STYLES, mark
from grader.report.text import line, visible
from grader.untrusted_text import uncommanded

TITLE = "Your files, before anything is built or run:"
SO_FAR = "so far: the build may still settle it otherwise"
MESSAGE_CHARS = 300
INDENT = 2
ESCAPE = 8
"""So much longer may a line become that is written out."""


def print_early(
    verdicts: tuple[EarlyVerdict, ...], above: Callable[[Text], None] | None = None, *, width: int = 80
) -> None:
    """Print to stdout at once, or by `above` where a display is in the way: a line each, and what mends a loss.

    Lines for a display are at most `width` columns wide.
    """
    if not verdicts:
        return
    for row in _rows(verdicts, sys.stdout.encoding or "ascii"):
        if above is None:
            say(row.plain)
        else:
            for part in _wrapped(row, width):
                above(part)
    sys.stdout.flush()


def _rows(verdicts: tuple[EarlyVerdict, ...], encoding: str) -> Iterator[Text]:
    yield Text(TITLE, "bold")
    words = [_word(verdict) for verdict in verdicts]
    status_width = max(map(len, words))
    name_width = max(len(visible(verdict.criterion.id)) for verdict in verdicts)
    for verdict, word in zip(verdicts, words, strict=True):
        criterion = verdict.criterion
        row = Text(" " * INDENT)
        row.append(f"{mark(criterion.status, encoding)} {word:{status_width}}", STYLES[criterion.status])
        row.append(f"  {visible(criterion.id):{name_width}}  {line(criterion.message, MESSAGE_CHARS)}")
        yield row
        if criterion.points < criterion.max_points and criterion.hint:
            yield Text(f"{' ' * (INDENT + 2)}hint: {line(criterion.hint, MESSAGE_CHARS)}", "dim")
    if not all(verdict.final for verdict in verdicts):
        yield Text(f"{' ' * INDENT}({SO_FAR})", "dim")
    yield Text()


def _wrapped(row: Text, width: int) -> Iterator[Text]:
    """Its lines as a terminal shows them, none of which a CI system takes for a command."""
    for part in row.wrap(Console(width=width), width - ESCAPE, overflow="fold") or [row]:
        harmless = uncommanded(part.plain)
        yield part if harmless == part.plain else Text(harmless, part.style)


def _word(verdict: EarlyVerdict) -> str:
    return verdict.criterion.status.value + ("" if verdict.final else " so far")
