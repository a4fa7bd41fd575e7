"""Shows a grading: its progress on stderr, live on a terminal, else as a line at each change of state.

What a package's files alone decide goes to stdout as soon as it is known, before anything is built or run. At the end
`show` prints the report and where its files are, and gives the exit code that the criteria come to.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import IO

from rich.console import Console, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from grader.cli.output import report, say, say_document
from grader.errors import ExitCode, GraderError
from grader.judging.summary import overall_status, reached_pass_mark, scaled_pass_mark
from grader.model.result import CriterionResult, EarlyVerdict, GradingResult, Progress, StepState
from grader.model.verdict import Status
from grader.report.files import result_text
from grader.report.sentences import STYLES
from grader.report.terminal import Terminal, mark, open_console
from grader.report.text import visible
from grader.results import RESULT
from grader.rubric.model import Rubric
from grader.untrusted_text import line, without_ci_commands

EARLY_TITLE = "Your files, before anything is built or run:"
SO_FAR = "Provisional: the build can still change these results."
MESSAGE_CHARS = 300
INDENT, HANGING = 2, 4
ESCAPE = 8
"""A line may become this much longer when characters in it are escaped."""
REFRESH_HZ = 8
NAME_LIMIT = 120
DETAIL_LIMIT = 160
WORDS = {
    "waiting": ("·", "dim"),
    "running": ("▶", "cyan"),
    "done": ("✓", "green"),
    "failed": ("✗", "red"),
    "skipped": ("-", "dim"),
}
ENDED = frozenset({"done", "failed", "skipped"})
Tell = Callable[[tuple[EarlyVerdict, ...]], None]


@dataclass(frozen=True, kw_only=True)
class Step:
    """The last known state of a step. Times are monotonic seconds; a step begins when it first runs."""

    name: str
    state: StepState
    detail: str = ""
    expected_s: float | None = None
    begun_s: float | None = None
    ended_s: float | None = None

    def elapsed_s(self, now_s: float) -> float | None:
        if self.begun_s is None:
            return None
        return (now_s if self.ended_s is None else self.ended_s) - self.begun_s


class Steps:
    """The steps in order of appearance; any thread may report one. `tell` shows what the files alone decide."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, tell: Tell | None = None) -> None:
        self.clock = clock
        self.lock = threading.Lock()
        self.steps: dict[str, Step] = {}
        self.begun_s = clock()
        self.tell = tell

    def step(self, name: str, state: StepState, detail: str = "", expected_s: float | None = None) -> None:
        """Take note of a step's state (see `grader.model.result.Progress`)."""
        now_s = self.clock()
        with self.lock:
            before = self.steps.get(name)
            after = replace(before or Step(name=name, state=state), state=state, detail=detail)
            # how long it takes is said once, when it is planned
            if expected_s is not None:
                after = replace(after, expected_s=expected_s)
            if after.begun_s is None and state != "waiting":
                after = replace(after, begun_s=now_s)
            after = replace(after, ended_s=now_s if state in ENDED else None)
            self.steps[name] = after
            self.changed(before, after, now_s)

    def early(self, verdicts: Callable[[], tuple[EarlyVerdict, ...]]) -> None:
        """Show what the files alone decide, if that is wanted."""
        if self.tell is not None:
            self.tell(verdicts())

    def changed(self, before: Step | None, after: Step, now_s: float) -> None:
        """Do nothing; a subclass may show the change."""

    def snapshot(self) -> tuple[Step, ...]:
        with self.lock:
            return tuple(self.steps.values())


class PlainSteps(Steps):
    """A line with the time of day whenever a step's state changes."""

    def __init__(
        self, stream: IO[str], clock: Callable[[], float] = time.monotonic, tell: Tell | None = None
    ) -> None:
        super().__init__(clock, tell)
        self.stream = stream

    def changed(self, before: Step | None, after: Step, now_s: float) -> None:
        """Print, unless only the detail is new."""
        if before is not None and before.state == after.state:
            return
        stamp = datetime.now().astimezone().strftime("%H:%M:%S")
        words = [line(after.name, NAME_LIMIT), after.state, _times(after, now_s), _detail_line(after.detail)]
        print(stamp, "  ".join(word for word in words if word), file=self.stream, flush=True)


