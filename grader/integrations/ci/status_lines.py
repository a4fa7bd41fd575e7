"""What a CI system says of a result, in a line, and what to do about it in another."""

from __future__ import annotations

from grader.errors import PackageNotFound, SubmissionError
from grader.integrations.ci.outcome import Outcome
from grader.integrations.ci.pass_mark import needed_words
from grader.model.result import GradingResult
from grader.report.view import arrange
from grader.rubric.model import Rubric
from grader.wording import number

STUDENTS = {SubmissionError.kind, PackageNotFound.kind}
NO_MARK_LOST = "this is not the submission's fault, and no mark is lost"


def said_of(counted: GradingResult, rubric: Rubric, outcome: Outcome, *, static: bool) -> tuple[str, str]:
    """The line, and a hint where there is one. What is behind an outcome that is nobody's fault is named."""
    if outcome is Outcome.NOT_GRADED:
        return _not_graded(counted)
    files = " that the files alone decide (nothing was run)" if static else ""
    told = f"{number(counted.points)} of {number(counted.max_points)} points{files}"
    if outcome is not Outcome.INCONCLUSIVE:
        return f"{told}; {needed_words(rubric, counted.max_points)}", ""
    waiting = arrange(counted, rubric).open
    if not waiting:
        return f"{told}, and something could not be judged; no mark is lost", ""
    points = number(sum(loss.points for loss in waiting))
    first = waiting[0].criterion
    return f"{told}; {points} more are not settled, and no mark is lost: {first.message}", first.hint


def _not_graded(result: GradingResult) -> tuple[str, str]:
    if result.error is None:
        return (
            f"a check of the grader failed; {NO_MARK_LOST}",
            "report it; the submission can be graded again",
        )
    own = result.error.kind in STUDENTS
    return result.error.message if own else f"{result.error.message}; {NO_MARK_LOST}", result.error.hint
