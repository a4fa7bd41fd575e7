"""Shows what a package's files alone decide, while the build and the runs are still to come."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

from rich.text import Text

from grader.cli.say import say
from grader.model.result import EarlyVerdict
from grader.report.terminal import STYLES, mark
from grader.report.text import line, visible

TITLE = "Your files, before anything is built or run:"
SO_FAR = "so far: the build may still settle it otherwise"
MESSAGE_CHARS = 300
INDENT = 2


def print_early(verdicts: tuple[EarlyVerdict, ...], above: Callable[[Text], None] | None = None) -> None:
    """Print to stdout at once, or by `above` where a display is in the way: a line each, and what mends a loss."""
    if not verdicts:
        return
    for row in _rows(verdicts, sys.stdout.encoding or "ascii"):
        if above is None:
            say(row.plain)
        else:
            above(row)
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


def _word(verdict: EarlyVerdict) -> str:
    return verdict.criterion.status.value + ("" if verdict.final else " so far")
