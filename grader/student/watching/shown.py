"""What `grader check --watch` prints: on a terminal a screen that is cleared between runs, else line after line."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from typing import IO, TextIO

from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.text import Text

from grader.model.result import CriterionResult, GradingResult
from grader.report.result_json import result_text
from grader.report.terminal import STYLES, emit, mark, open_console, print_report
from grader.report.text import line
from grader.report.view import Loss, ReportView, arrange, places, points_of
from grader.rubric.model import Rubric
from grader.student.watching.loop import Outcome
from grader.student.watching.turns import Turns, turns
from grader.wording import first_few, number

NAME_CHARS, TEXT_CHARS = 60, 300
NAMES_SHOWN = 3
ENDS = "Ctrl-C ends"
DASH = "\N{EN DASH}"
INDENT = 4
Clock = Callable[[], datetime]


def _now() -> datetime:
    return datetime.now().astimezone()


class ScreenShown:
    """The first result whole, as `grader check` prints it, later ones shortened; `hidden` criteria are left out.

    On a terminal, the last result stays while the next one is worked out.
    """

    def __init__(
        self,
        package: str,
        rubric: Rubric,
        stream: IO[str],
        *,
        hidden: int = 0,
        static: bool = False,
        clock: Clock = _now,
    ) -> None:
        self._package, self._rubric, self._hidden, self._static = package, rubric, hidden, static
        self._console: Console = open_console(stream)
        self._clock = clock
        self._at = clock()
        self._last: GradingResult | None = None
        self._ended = False

    def begin(self, saved: tuple[str, ...], running: tuple[str, ...] | None) -> None:
        """See `loop.Shown`."""
        self._at = self._clock()
        if running is None:
            words = "running everything"
        elif running:
            words = f"running {', '.join(running)}"
        else:
            words = "looking at the files" if self._static else "building, nothing is to be run"
        self._say(f"{self._saved(saved)}: {words} … {ENDS}" if saved else f"{words} … {ENDS}")

    def again(self) -> None:
        """See `loop.Shown`."""
        self._say("saved again: what ran was stopped")

    def same(self, saved: tuple[str, ...]) -> None:
        """See `loop.Shown`."""
        self._at = self._clock()
        self._say(f"{self._saved(saved)}: the package is what it was … {ENDS}")

    def end(self, outcome: Outcome, unchanged: frozenset[str], saved: tuple[str, ...]) -> None:
        """See `loop.Shown`."""
        result = outcome.result
        if self._console.is_terminal and self._ended:
            self._console.clear()
        self._ended = True
        if result.error is not None:
            self._emit(self._error(result))
        elif self._last is None:
            print_report(result, self._rubric, self._console, hidden=self._hidden, static=self._static)
        else:
            self._emit(self._short(result, unchanged))
        self._last = result if result.error is None else self._last
        self._say(f"{self._saved(saved)} … {ENDS}" if saved else ENDS)

    def _short(self, result: GradingResult, unchanged: frozenset[str]) -> Iterable[RenderableType]:
        view = arrange(result, self._rubric)
        lost = number(sum(loss.points for loss in view.lost))
        yield Text.assemble(
            (f"{number(result.points)} of {number(result.max_points)} points", "bold"),
            f", {lost} lost" if view.lost else ", nothing lost",
        )
        yield from self._turns(turns(self._last, result))
        yield from self._losses("Lost", view.lost, unchanged)
        if not self._static:
            yield from self._losses("Still open: no points are lost for good", view.open, unchanged)
        elif view.open:
            yield Text(f"\n{self._unrun(view)}")

    def _unrun(self, view: ReportView) -> str:
        points = number(sum(loss.points for loss in view.open))
        return f"Nothing was run (--static): criteria worth {points} points are still open."

    def _turns(self, found: Turns) -> Iterable[Text]:
        said = [
            ("now reached", found.reached, "green"),
            ("better", found.more, "green"),
            ("now lost", found.lost, "red"),
            ("worse", found.less, "red"),
            ("not judged now", found.open, "yellow"),
        ]
        for words, criteria, style in said:
            if criteria:
                names = ", ".join(f"{self._show(c.id, NAME_CHARS)} {points_of(c)}" for c in criteria)
                yield Text(f"{words}: {names}", style)
        if not found:
            yield Text("as before", "dim")

    def _losses(
        self, title: str, losses: Sequence[Loss], unchanged: frozenset[str]
    ) -> Iterable[RenderableType]:
        if losses:
            yield Text(f"\n{title}", "bold")
        for loss in losses:
            yield self._head(loss.criterion, unchanged)
            for name, words in _details(loss):
                if words:
                    yield self._indented(f"{name}: {self._show(words)}")

    def _head(self, criterion: CriterionResult, unchanged: frozenset[str]) -> Text:
        style = STYLES[criterion.status]
        text = Text(f"{mark(criterion.status, self._console.encoding)} ", style)
        text.append(f"{self._show(criterion.id, NAME_CHARS)}  {points_of(criterion)}  ", style)
        text.append(self._show(criterion.message or criterion.title))
        if criterion.scenario in unchanged:
            text.append("  (unchanged)", "dim")
        return text

    def _error(self, result: GradingResult) -> Iterable[RenderableType]:
        if result.error is not None:
            yield Text(f"could not be graded: {self._show(result.error.message)}", "red")
            if result.error.hint:
                yield self._indented(f"hint: {self._show(result.error.hint)}")

    def _indented(self, words: str) -> RenderableType:
        return Padding(Text(words, "dim"), (0, 0, 0, INDENT))

    def _saved(self, saved: tuple[str, ...]) -> str:
        """`saved src/talker.py at 12:03:04`."""
        names = first_few([self._show(name, NAME_CHARS) for name in saved], NAMES_SHOWN)
        return f"saved {names} at {self._at:%H:%M:%S}"

    def _say(self, words: str) -> None:
        text = self._show(f"watching {self._package} {DASH} {words}", 3 * TEXT_CHARS)
        if self._console.is_terminal:
            self._emit([Text(f"\n{text}", "cyan")])
        else:
            self._console.file.write(f"{text}\n")
            self._console.file.flush()

    def _emit(self, parts: Iterable[RenderableType]) -> None:
        emit(self._console, parts)
        self._console.file.flush()

    def _show(self, text: str, limit: int = TEXT_CHARS) -> str:
        text = line(text, limit)
        if _encodes(text, self._console.encoding):
            return text
        text = text.replace(DASH, "-").replace("…", "...")
        return text.encode(self._console.encoding, "backslashreplace").decode(self._console.encoding)


class JsonShown:
    """A JSON document on a line of its own for each result, and nothing else."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def begin(self, *_: object) -> None:
        """See `loop.Shown`."""

    def again(self) -> None:
        """See `loop.Shown`."""

    def same(self, *_: object) -> None:
        """See `loop.Shown`."""

    def end(self, outcome: Outcome, *_: object) -> None:
        """See `loop.Shown`."""
        ascii_only = (self._stream.encoding or "ascii").lower().replace("-", "") != "utf8"
        rows = result_text(outcome.result, ascii_only=ascii_only).split("\n")
        self._stream.write(f"{' '.join(row.strip() for row in rows).strip()}\n")
        self._stream.flush()


def _details(loss: Loss) -> list[tuple[str, str]]:
    criterion = loss.criterion
    return [
        ("hint", criterion.hint),
        ("where", ", ".join(places(criterion))),
        ("also", ", ".join(f"{c.id} {points_of(c)}" for c in loss.alike)),
        ("blocks", ", ".join(f"{c.id} {points_of(c)}" for c in loss.blocked)),
    ]


def _encodes(text: str, encoding: str) -> bool:
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