class LiveSteps(Steps):
    """The steps as a table that rich redraws; no step waits for it.

    It has at most `rows` lines: of more steps, it shows those that run and those that ended last.
    """

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, *, rows: int = 100, tell: Tell | None = None
    ) -> None:
        super().__init__(clock, tell)
        self.rows = max(rows, 3)  # one step, one that runs, and the total

    def __rich__(self) -> Table:
        now_s = self.clock()
        every = self.snapshot()
        steps = _fitting(every, self.rows - 1)
        table = Table.grid(padding=(0, 2, 0, 0), expand=True)
        for _ in range(3):
            table.add_column(no_wrap=True)
        table.add_column(no_wrap=True, overflow="ellipsis", ratio=1)
        for step in steps:
            symbol, style = WORDS[step.state]
            name = Text(f"{symbol} {line(step.name, NAME_LIMIT)}", style)
            detail = Text(_detail_line(step.detail), "dim")
            table.add_row(name, Text(step.state, style), Text(_times(step, now_s)), detail)
        table.add_row(
            Text("total", "bold"),
            Text(),
            Text(f"{now_s - self.begun_s:.1f} s"),
            Text(_time_left(every, now_s)),
        )
        return table


def live_console() -> Console | None:
    """Return a console on stderr on which lines can be drawn again; None where stderr is none."""
    console = Console(file=sys.stderr, markup=False, emoji=False, highlight=False)
    # the signs before the steps are not in other encodings
    live = console.is_terminal and not console.is_dumb_terminal and console.encoding == "utf-8"
    return console if live else None


@contextmanager
def open_progress(*, early: bool = False) -> Iterator[Progress]:
    """Show progress on stderr until the block ends; then a live display is cleared.

    With `early`, what the files alone decide is printed to stdout as soon as it is known, and stays there.
    """
    console = live_console()
    if console is None:
        yield PlainSteps(sys.stderr, tell=print_early if early else None)
        return
    # stdout in a file or a pipe cannot get in the way of the display
    above = console.print if sys.stdout.isatty() else None
    tell = partial(print_early, above=above, width=console.width)
    steps = LiveSteps(rows=console.height - 1, tell=tell if early else None)
    with Live(
        steps,
        console=console,
        refresh_per_second=REFRESH_HZ,
        transient=True,
        redirect_stdout=False,  # what is printed there is the report, and not a part of the display
        redirect_stderr=False,
    ):
        yield steps


def _fitting(steps: tuple[Step, ...], rows: int) -> tuple[Step, ...]:
    """Return as many steps as there are rows, in order, without those that ended first."""
    ended = sorted((s for s in steps if s.state in ENDED), key=lambda step: step.ended_s or 0.0)
    dropped = {step.name for step in ended[: max(len(steps) - rows, 0)]}
    return tuple(step for step in steps if step.name not in dropped)[:rows]


def _times(step: Step, now_s: float) -> str:
    """Return `3.2 s of about 7 s`."""
    elapsed_s = step.elapsed_s(now_s)
    if elapsed_s is None:
        return f"takes about {step.expected_s:.0f} s" if step.expected_s else ""
    if step.state in ENDED or not step.expected_s:
        return f"{elapsed_s:.1f} s"
    return f"{elapsed_s:.1f} s of about {step.expected_s:.0f} s"


def _time_left(steps: tuple[Step, ...], now_s: float) -> str:
    """Return the time that is left: that of the longest step, since runs go side by side."""
    left_s = [
        (step.expected_s or 0.0) - (step.elapsed_s(now_s) or 0.0) for step in steps if step.state not in ENDED
    ]
    longest_s = max(left_s, default=0.0)
    return f"about {longest_s:.0f} s to go" if longest_s >= 1 else ""


def _detail_line(detail: str) -> str:
    return line(detail, DETAIL_LIMIT)


def print_early(
    verdicts: tuple[EarlyVerdict, ...], above: Callable[[Text], None] | None = None, *, width: int = 80
) -> None:
    """Print each verdict at once, with how to fix a loss; with `above` if a live display is in the way, else to stdout.

    Lines for a display are at most `width` columns wide.
    """
    if not verdicts:
        return
    for row in _rows(verdicts, sys.stdout.encoding or "ascii"):
        if above is None:
            say(row.plain)
        else:
            for part in _wrap_lines(row, width):
                above(part)
    sys.stdout.flush()


