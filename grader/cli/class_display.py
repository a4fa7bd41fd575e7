"""Shows the progress of a batch on stderr, as a live display or a line per submission, and its outcome on stdout."""

from __future__ import annotations

import shlex
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from itertools import islice
from typing import IO

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from grader.classes.batch.folder import BatchFolder
from grader.classes.batch.job import SubmissionOutcome
from grader.classes.batch.regrade import CHANGES, CriterionState, Regraded
from grader.classes.batch.run import GRADEBOOK, INDEX, RESULTS, Watcher
from grader.classes.gradebook import GradebookRow
from grader.classes.overrides import FILE as OVERRIDES
from grader.cli.display import live_console
from grader.cli.output import say, say_json
from grader.model.batch import ROSTER
from grader.model.verdict import Status
from grader.report.class_page.page import grade_one
from grader.report.class_page.submissions import letters_of, passed_by_none, state_of
from grader.untrusted_text import line
from grader.wording import first_few, number, plural

LATELY = 40
"""The pace is that of so many of the last gradings."""
OPEN = {
    Status.INCONCLUSIVE: "could not be judged",
    Status.MANUAL: "waits for a person",
    Status.ERROR: "failed",
}
CRITERIA_SHOWN = 4
NEXT_STEPS = {
    "error": "{count} could not be graded; once that is fixed: --only failed",
    "inconclusive": "{count} not decided yet; to grade them again: --only inconclusive",
    "manual": "{count} with criteria that a person decides: grader review {folder}, or points in {overrides}",
    "missing": "{count} not graded yet: the same command goes on with them",
}


@dataclass
class BatchProgress:
    """Counts of a batch. `total` are the submissions that were asked for, `points_sum` is over those with points."""

    clock: Callable[[], float] = time.monotonic
    total: int = 0
    graded: int = 0
    inconclusive: int = 0
    failed: int = 0
    kept: int = 0
    points_sum: float = 0.0
    running: dict[str, float] = field(default_factory=dict)
    _ends_s: list[float] = field(default_factory=list)
    _paced_s: float = 0.0

    def planned(self, total: int) -> None:
        """`total` submissions will be graded."""
        self.total = total

    def begun(self, name: str) -> None:
        """The submission of that id begins."""
        self.running[name] = self.clock()

    def ended(self, outcome: SubmissionOutcome) -> None:
        """A submission has its outcome."""
        self.running.pop(outcome.id, None)
        self.graded += outcome.status == "graded"
        self.inconclusive += outcome.status == "inconclusive"
        self.failed += outcome.status == "error"
        self.kept += outcome.kept
        self.points_sum += outcome.points if outcome.status != "error" else 0.0
        if not outcome.kept:
            if not self._ends_s:
                # the pace begins with the first one that was really graded
                self._paced_s = self.clock() - outcome.wall_s
            self._ends_s = [*self._ends_s[-LATELY:], self.clock()]

    @property
    def done(self) -> int:
        return self.graded + self.inconclusive + self.failed

    @property
    def waiting(self) -> int:
        return max(self.total - self.done - len(self.running), 0)

    @property
    def mean_points(self) -> float | None:
        """The mean points of those that have points; None as long as there are none."""
        judged = self.graded + self.inconclusive
        return self.points_sum / judged if judged else None

    @property
    def left_s(self) -> float | None:
        """The time that is left, at the pace of the last gradings; None before two of them have ended.

        What was complete before takes nearly no time, so it does not count towards the pace.
        """
        if len(self._ends_s) < 2:
            return None
        # of few, from the beginning of the first one; of many, from the end of the one before the last ones
        few = len(self._ends_s) <= LATELY
        begin_s, count = (self._paced_s, len(self._ends_s)) if few else (self._ends_s[0], LATELY)
        return (self.clock() - begin_s) / count * (self.total - self.done)


