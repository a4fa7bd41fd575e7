"""Sentences that several reports say of a result."""

from __future__ import annotations

from grader.judging.summary import passed
from grader.model.result import GradingResult
from grader.model.verdict import Status
from grader.report.hidden import hidden_ids
from grader.report.view import not_graded
from grader.rubric.model import Rubric

NOT_SETTLED = "some criteria could not be judged; no points are lost for good."


def missing_hidden(result: GradingResult, rubric: Rubric) -> int:
    """How many of the rubric's hidden criteria are not in the result: it is the student's view of it."""
    return len(hidden_ids(rubric) - {c.id for c in result.criteria})


def visible_words(result: GradingResult, hidden: int) -> str:
    """`12 visible checks passed; 5 more run at grading.`; empty where nothing is `hidden`."""
    if not hidden:
        return ""
    good, many = sum(c.status is Status.PASS for c in result.criteria), len(result.criteria)
    seen = f"{many} visible {'check' if many == 1 else 'checks'}"
    said = f"{seen} passed" if good == many else f"{good} of {seen} passed"
    return f"{said}; {hidden} more {'runs' if hidden == 1 else 'run'} at grading."


def verdict_words(result: GradingResult, rubric: Rubric, hidden: int) -> str:
    """`Passed.` or `Not passed yet.`; empty where that is not known: something is open, or `hidden`."""
    if hidden or not_graded(result) or result.status != "graded":
        return ""
    return "Passed." if passed(rubric, result) else "Not passed yet."
