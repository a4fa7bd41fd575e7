"""The report in a terminal: points, what was lost, then all. Readable at 80 columns and in a pipe."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import IO

from rich.cells import cell_len
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from grader.model.result import AppliedOverride, CriterionResult, GradingResult, Note
from grader.model.verdict import Status
from grader.report import sentences
from grader.report.sentences import (
    COSTS_NOTHING,
    NOTICED_TITLE,
    SIGNS,
    note_place,
    note_text,
    visible_words,
    without_sandbox,
)
from grader.report.text import line, uncommanded
from grader.report.view import Loss, arrange, not_graded, places, pointed_at, points_of
from grader.rubric.model import Rubric
from grader.wording import number

LIMIT = 500
NAME_LIMIT = 30
NAME_CELLS, WORDS_CELLS = 20, 20
MEASURED_LIMIT = 120
STYLES = {
    Status.PASS: "green",
    Status.PARTIAL: "yellow",
    Status.FAIL: "red",
    Status.BLOCKED: "dim",
    Status.INCONCLUSIVE: "yellow",
    Status.ERROR: "magenta",
    Status.MANUAL: "cyan",
}
PLAIN_MARKS = {
    Status.PASS: "+",
    Status.PARTIAL: "~",
    Status.FAIL: "x",
    Status.BLOCKED: "-",
    Status.INCONCLUSIVE: "?",
    Status.ERROR: "!",
    Status.MANUAL: "o",
}
"""In place of `SIGNS` where an encoding has no ✓."""


def open_console(file: IO[str]) -> Console:
    """A console that takes no text for markup. Colour on a terminal only; 80 columns where there is none."""
    terminal = file.isatty()
    return Console(
        file=file,
        markup=False,
        emoji=False,
        highlight=False,
        soft_wrap=False,
        width=None if terminal else 80,
        legacy_windows=False,
    )


def emit(console: Console, parts: Iterable[RenderableType]) -> None:
    """Print each part on lines of its own, without the blanks that fill a column.

    A text that is wrapped must not become a command to a CI system where its next line begins.
    """
    with console.capture() as capture:
        for part in parts:
            console.print(part, overflow="fold")
    text = uncommanded("\n".join(row.rstrip() for row in capture.get().split("\n")))
    console.file.write(text.encode(console.encoding, "backslashreplace").decode(console.encoding))


def print_report(
    result: GradingResult,
    rubric: Rubric,
    console: Console,
    *,
    hidden: int = 0,
    static: bool = False,
    unrun: str = "",
) -> None:
    """Print the whole report. `hidden` is how many criteria are left out.

    With `static`, open ones are only counted, as they are where `unrun` says why nothing was run.
    """
    Terminal(console).report(result, rubric, hidden, unrun or ("--static" if static else ""))


def render_terminal(result: GradingResult, rubric: Rubric, hidden: int = 0) -> str:
    """Return the report as it is printed where there is no terminal: without colour, 80 columns wide."""
    text = io.StringIO()
    print_report(result, rubric, open_console(text), hidden=hidden)
    return text.getvalue()


class Terminal:
    """Prints by the console's own means, in characters that its encoding has."""

    def __init__(self, console: Console) -> None:
        self.console = console

    def report(self, result: GradingResult, rubric: Rubric, hidden: int, unrun: str) -> None:
        view = arrange(result, rubric)
        parts: list[RenderableType] = [self._head(result, rubric)]
        unwalled = without_sandbox(result.environment.sandbox)
        parts += [Text(self._show(unwalled), "yellow")] if unwalled else []
        parts += [Text(self._show(words)) for words in sentences.score_words(result)]
        parts += self._section(
            sentences.DECIDED_TITLE, [self._decision(o, c) for o, c in sentences.decided(result)]
        )
        parts += self._losses("Lost", view.lost)
        if unrun:
            parts += self._unrun(view.open, unrun)
        else:
            parts += self._losses("Still open: no points are lost for good", view.open)
        parts += self._section("Advice, costs nothing", [self._advice(c) for c in view.advice])
        parts += self._section(NOTICED_TITLE, self._noticed(result.notes))
        judged = [c for c in result.criteria if not unrun or not c.status.is_open]
        title = "All criteria that could be judged" if unrun else "All criteria"
        parts += self._section(title, [self._table(judged)] if judged else [])
        if hidden:
            parts.append(Text(f"\n{visible_words(result, hidden)}"))
        emit(self.console, parts)

    def _head(self, result: GradingResult, rubric: Rubric) -> Text:
        points = f"{number(result.points)} of {number(result.max_points)} points"
        title = "Not graded" if not_graded(result) else points
        text = Text.assemble((title, "bold"), "  ", self._show(result.submission.id), "\n")
        if result.error is not None and not_graded(result):
            text.append(f"{self._show(result.error.message)}\n")
        text.append(self._show(f"{result.rubric.id}: {rubric.title}"), "dim")
        return text

    def _decision(self, override: AppliedOverride, criterion: CriterionResult) -> RenderableType:
        head = self._line(criterion, sentences.decision(override))
        again = sentences.look_again(override, criterion)
        rows = [("check", sentences.automatic_words(override, criterion)), ("changed", again)]
        return Group(head, Padding(self._rows(rows), (0, 0, 0, 4)))

    def _section(self, title: str, parts: list[RenderableType]) -> list[RenderableType]:
        return [Text(f"\n{title}", "bold"), *parts] if parts else []

    def _losses(self, title: str, losses: tuple[Loss, ...]) -> list[RenderableType]:
        width = max((cell_len(self._show(loss.criterion.id)) for loss in losses), default=0)
        parts = [self._loss(loss, min(width, NAME_CELLS)) for loss in losses]
        return self._section(title, [x for part in parts for x in (part, Text())][:-1])

    def _unrun(self, losses: tuple[Loss, ...], why: str) -> list[RenderableType]:
        points = number(sum(loss.points for loss in losses))
        still = f"criteria worth {points} points are still open" if losses else "nothing is open"
        return [Text(f"\nNothing was run ({why}): {still}.")]

    def _loss(self, loss: Loss, width: int) -> RenderableType:
        c = loss.criterion
        head = self._line(c, c.message or c.title, width)
        rows = [("measured", c.measured), ("expected", c.expected), ("hint", c.hint), ("see", c.reproduce)]
        rows.append(("where", ", ".join(places(c))))
        rows.append(("also", ", ".join(f"{a.id} {points_of(a)}" for a in loss.alike)))
        rows.append(("blocks", ", ".join(f"{b.id} {points_of(b)}" for b in loss.blocked)))
        source = [Text(self._encoded(row)) for pair in pointed_at(c) for row in pair]
        code = [Padding(Group(*source), (0, 0, 0, 4))] if source else []
        return Group(head, Padding(self._rows(rows), (0, 0, 0, 4)), *code)

    def _advice(self, criterion: CriterionResult) -> RenderableType:
        head = self._line(criterion, criterion.message or criterion.title)
        return Group(head, Padding(self._rows([("hint", criterion.hint)]), (0, 0, 0, 4)))

    def _noticed(self, notes: tuple[Note, ...]) -> list[RenderableType]:
        if not notes:
            return []
        return [
            self._rows([(note_place(note), note_text(note)) for note in notes]),
            Text(COSTS_NOTHING, "dim"),
        ]

    def _line(self, criterion: CriterionResult, words: str, width: int = 0) -> RenderableType:
        """`✗ chatter-rate  0/10  fail  /chatter came at 5.02 Hz, not 10 Hz`, wrapped in its column.

        Where too little room is left for the words, they stand below.
        """
        style = STYLES[criterion.status]
        name = Text(f"{mark(criterion.status, self.console.encoding)} {self._show(criterion.id)}", style)
        status = Text(criterion.status.value, style)
        points = points_of(criterion)
        room = self.console.width - max(name.cell_len, width + 2) - len(points) - len(status) - 6
        if room < WORDS_CELLS:
            head = Text.assemble(name, "  ", points, "  ", status)
            return Group(head, Padding(Text(self._show(words)), (0, 0, 0, 4)))
        grid = Table.grid(padding=(0, 2, 0, 0))
        grid.add_column(no_wrap=True, min_width=width + 2)
        grid.add_column(no_wrap=True, min_width=4)
        grid.add_column(no_wrap=True)
        grid.add_column(overflow="fold")
        grid.add_row(name, Text(points), status, Text(self._show(words)))
        return grid

    def _rows(self, rows: Iterable[tuple[str, str]]) -> Table:
        grid = Table.grid(padding=(0, 2, 0, 0))
        grid.add_column(style="dim", overflow="fold", max_width=self.console.width // 3)
        grid.add_column(overflow="fold")
        for name, value in rows:
            if value:
                grid.add_row(Text(self._show(name, NAME_LIMIT)), Text(self._show(value)))
        return grid

    def _table(self, criteria: Iterable[CriterionResult]) -> Table:
        table = Table(box=None, padding=(0, 2, 0, 0), show_edge=False, header_style="dim", pad_edge=False)
        table.add_column("points", justify="right", no_wrap=True)
        table.add_column("status", no_wrap=True)
        table.add_column("criterion", overflow="fold", max_width=self.console.width // 3)
        table.add_column("measured", overflow="fold", ratio=1)
        for c in criteria:
            points = Text(points_of(c))
            status = Text(f"{mark(c.status, self.console.encoding)} {c.status.value}", STYLES[c.status])
            measured = c.measured or (c.title if c.status is Status.PASS else c.message)
            table.add_row(points, status, Text(self._show(c.id)), Text(self._show(measured, MEASURED_LIMIT)))
        return table

    def _show(self, text: str, limit: int = LIMIT) -> str:
        """Harmless, of bounded length, and in characters that the terminal's encoding has."""
        return self._encoded(line(text, limit))

    def _encoded(self, text: str) -> str:
        return text.encode(self.console.encoding, "backslashreplace").decode(self.console.encoding)


def mark(status: Status, encoding: str) -> str:
    """The sign of a status, a plain one where the encoding has no ✓."""
    return (SIGNS if _has_marks(encoding) else PLAIN_MARKS)[status]


def _has_marks(encoding: str) -> bool:
    try:
        "".join(SIGNS.values()).encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