def list_attention(folder: BatchFolder) -> Iterator[str]:
    """Yield why each submission that is not graded is not, then how to go on with them."""
    found: Counter[str] = Counter()
    criteria, letters = folder.run.criteria, []
    for row in folder.rows():
        state = state_of(row.result)
        letters.append(letters_of(row.result, criteria))
        found[state] += 1
        if state == "error":
            error = row.result.error
            yield f"{_name(row)}: error: {error.message if error else _open(row)}"
        elif state == "inconclusive":
            yield f"{_name(row)}: not decided yet: {_open(row)}"
        for override in row.result.overrides:
            if override.changed:
                yield f"{row.entry.id}: {override.criterion}: a person decided, and the check says something else now"
    for name, words in NEXT_STEPS.items():
        if found[name]:
            yield words.format(count=found[name], folder=folder.path, overrides=folder.path / OVERRIDES)
    by_none = passed_by_none(criteria, letters)
    for place, decided in islice(by_none.items(), NAMES_SHOWN):
        asked = f"{criteria[place].id} ({criteria[place].title})"
        yield f"none of {decided} got full points for {asked}: is the rubric right there?"
    if by_none:
        yield f"  hint: grade a package that you know to be correct: {shlex.join(grade_one(folder.run))}"


def _name(row: GradebookRow) -> str:
    """Return the id, with the line of the roster unless the error names it already."""
    error = row.result.error
    told = error is not None and error.kind == ROSTER
    return row.entry.id if told or not row.entry.where else f"{row.entry.id} ({row.entry.where})"


def _open(row: GradebookRow) -> str:
    names = [f"{c.id} ({OPEN[c.status]})" for c in row.result.criteria if c.status in OPEN and c.counts]
    return first_few(names, CRITERIA_SHOWN)


REFRESH_HZ = 4
NAME_CHARS = 40
TEXT_CHARS = 300
RUNNING_SHOWN = 8
NAMES_SHOWN = 10
REASONS_SHOWN = 3
CHANGES_SHOWN = 200
MANY = 500
"""For more submissions than that, a log has a line per hundredth of them, and for each that is not graded."""


class PlainClass(BatchProgress):
    """A line with the time of day for each submission."""

    def __init__(self, stream: IO[str]) -> None:
        super().__init__()
        self.stream = stream

    def ended(self, outcome: SubmissionOutcome) -> None:
        """Print what became of it, and what is left."""
        super().ended(outcome)
        step = self.total // 100 if self.total > MANY else 1
        if outcome.status != "graded" or self.done % step == 0 or self.done == self.total:
            stamp = datetime.now().astimezone().strftime("%H:%M:%S")
            print(f"{stamp} {outcome_line(outcome)}  [{summary(self)}]", file=self.stream, flush=True)


class LiveClass(BatchProgress):
    """A progress bar, the counts, and what runs; a line above it stays for each submission that is not graded."""

    def __init__(self, console: Console) -> None:
        super().__init__()
        self.console = console

    def ended(self, outcome: SubmissionOutcome) -> None:
        """Leave a line if a person has to look at it."""
        super().ended(outcome)
        if outcome.status != "graded" or outcome.message:
            self.console.print(Text(outcome_line(outcome), "red" if outcome.status == "error" else "yellow"))

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


def outcome_line(outcome: SubmissionOutcome) -> str:
    """Return `ada  85/100  graded  8.1 s`."""
    points = f"{number(outcome.points)}/{number(outcome.max_points)}" if outcome.status != "error" else "-"
    status = f"{outcome.status}, complete already" if outcome.kept else outcome.status
    parts = [line(outcome.id, NAME_CHARS), points, status, f"{outcome.wall_s:.1f} s"]
    parts += [line(outcome.message, TEXT_CHARS)] if outcome.message else []
    return "  ".join(parts)


def summary(progress: BatchProgress) -> str:
    """`12 of 60 done, 8 running, 40 waiting, 1 failed; 87.5 points on average; about 4 min to go`."""
    parts = [f"{progress.done} of {progress.total} done"]
    parts += [f"{len(progress.running)} running"] if progress.running else []
    parts += [f"{progress.waiting} waiting"] if progress.waiting else []
    parts += [f"{progress.inconclusive} not decided yet"] if progress.inconclusive else []
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
    """Show a batch's progress on stderr until the block ends."""
    console = live_console()
    if console is None:
        yield PlainClass(sys.stderr)
        return
    progress = LiveClass(console)
    with Live(progress, console=console, refresh_per_second=REFRESH_HZ, transient=True):
        yield progress