def _rows(verdicts: tuple[EarlyVerdict, ...], encoding: str) -> Iterator[Text]:
    """Yield what passes in one row, and a row for each other verdict."""
    yield Text(EARLY_TITLE, "bold")
    passes = [v for v in verdicts if v.criterion.status is Status.PASS]
    others = [v for v in verdicts if v.criterion.status is not Status.PASS]
    if passes:
        row = Text(" " * INDENT)
        row.append(f"{mark(Status.PASS, encoding)} {len(passes)} pass", STYLES[Status.PASS])
        row.append(f": {', '.join(visible(verdict.criterion.id) for verdict in passes)}")
        yield row
    name_width = max((len(visible(verdict.criterion.id)) for verdict in others), default=0)
    for verdict in others:
        criterion = verdict.criterion
        row = Text(" " * INDENT)
        row.append(f"{mark(criterion.status, encoding)} {criterion.status.value}", STYLES[criterion.status])
        row.append(f"  {visible(criterion.id):{name_width}}  {line(criterion.message, MESSAGE_CHARS)}")
        yield row
        if criterion.missing and criterion.hint:
            yield Text(f"{' ' * HANGING}hint: {line(criterion.hint, MESSAGE_CHARS)}", "dim")
    if not all(verdict.final for verdict in verdicts):
        yield Text(f"{' ' * INDENT}{SO_FAR}", "dim")
    yield Text()


def _wrap_lines(row: Text, width: int) -> Iterator[Text]:
    """Return its lines as a terminal shows them, none of which a CI system takes for a command."""
    parts = row.wrap(Console(width=width), width - ESCAPE - HANGING, overflow="fold") or [row]
    for number, part in enumerate(parts):
        harmless = without_ci_commands(part.plain)
        shown = part if harmless == part.plain else Text(harmless, part.style)
        yield Text(" " * HANGING).append_text(shown) if number else shown


def exit_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Return the exit code of the criteria that are shown.

    A pass mark in points that is reached stays reached, even if some criteria are open.
    """
    shown = tuple(criteria)
    status = overall_status(shown)
    if status == "error":
        return ExitCode.NOT_GRADED
    mark_of_shown = scaled_pass_mark(rubric, sum(c.max_points for c in shown))
    if reached_pass_mark(rubric.model_copy(update={"pass_mark": mark_of_shown}), shown):
        return ExitCode.PASSED
    return ExitCode.INCONCLUSIVE if status == "inconclusive" else ExitCode.BELOW_PASS_MARK


def worst(codes: Iterable[ExitCode]) -> ExitCode:
    """Return the worst code: not graded is worse than below the pass mark, and that is worse than inconclusive."""
    order = (ExitCode.PASSED, ExitCode.INCONCLUSIVE, ExitCode.BELOW_PASS_MARK, ExitCode.NOT_GRADED)
    return max(codes, key=order.index)


def staged_code(criteria: Iterable[CriterionResult], rubric: Rubric) -> ExitCode:
    """Return the code of a pre-commit hook: any criterion that fails, fails it, whatever the pass mark is."""
    judged = judged_criteria(criteria)
    # a package of which nothing could be judged without a run fails no commit
    counted = [c for c in judged if c.is_required or c.status is Status.ERROR]
    return exit_code(judged, rubric.model_copy(update={"pass_mark": None})) if counted else ExitCode.PASSED


def judged_criteria(criteria: Iterable[CriterionResult]) -> tuple[CriterionResult, ...]:
    """Return the criteria that could be judged."""
    return tuple(c for c in criteria if not c.status.is_open)


REPORT = "report.html"
REPORTS = (REPORT, RESULT, "report.md", "junit.xml", "console.log")


def show(
    result: GradingResult,
    rubric: Rubric,
    folder: Path | None,
    *,
    hidden: int = 0,
    as_json: bool = False,
    static: bool = False,
    unrun: str = "",
    remarks: Sequence[RenderableType] = (),
    full: bool = False,
) -> ExitCode:
    """Print the result, from which `hidden` criteria are left out already, and return its exit code.

    With `static`, only the criteria that could be judged count. `unrun` says why nothing was run, on purpose or not:
    open criteria are then only counted in the report. `remarks` stand before the losses; with `full` all criteria are
    listed.
    """
    if as_json:
        say_document(lambda ascii_only: result_text(result, ascii_only=ascii_only))
    else:
        console = open_console(sys.stdout)
        Terminal(console).report(result, rubric, hidden=hidden, unrun=unrun, remarks=remarks, full=full)
        _paths(folder)
    if result.error is not None:
        report(GraderError(result.error.message, hint=result.error.hint))
    if result.status == "error":
        return ExitCode.NOT_GRADED
    return exit_code(judged_criteria(result.criteria) if static else result.criteria, rubric)


def _paths(folder: Path | None) -> None:
    if folder is None:
        return
    others = [name for name in REPORTS[1:] if (folder / name).is_file()]
    others += ["evidence/"] if (folder / "evidence").is_dir() else []
    if (folder / REPORT).is_file():
        say(f"Report: {folder / REPORT}")
    if others:
        say(f"Beside it: {', '.join(others)}")
