"""What the build and the student's processes printed, with times."""

from __future__ import annotations

from grader.checks.support.text import SHOWN_BEFORE_CHARS, bare
from grader.evidence.run import Run
from grader.model.figure import ConsoleFigure, ConsoleLine
from grader.report.figures.bounded import LINE_LETTERS, named, second, short

FIRST_LINES = LAST_LINES = 100
LETTERS_MAX = 24_000
"""Of all lines together; where they have more, each is cut shorter."""


def console_of(run: Run) -> ConsoleFigure | None:
    """None where nothing was printed. Colours are left out."""
    own = {event.name for _, event in run.processes if event.role == "grader"}
    printed = [(time_ns, line) for time_ns, line in run.console if line.process not in own]
    if not printed:
        return None
    many = len(printed) > FIRST_LINES + LAST_LINES
    kept = [*printed[:FIRST_LINES], *printed[-LAST_LINES:]] if many else printed
    texts = [bare(line.line[:SHOWN_BEFORE_CHARS]) for _, line in kept]
    large = sum(min(len(text), LINE_LETTERS) for text in texts) > LETTERS_MAX
    letters = LETTERS_MAX // len(texts) if large else LINE_LETTERS
    lines = tuple(
        ConsoleLine(
            at_s=second(run, time_ns),
            process=named(line.process),
            stream=line.stream,
            text=short(text, letters),
        )
        for (time_ns, line), text in zip(kept, texts, strict=True)
    )
    return ConsoleFigure(scenario=named(run.scenario), lines=lines, left_out=len(printed) - len(kept))
