"""The report in a terminal: what was reached on one line, then what was lost, then the points. Readable in a pipe."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import IO

from rich.cells import cell_len
from rich.console import Console, Group, RenderableType
from rich.text import Text

from grader.model.result import AppliedOverride, CriterionResult, GradingResult, Note
from grader.model.verdict import Status
from grader.report import sentences
from grader.report.losses import Loss, MissingFile, ReportView, arrange, missing_files, write_files_hint
from grader.report.text import line, without_ci_commands
from grader.report.view import (
    file_places,
    hint_beside,
    not_graded,
    pointed_at,
    points_of,
    see_words,
    without_place,
)
from grader.rubric.model import Rubric
from grader.wording import number, plural

LIMIT = 1000
TO_FIX, NOT_DECIDED = "To fix", "Not decided yet: no points are lost for good"
INDENT = 2
SOURCE_CHARS_MIN = 20
ADVICE_CHARS = 3000
PLAIN_LETTERS = str.maketrans({"…": "...", "→": "->", "±": "+/-", sentences.MINUS: "-", "\N{EN DASH}": "-"})
"""What stands for the grader's own signs where an encoding lacks them."""


def open_console(file: IO[str]) -> Console:
    """Return a console that takes no text for markup. Colour on a terminal only; 80 columns where there is none."""
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
            # `fold`, since a long path is to be copied whole
            console.print(part, overflow="fold", crop=False)
    text = without_ci_commands("\n".join(row.rstrip() for row in capture.get().split("\n")))
    console.file.write(text.encode(console.encoding, "backslashreplace").decode(console.encoding))


def render_terminal(result: GradingResult, rubric: Rubric, hidden: int = 0) -> str:
    """Return the report as it is printed where there is no terminal: without colour, 80 columns wide."""
    text = io.StringIO()
    Terminal(open_console(text)).report(result, rubric, hidden=hidden, full=True)
    return text.getvalue()


