"""`report.md`: points first, then what was lost, then everything."""

from __future__ import annotations

from collections.abc import Iterator

from grader.model.result import CriterionResult, GradingResult, Note
from grader.report import noticed
from grader.report.settled import TITLE, automatic_words, decided, decision, late_words, look_again
from grader.report.text import line, markdown, markdown_code, number, text_limit
from grader.report.view import Loss, arrange, not_graded, places, points_of
from grader.rubric.model import Rubric

LIMIT = 1000


def markdown_report(result: GradingResult, rubric: Rubric, *, hidden: int = 0) -> str:
    """The report as GitHub-flavoured Markdown. `hidden` is how many criteria are left out of it."""
    return _Writer(text_limit(len(result.criteria), LIMIT)).report(result, rubric, hidden)


class _Writer:
    """`limit` is how long a text may be. Whatever is not the template's own goes through `_text` or `_code`."""

    def __init__(self, limit: int) -> None:
        self._limit = limit

    def report(self, result: GradingResult, rubric: Rubric, hidden: int) -> str:
        view = arrange(result, rubric)
        lines = [*self._head(result, rubric, hidden)]
        lines += self._decided(result)
        if not not_graded(result):
            lines += self._losses("What was lost", view.lost)
            lines += self._losses("What is still open", view.open)
        lines += self._advice(view.advice)
        lines += self._noticed(result.notes)
        lines += self._table(result.criteria)
        lines += self._foot(result)
        return "\n".join(lines) + "\n"

    def _head(self, result: GradingResult, rubric: Rubric, hidden: int) -> Iterator[str]:
        submission = result.submission
        graded = f"{number(result.points)} of {number(result.max_points)} points"
        yield f"# {'Not graded' if not_graded(result) else graded}"
        yield ""
        for words in late_words(result):
            yield from (self._text(words), "")
        if result.error is not None:
            yield from ([] if not_graded(result) else ["It could not be graded automatically:", ""])
            yield from (self._text(result.error.message), "", self._text(result.error.hint), "")
        version = self._text(result.rubric.version)
        yield f"{self._text(rubric.title)} ({self._code(result.rubric.id)}, version {version})"
        yield ""
        commit = f", commit {self._code(submission.commit[:12])}" if submission.commit else ""
        kind = f", package {self._code(submission.package)}" if submission.package else ", a recording"
        yield f"Submission {self._code(submission.id)}{kind if result.error is None else ''}{commit}."
        yield ""
        if result.status == "inconclusive":
            yield "**Not settled yet:** some criteria could not be judged; no points are lost for good."
            yield ""
        if hidden:
            yield f"{hidden} hidden {'criterion is' if hidden == 1 else 'criteria are'} not part of this report."
            yield ""

    def _decided(self, result: GradingResult) -> Iterator[str]:
        found = decided(result)
        if not found:
            return
        yield f"## {TITLE}"
        yield ""
        for override, criterion in found:
            yield f"- {self._code(criterion.id)}: {points_of(criterion)} {self._text(decision(override))}"
            yield f"  - The check says: {self._text(automatic_words(override, criterion))}"
            again = look_again(override, criterion)
            yield from [f"  - **{self._text(again)}**"] if again else []
        yield ""

    def _losses(self, title: str, losses: tuple[Loss, ...]) -> Iterator[str]:
        if not losses:
            return
        yield f"## {title}"
        yield ""
        for loss in losses:
            criterion = loss.criterion
            yield f"### {self._code(criterion.id)}: {points_of(criterion)}, {criterion.status.value}"
            yield ""
            yield self._text(criterion.message) or self._text(criterion.title)
            yield ""
            details = [*self._details(criterion), *self._blocked(loss)]
            yield from ([*details, ""] if details else [])

    def _details(self, criterion: CriterionResult) -> Iterator[str]:
        rows = {"Measured": criterion.measured, "Expected": criterion.expected, "Hint": criterion.hint}
        yield from (f"- {name}: {self._text(value)}" for name, value in rows.items() if value)
        if criterion.reproduce:
            yield f"- See it yourself: {self._code(criterion.reproduce)}"
        if criterion.citations:
            yield f"- Where: {', '.join(self._code(cited) for cited in places(criterion))}"

    def _blocked(self, loss: Loss) -> Iterator[str]:
        if loss.alike:
            yield f"- The same holds for: {self._names(loss.alike)}"
        if loss.blocked:
            yield f"- Could not be judged because of this: {self._names(loss.blocked)}"

    def _names(self, criteria: tuple[CriterionResult, ...]) -> str:
        return ", ".join(f"{self._code(c.id)} ({points_of(c)})" for c in criteria)

    def _advice(self, criteria: tuple[CriterionResult, ...]) -> Iterator[str]:
        if not criteria:
            return
        yield "## Advice, costs nothing"
        yield ""
        for criterion in criteria:
            hint = f" {self._text(criterion.hint)}" if criterion.hint else ""
            yield f"- {self._code(criterion.id)}: {self._text(criterion.message)}{hint}"
        yield ""

    def _noticed(self, notes: tuple[Note, ...]) -> Iterator[str]:
        if not notes:
            return
        yield f"## {noticed.TITLE}"
        yield ""
        yield noticed.COSTS_NOTHING
        yield ""
        for note in notes:
            yield f"- {self._code(noticed.place(note))}: {self._text(noticed.words(note))}"
        yield ""

    def _table(self, criteria: tuple[CriterionResult, ...]) -> Iterator[str]:
        yield "## All criteria"
        yield ""
        yield "| points | status | criterion | | measured |"
        yield "|---:|---|---|---|---|"
        for c in criteria:
            cells = [
                points_of(c),
                c.status.value,
                self._code(c.id, cell=True),
                self._text(c.title, cell=True),
                self._text(c.measured, cell=True),
            ]
            yield f"| {' | '.join(cells)} |"
        yield ""

    def _foot(self, result: GradingResult) -> Iterator[str]:
        used = result.environment
        kind = "package" if result.submission.package else "recording"
        yield (
            f"Graded by grader {self._text(used.grader)} with ROS {self._text(used.ros or 'not used')}, "
            f"Python {self._text(used.python)}, sandbox {self._text(used.sandbox)}, "
            f"in {result.timing.wall_s:.1f} s. Rubric digest {self._code(result.rubric.digest[:12])}, "
            f"{kind} digest {self._code(result.submission.digest[:12])}."
        )

    def _text(self, text: str, *, cell: bool = False) -> str:
        return markdown(line(text, self._limit), cell=cell)

    def _code(self, text: str, *, cell: bool = False) -> str:
        return markdown_code(line(text, self._limit), cell=cell)