def print_batch(folder: BatchFolder, *, as_json: bool) -> None:
    """Print what became of a batch, and what a person has to look at."""
    if as_json:
        say_json(folder.run.model_dump(mode="json", by_alias=True, exclude={"entries"}))
        return
    for text in list_attention(folder):
        say(text)
    counts = folder.run.counts
    parts = [plural(counts.submissions, "submission"), f"{counts.graded} graded ({counts.passed} passed)"]
    parts += [f"{counts.inconclusive} not decided yet"] if counts.inconclusive else []
    parts += [f"{counts.error} could not be graded"] if counts.error else []
    parts += [f"{counts.missing} not graded yet"] if counts.missing else []
    parts += [f"{counts.kept} complete already"] if counts.kept else []
    say(", ".join(parts))
    say(f"{folder.path / INDEX}  {folder.path / GRADEBOOK}  {folder.path / RESULTS}")


def print_regraded(batch: BatchFolder, regraded: Sequence[Regraded], *, as_json: bool) -> None:
    """Print what changed when a class was judged again."""
    if as_json:
        say_json([_regraded_json(one) for one in regraded])
        return
    for text in _regraded_lines(batch, regraded):
        say(text)


def _regraded_json(one: Regraded) -> dict[str, object]:
    return {
        "id": one.id,
        "points_before": one.points_before,
        "points": one.points,
        "missing": list(one.missing),
        "error": one.error,
        "changes": [
            {
                "criterion": change.criterion,
                "before": _state_json(change.before),
                "after": _state_json(change.after),
                "why": change.why,
            }
            for change in one.changes
        ],
    }


def _state_json(state: CriterionState | None) -> dict[str, object] | None:
    return {"status": state.status.value, "points": state.points} if state else None


def _regraded_lines(batch: BatchFolder, regraded: Sequence[Regraded]) -> Iterator[str]:
    """Yield each change once, with all for whom it is the same, whose points changed, and what is left to do."""
    same: dict[tuple[str, str], dict[str, str]] = {}
    for one in regraded:
        for change in one.changes:
            before, after = map(_status_and_points, (change.before, change.after))
            same.setdefault((change.criterion, f"{before} -> {after}"), {})[one.id] = change.why
    for (criterion, what), reasons in islice(same.items(), CHANGES_SHOWN):
        names = first_few(list(reasons), NAMES_SHOWN)
        yield f"{criterion}: {what}, {plural(len(reasons), 'submission')}: {names}"
        yield from (f"    {why}" for why in islice(dict.fromkeys(reasons.values()), REASONS_SHOWN))
    for word, sign in (("more", 1), ("fewer", -1)):
        points = [
            f"{one.id} {number(one.points_before)} -> {number(one.points)}"
            for one in regraded
            if one.points_before is not None
            and one.points is not None
            and (one.points - one.points_before) * sign > 0
        ]
        if points:
            yield f"{word} points for {len(points)}: {first_few(points, NAMES_SHOWN)}"
    errors: dict[str, list[str]] = {}
    for one in regraded:
        if one.error:
            errors.setdefault(one.error, []).append(one.id)
    yield from (f"{first_few(names, NAMES_SHOWN)}: unchanged: {error}" for error, names in errors.items())
    missing = [one for one in regraded if one.missing]
    if missing:
        names = first_few([one.id for one in missing], NAMES_SHOWN)
        scenarios = ", ".join(dict.fromkeys(name for one in missing for name in one.missing))
        yield f"{len(missing)} must run again, since there is no recording of {scenarios}: {names}"
        yield "  hint: --run-missing runs them"
    changed = sum(bool(one.changes) for one in regraded)
    judged = sum(one.points is not None for one in regraded)
    yield f"{judged} of {len(regraded)} judged again, {changed} changed"
    yield f"{batch.path / GRADEBOOK}  {batch.path / CHANGES}"


def _status_and_points(state: CriterionState | None) -> str:
    return f"{state.status.value} {number(state.points)}" if state else "-"
