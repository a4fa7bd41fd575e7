"""Shows on stderr how a batch goes: alive on a terminal, a line for each submission elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import IO

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from grader.classes.batch.job import Outcome
from grader.classes.batch.progress import BatchProgress
from grader.classes.batch.run import Watcher
from grader.report.text import number
from grader.untrusted_text import line

REFRESH_HZ = 4
NAME_CHARS = 40
TEXT_CHARS = 300
RUNNING_SHOWN = 8
MANY = 500
"""Of more submissions than that, a log has a line for each hundredth of them, and for each that is not graded."""


class PlainClass(BatchProgress):
    """A line with the time of day for each submission."""

    def __init__(self, stream: IO[str]) -> None:
        super().__init__()
        self.stream = stream

    def ended(self, outcome: Outcome) -> None:
        """Say what became of it, and what is left."""
        super().ended(outcome)
        step = self.total // 100 if self.total > MANY else 1
        if outcome.status != "graded" or self.done % step == 0 or self.done == self.total:
            stamp = datetime.now().astimezone().strftime("%H:%M:%S")
            print(f"{stamp} {said(outcome)}  [{summary(self)}]", file=self.stream, flush=True)


class LiveClass(BatchProgress):
    """A bar, the counts, and what runs; what is not graded stays above it as a line."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.console = console

    def ended(self, outcome: Outcome) -> None:
        """Leave a line of what a person has to look at."""
        super().ended(outcome)
        if outcome.status != "graded" or outcome.message:
            self.console.print(Text(said(outcome), "red" if outcome.status == "error" else "yellow"))

    def __rich__(self) -> RenderableType:
        table = Table.grid(padding=(0, 2, 0, 0))
        now = self.clock()
        for name, since in list(self.running.items())[:RUNNING_SHOWN]:
            table.add_row(Text(f"▶ {line(name, NAME_CHARS)}", "cyan"), Text(f"{now - since:.0f} s", "dim"))
        more = len(self.running) - RUNNING_SHOWN
        rest = [Text(f"  and {more} more", "dim")] if more > 0 else []
        bar = ProgressBar(total=max(self.total, 1), completed=self.done, width=40)
        below = Table.grid()
        below.add_row(bar)
        below.add_row(Text(summary(self)))
        return Group(table, *rest, below)


def said(outcome: Outcome) -> str:
    """`ada  85/100  graded  8.1 s`."""
    points = f"{number(outcome.points)}/{number(outcome.max_points)}" if outcome.status != "error" else "-"
    status = f"{outcome.status}, complete before" if outcome.kept else outcome.status
    parts = [line(outcome.id, NAME_CHARS), points, status, f"{outcome.wall_s:.1f} s"]
    parts += [line(outcome.message, TEXT_CHARS)] if outcome.message else []
    return "  ".join(parts)


def summary(progress: BatchProgress) -> str:
    """`12 of 60 done, 8 running, 40 waiting, 1 failed; 87.5 points on average; about 4 min to go`."""
    parts = [f"{progress.done} of {progress.total} done"]
    parts += [f"{len(progress.running)} running"] if progress.running else []
    parts += [f"{progress.waiting} waiting"] if progress.waiting else []
    parts += [f"{progress.inconclusive} inconclusive"] if progress.inconclusive else []
    parts += [f"{progress.failed} failed"] if progress.failed else []
    words = ", ".join(parts)
    if progress.mean_points is not None:
        words += f"; {number(progress.mean_points, 1)} points on average"
    left_s = progress.left_s
    if left_s is not None and progress.done < progress.total:
        words += f"; about {_span(left_s)} to go"
    return words


def _span(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    if seconds < 6000:
        return f"{seconds / 60:.0f} min"
    return str(timedelta(seconds=round(seconds / 60) * 60))[:-3] + " h"


@contextmanager
def open_class_display() -> Iterator[Watcher]:
    """Show a batch's progress on stderr until the block is left."""
    console = Console(file=sys.stderr, markup=False, emoji=False, highlight=False)
    if not console.is_terminal or console.is_dumb_terminal or console.encoding != "utf-8":
        yield PlainClass(sys.stderr)
        return
    progress = LiveClass(console)
    with Live(progress, console=console, refresh_per_second=REFRESH_HZ, transient=True):
        yield progress