class Terminal:
    """Prints by the console's own means, in characters that its encoding has."""

    def __init__(self, console: Console) -> None:
        self.console = console

    def report(
        self,
        result: GradingResult,
        rubric: Rubric,
        *,
        hidden: int = 0,
        unrun: str = "",
        remarks: Sequence[RenderableType] = (),
        full: bool = False,
    ) -> None:
        """Print the whole report. `hidden` is how many criteria are left out, `remarks` stand before the losses.

        Where `unrun` says why nothing was run, open ones are only counted. With `full`, all criteria are listed with
        what was measured.
        """
        view = arrange(result, rubric)
        unwalled = sentences.without_sandbox(result.environment.sandbox)
        parts = [self._head(result, rubric)]
        warnings = filter(None, (unwalled, sentences.students_rubric(result)))
        parts += [self._words(words, indent=0, style="yellow") for words in warnings]
        parts += [
            self._words(words, indent=0)
            for words in (
                *sentences.gate_words(result),
                *sentences.late_words(result),
                *sentences.made_up_words(result),
            )
        ]
        parts += self._section(
            sentences.decided_title(result),
            [self._decision(o, c) for o, c in sentences.decided_criteria(result)],
        )
        parts += self._section(sentences.NOTICED_TITLE, self._note_lines(result.notes))
        parts += self._reached_lines(result, unrun, full=full)
        parts += self._section("Advice (costs nothing)", [self._advice(c) for c in view.advice])
        parts += [Text(f"\n{sentences.visible_words(result, hidden)}")] if hidden else []
        parts += remarks
        parts += self.still_open(view.open, unrun)
        parts += self.losses(TO_FIX, view.lost, sentences.judged_repaired(result))
        parts.append(self._score(result, view))
        emit(self.console, parts)

    def losses(
        self, title: str, losses: Sequence[Loss], repaired: Mapping[str, Sequence[str]] = MappingProxyType({})
    ) -> list[RenderableType]:
        """Return the losses under a title, what costs most last: there the reader's eye is when all is printed.

        `repaired` names what was judged with a criterion's fault repaired.
        """
        parts = [self._loss(loss, repaired.get(loss.criterion.id, ())) for loss in reversed(losses)]
        return self._section(title, [x for part in parts for x in (part, Text())][:-1])

    def _head(self, result: GradingResult, rubric: Rubric) -> RenderableType:
        text = Text(f"{self._show(result.submission.id)}\n", "bold")
        text.append(self._show(f"{result.rubric.id}: {rubric.title}"), "not bold dim")
        if result.rubric_origin in (None, "grader"):
            return text
        return text.append(f"\nRubric {self._show(sentences.rubric_words(result))}", "not bold dim")

    def _score(self, result: GradingResult, view: ReportView) -> RenderableType:
        """Return `95 of 100 points, 1 thing to fix`."""
        if not_graded(result):
            text = Text("\nNot graded", "bold")
            return text.append(f"\n{self._show(result.error.message)}", "not bold") if result.error else text
        points = sentences.points_line(result, view)
        things = f", {plural(len(view.lost), 'thing')} to fix" if view.lost else ""
        text = Text(f"\n{points}{things}", "bold")
        return text.append("".join(f"\n{words}" for words in sentences.gate_words(result)), "not bold")

    def _decision(self, override: AppliedOverride, criterion: CriterionResult) -> RenderableType:
        again = sentences.look_again(override, criterion)
        rows = [("check", sentences.automatic_words(override, criterion)), ("changed", again)]
        return Group(
            self._line(criterion, points_of(criterion)),
            self._words(sentences.decision(override)),
            *self._rows(rows),
        )

    def _section(self, title: str, parts: list[RenderableType]) -> list[RenderableType]:
        return [Text(f"\n{title}", "bold"), *parts] if parts else []

    def still_open(self, losses: tuple[Loss, ...], unrun: str) -> list[RenderableType]:
        """Return what is not decided yet: each, or in one line all that needs a run, where nothing was run."""
        if not unrun:
            return self.losses(NOT_DECIDED, losses)
        points = number(sum(loss.points for loss in losses))
        still = f"criteria worth {points} points are not decided yet" if losses else "all is decided"
        return [Text(f"\nNothing was run ({unrun}): {still}.")]

    def _loss(self, loss: Loss, repaired: Sequence[str]) -> RenderableType:
        """Return what was lost, as a compiler says it: the criterion and its place, the cause, the code, the fix."""
        c = loss.criterion
        place, *others = file_places(c) or [""]
        # beside the line's number, which takes up to twelve columns with its bar
        room = max(SOURCE_CHARS_MIN, self.console.width - INDENT - 12)
        code = [row for pair in pointed_at(c, room) for row in self._code(*pair)]
        alike = {a.id for a in loss.alike}
        files = missing_files(loss)
        several = len(files) > 1
        rows = [
            ("expected", "" if code or several else c.expected),
            ("fix", write_files_hint(files) if several else hint_beside(c, place)),
            ("also at", ", ".join(others)),
            ("see", "" if files else see_words(c.reproduce)),
            ("also costs", "" if several else ", ".join(f"{a.id} {self._cost(a)}" for a in loss.alike)),
            ("judged with this repaired", ", ".join(name for name in repaired if name not in alike)),
            ("not tested because of it", ", ".join(f"{b.id} {self._cost(b)}" for b in loss.blocked)),
        ]
        said = f"{len(files)} files are not in the package:" if several else without_place(c.message, place)
        lacking = [self._missing_file(file) for file in files] if several else []
        head = self._line(c, self._total(loss), "" if several else place)
        return Group(head, self._words(said or c.title), *lacking, *code, *self._rows(rows))

    def _missing_file(self, file: MissingFile) -> RenderableType:
        """Return `launch/a.launch (launch-xml 0/10): <launch> at its root, …`."""
        cost = f"{file.criterion.id} {self._cost(file.criterion)}"
        words = "; ".join(filter(None, [file.holds, file.says]))
        return self._words(f"{file.path} ({cost}): {words}", indent=2 * INDENT)

    def _cost(self, criterion: CriterionResult) -> str:
        """Return `-5`, or `0/5` where the points are not lost for good."""
        if criterion.status.is_open or not criterion.missing:  # a gate may be a criterion that is not counted
            return points_of(criterion)
        return self._fit_encoding(sentences.minus(criterion.missing))

    def _total(self, loss: Loss) -> str:
        """Return `-5`, or `-25 in all` where the mistake costs more than its own criterion's points."""
        cost = self._cost(loss.criterion)
        if loss.criterion.status.is_open or loss.points == loss.criterion.missing:
            return cost
        return f"{self._fit_encoding(sentences.minus(loss.points))} in all"

    def _advice(self, criterion: CriterionResult) -> RenderableType:
        words = self._words(criterion.message or criterion.title)
        # It may be of several files, and is nowhere else in a terminal.
        hint = [self._words(criterion.hint, ADVICE_CHARS, name="hint")] if criterion.hint else []
        return Group(self._line(criterion), words, *hint)

    def _note_lines(self, notes: tuple[Note, ...]) -> list[RenderableType]:
        said = [self._words(f"{sentences.note_place(note)}: {sentences.note_text(note)}") for note in notes]
        return [*said, Text(sentences.COSTS_NOTHING, "dim")] if notes else []

    def _reached_lines(self, result: GradingResult, unrun: str, *, full: bool) -> list[RenderableType]:
        """Return how many criteria are reached; with `full`, each of those that were judged with what was measured."""
        judged = [c for c in result.criteria if not unrun or not c.status.is_open]
        reached = [c for c in judged if c.status is Status.PASS]
        if full:
            title = "All criteria that could be judged" if unrun else "All criteria"
            return self._section(title, [self._measured_line(c) for c in judged])
        if not reached:
            return []
        others = "" if len(reached) == len(result.criteria) else "other "
        said = f"{plural(len(reached), f'{others}criterion', f'{others}criteria')} passed; --all shows them"
        sign = mark(Status.PASS, self.console.encoding)
        return [Text(f"\n{sign} {said}", sentences.STYLES[Status.PASS])]

    def _measured_line(self, criterion: CriterionResult) -> RenderableType:
        line = self._line(criterion, sentences.STATES[criterion.status], points_of(criterion))
        passed, measured = criterion.status is Status.PASS, criterion.measured
        if criterion.status is Status.BLOCKED:
            measured = ""  # what was there instead of what could be measured
        said = criterion.title if passed else criterion.message or criterion.title
        return Group(line, self._words(said), *self._rows([("measured", measured)]))

    def _line(self, criterion: CriterionResult, *more: str) -> RenderableType:
        """Return `✗ chatter-rate  -10  src/talker.py:17`; the last stands below where there is no room for it."""
        name = f"{mark(criterion.status, self.console.encoding)} {self._show(criterion.id)}"
        style, rest = sentences.STYLES[criterion.status], [self._show(one) for one in more if one]
        # some letters are two columns wide
        below = rest != [] and cell_len("  ".join([name, *rest])) > self.console.width
        beside = "".join(f"  {one}" for one in (rest[:-1] if below else rest))
        text = Text.assemble((name, style), (beside, "bold"), no_wrap=True, overflow="ignore")
        return text.append(f"\n{' ' * INDENT}{rest[-1]}", "bold") if below else text

    def _words(
        self, text: str, limit: int = LIMIT, *, name: str = "", indent: int = INDENT, style: str = ""
    ) -> RenderableType:
        """Return wrapped text in which no word is split, behind `name: `: it can be copied, and read aloud."""
        label = f"{name}: " if name else ""
        rows = wrap(label + self._show(text, limit), self.console.width - indent)
        blank = " " * indent
        shown = Text("\n".join(blank + row for row in rows), style, no_wrap=True, overflow="ignore")
        shown.stylize("dim", indent, indent + len(label))
        return shown

    def _code(self, text: str, carets: str) -> list[RenderableType]:
        """Return a line of code and the carets below it, which three dots in place of an ellipsis move."""
        if self._fit_encoding("…") != "…":
            carets = carets.replace(" | ", " |   ", 1) if " | …" in text else carets
            text = text.replace("…", "...")
        rows = (" " * (INDENT + 2) + self._fit_encoding(row) for row in (text, carets))
        return [Text(row, no_wrap=True, overflow="ignore") for row in rows]

    def _rows(self, rows: Iterable[tuple[str, str]]) -> list[RenderableType]:
        """Return `fix: …` for each row that says something: read aloud, a name belongs to its value."""
        return [self._words(value, name=name) for name, value in rows if value]

    def _show(self, text: str, limit: int = LIMIT) -> str:
        """Return text that is harmless, of bounded length, and in characters that the terminal's encoding has."""
        return self._fit_encoding(line(text, limit))

    def _fit_encoding(self, text: str) -> str:
        return fit_encoding(text, self.console.encoding)


def wrap(text: str, width: int) -> list[str]:
    """Return the text in lines of so many columns; a longer word stays whole, on a line of its own."""
    rows = [""]
    for word in text.split(" "):
        row = f"{rows[-1]} {word}" if rows[-1] else word
        if rows[-1] and cell_len(row) > width:
            rows.append(word)
        else:
            rows[-1] = row
    return rows


def fit_encoding(text: str, encoding: str) -> str:
    """Return the text in characters that the encoding has."""
    if not _can_encode(text, encoding):
        text = text.translate(PLAIN_LETTERS)
    return text.encode(encoding, "backslashreplace").decode(encoding)


def mark(status: Status, encoding: str) -> str:
    """Return the sign of a status, a plain one where the encoding has no ✓."""
    look = sentences.LOOKS[status]
    # all of them or none, so that signs of one kind stand together
    return look.sign if _can_encode("".join(sentences.SIGNS.values()), encoding) else look.plain


def _can_encode(text: str, encoding: str) -> bool:
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
