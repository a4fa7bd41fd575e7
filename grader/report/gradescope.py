"""Gradescope's `results.json`: a test for each criterion.

Gradescope knows no test that could not be judged. Such a one has no score here, and its name and the page's first line
say that a person must look. Where the machine or the grader is at fault that nothing was graded there is no file:
Gradescope then says that the autograder has failed, gives no points, and the staff can run it again. Where what was
handed in cannot be graded, the student reads why at once, and that this 0 is not graded.
"""

from __future__ import annotations

from collections.abc import Iterator

from grader.errors import GraderError
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.sentences import (
    STATES,
    decided_criteria,
    decision,
    look_again,
    missing_hidden,
    score_words,
    visible_words,
)
from grader.report.student_view import hidden_ids
from grader.report.text import json_text, line, text_limit
from grader.report.view import is_students_fault, places, points_of
from grader.rubric.model import Rubric
from grader.wording import number

LIMIT = 1000
HIDDEN = "after_published"
"""Hidden criteria are seen when the grades are published; until then Gradescope shows no total."""
LOOK = "A PERSON MUST LOOK"


def render_gradescope(result: GradingResult, rubric: Rubric) -> str:
    """JSON. Raises GraderError (exit code 3) where nothing could be judged: there must be no file then."""
    counting = [c for c in result.criteria if c.counts]
    if all(c.status.is_open for c in counting) and not is_students_fault(result):
        why = result.error.message if result.error else "no criterion could be judged"
        raise GraderError(
            f"no results.json is written, for nothing was graded: {why}",
            hint="Gradescope then says that the autograder has failed and gives no points: run it again there",
        )
    return json_text(_Writer(result, rubric).document())


class _Writer:
    def __init__(self, result: GradingResult, rubric: Rubric) -> None:
        self._result, self._rubric = result, rubric
        self._hidden = hidden_ids(rubric)
        self._limit = text_limit(len(result.criteria), LIMIT)
        self._decided = {c.id: override for override, c in decided_criteria(result)}

    def document(self) -> dict[str, object]:
        """Formats are said everywhere: Gradescope's own for the page would read HTML."""
        result = self._result
        return {
            "score": result.points,
            "execution_time": round(result.timing.wall_s, 3),
            "output": "\n".join(self._page()),
            "output_format": "text",
            "test_output_format": "text",
            "test_name_format": "text",
            "visibility": "visible",
            "stdout_visibility": "hidden",
            "tests": [self._test(str(i), c) for i, c in enumerate(result.criteria, start=1)],
        }

    def _page(self) -> Iterator[str]:
        """What everybody sees at once: nothing in it tells of hidden criteria more than their number."""
        result = self._result
        shown = [c for c in result.criteria if c.id not in self._hidden]
        if result.error is not None and result.status == "error":
            yield f"NOT GRADED, {LOOK}: {self._text(result.error.message)}"
            yield self._text(result.error.hint)
            return
        waiting = [c for c in shown if c.status.is_open and c.counts]
        if any(c.status.is_open and c.counts for c in result.criteria):
            points = number(sum(c.missing for c in waiting))
            what = f": {points} points are not decided yet" if waiting else ""
            yield f"{LOOK}{what}; no points are lost for good."
        hidden = len(result.criteria) - len(shown) + missing_hidden(result, self._rubric)
        if hidden:
            yield self._text(visible_words(result.model_copy(update={"criteria": tuple(shown)}), hidden))
        else:
            yield f"{number(result.points)} of {number(result.max_points)} points"
            yield from map(self._text, score_words(result))

    def _test(self, place: str, criterion: CriterionResult) -> dict[str, object]:
        waits = criterion.status.is_open
        name = f"{criterion.id}: {criterion.title}"
        return {
            **({} if waits else {"score": criterion.points, "max_score": criterion.max_points}),
            "status": "passed" if criterion.status is Status.PASS else "failed",
            "name": self._text(f"{LOOK}: {name} ({number(criterion.missing)} points)" if waits else name),
            "name_format": "text",
            "number": place,
            "output": "\n".join(self._details(criterion)),
            "output_format": "text",
            "tags": [criterion.status.value],
            "visibility": HIDDEN if criterion.id in self._hidden else "visible",
        }

    def _details(self, criterion: CriterionResult) -> Iterator[str]:
        yield f"{STATES[criterion.status]}, {points_of(criterion)} points"
        override = self._decided.get(criterion.id)
        rows = {
            "": criterion.message,
            "decided ": decision(override) if override else "",
            "look again: ": look_again(override, criterion) if override else "",
            "measured: ": criterion.measured,
            "expected: ": criterion.expected,
            "hint: ": criterion.hint,
            "see it yourself: ": criterion.reproduce,
            "where: ": ", ".join(places(criterion)),
        }
        yield from (f"{name}{self._text(words)}" for name, words in rows.items() if words)

    def _text(self, text: str) -> str:
        return line(text, self._limit)
