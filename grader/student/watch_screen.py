"""What `grader check --watch` prints: on a terminal a screen that is cleared between runs, else line after line."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime
from typing import IO, TextIO

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.files import result_text
from grader.report.losses import arrange
from grader.report.sentences import points_line
from grader.report.terminal import (
    TO_FIX,
    Terminal,
    emit,
    fit_encoding,
    open_console,
    print_report,
)
from grader.report.text import line
from grader.report.view import points_of
from grader.rubric.model import Rubric
from grader.student.watching import Screen, WatchedResult
from grader.wording import first_few, number

NAME_CHARS, TEXT_CHARS = 60, 300
NAMES_SHOWN = 3
ENDS = "Ctrl-C ends it"
DASH = "\N{EN DASH}"
INDENT = 4
CHANGES = {
    "now reached": "green",
    "better": "green",
    "now lost": "red",
    "worse": "red",
    "no longer judged": "yellow",
}


class TerminalScreen(Screen):
    """Prints the first result in full, as `grader check` does, and later ones shortened.

    On a terminal, a result stays while the next one is worked out. `hidden` is how many criteria are left out.
    """

    def __init__(
        self,
        package: str,
        rubric: Rubric,
        stream: IO[str],
        *,
        hidden: int = 0,
        static: bool = False,
        clock: Callable[[], datetime] = lambda: datetime.now().astimezone(),
    ) -> None:
        self._package, self._rubric, self._hidden = package, rubric, hidden
        self._unrun = "--static" if static else ""
        self._console = open_console(stream)
        self._clock = clock
        self._at = clock()
        self._last: GradingResult | None = None
        self._ended = False

    def begin(self, saved: tuple[str, ...]) -> None:
        self._at = self._clock()
        doing = "looking at the files" if self._unrun else "running everything"
        self._say(f"{self._saved_text(saved)}: {doing} … {ENDS}" if saved else f"{doing} … {ENDS}")

    def restart(self) -> None:
        self._say("saved again: starting over")

    def unchanged(self, saved: tuple[str, ...]) -> None:
        self._at = self._clock()
        self._say(f"{self._saved_text(saved)}: nothing has changed … {ENDS}")

    def end(self, outcome: WatchedResult, saved: tuple[str, ...]) -> None:
        result = outcome.result
        if self._console.is_terminal and self._ended:
            self._console.clear()
        self._ended = True
        if result.error is not None:
            self._emit([Text(f"Could not be graded: {self._show(result.error.message)}", "red")])
            if result.error.hint:
                hint = Text(f"hint: {self._show(result.error.hint)}", "dim")
                self._emit([Padding(hint, (0, 0, 0, INDENT))])
        elif self._last is None:
            print_report(result, self._rubric, self._console, hidden=self._hidden, unrun=self._unrun)
        else:
            self._emit(self._short(result, self._last))
        self._last = result if result.error is None else self._last
        self._say(f"{self._saved_text(saved)} … {ENDS}" if saved else ENDS)

    def _short(self, result: GradingResult, before: GradingResult) -> Iterable[RenderableType]:
        view = arrange(result, self._rubric)
        lost = number(sum(loss.points for loss in view.lost))
        yield Text.assemble(
            (points_line(result, view), "bold"),
            f", {lost} lost" if view.lost else ", nothing lost",
        )
        changed = compare(before, result)
        for words, criteria in changed.items():
            names = ", ".join(f"{self._show(c.id, NAME_CHARS)} {points_of(c)}" for c in criteria)
            yield Text(f"{words}: {names}", CHANGES[words])
        if not changed:
            yield Text("as before", "dim")
        if view.open:
            yield from Terminal(self._console).still_open(view.open, self._unrun)
        yield from Terminal(self._console).losses(TO_FIX, view.lost)

    def _saved_text(self, saved: tuple[str, ...]) -> str:
        """`saved src/talker.py at 12:03:04`."""
        names = first_few([self._show(name, NAME_CHARS) for name in saved], NAMES_SHOWN)
        return f"saved {names} at {self._at:%H:%M:%S}"

    def _say(self, words: str) -> None:
        text = self._show(f"Watching {self._package} {DASH} {words}", 3 * TEXT_CHARS)
        if self._console.is_terminal:
            self._emit([Text(f"\n{text}", "cyan")])
        else:
            self._console.file.write(f"{text}\n")
            self._console.file.flush()

    def _emit(self, parts: Iterable[RenderableType]) -> None:
        emit(self._console, parts)
        self._console.file.flush()

    def _show(self, text: str, limit: int = TEXT_CHARS) -> str:
        return fit_encoding(line(text, limit), self._console.encoding)


class JsonLines(Screen):
    """Prints each result as a JSON document on a line of its own, and nothing else."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def end(self, outcome: WatchedResult, _saved: tuple[str, ...]) -> None:
        ascii_only = (self._stream.encoding or "ascii").lower().replace("-", "") != "utf8"
        rows = result_text(outcome.result, ascii_only=ascii_only).split("\n")
        self._stream.write(f"{' '.join(row.strip() for row in rows).strip()}\n")
        self._stream.flush()


def compare(before: GradingResult, after: GradingResult) -> dict[str, list[CriterionResult]]:
    """Return the criteria worth points that are better or worse than before, under the words of `CHANGES`."""
    earlier = {c.id: c for c in before.criteria}
    found: dict[str, list[CriterionResult]] = {words: [] for words in CHANGES}
    for criterion in after.criteria:
        if criterion.id in earlier and criterion.counts:
            words = _change(earlier[criterion.id], criterion)
            if words:
                found[words].append(criterion)
    return {words: criteria for words, criteria in found.items() if criteria}


def _change(before: CriterionResult, after: CriterionResult) -> str:
    if after.status.is_retryable:
        return "" if before.status.is_retryable else "no longer judged"
    had, has = before.status is Status.PASS, after.status is Status.PASS
    if has != had:
        return "now reached" if has else "now lost"
    if after.points == before.points:
        return ""
    return "better" if after.points > before.points else "worse"
