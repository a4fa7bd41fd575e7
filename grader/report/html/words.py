"""The sentences of a student's report."""

from __future__ import annotations

from collections.abc import Iterator

from grader.errors import GraderError
from grader.judging.summary import passed
from grader.model.result import CriterionResult, GradingResult
from grader.model.verdict import Status
from grader.report.view import ReportView, not_graded
from grader.rubric.model import Rubric
from grader.wording import number, plural

SIGNS = {
    Status.PASS: "✓",
    Status.PARTIAL: "◐",
    Status.FAIL: "✗",
    Status.BLOCKED: "⊘",
    Status.INCONCLUSIVE: "?",
    Status.ERROR: "!",
    Status.MANUAL: "•",
}
MEANINGS = {
    Status.PASS: "reached",
    Status.PARTIAL: "partly reached",
    Status.FAIL: "not reached",
    Status.BLOCKED: "could not be judged because something before it was not reached",
    Status.INCONCLUSIVE: "could not be told this time; no points are lost for good",
    Status.ERROR: "the grader could not judge it; no points are lost for good",
    Status.MANUAL: "a person gives these points",
}
MENDED = frozenset({Status.FAIL, Status.PARTIAL})
ADVICE = {Status.FAIL: "How to mend it", Status.PARTIAL: "How to mend it", Status.PASS: "Hint"}
FAULTS = {
    "submission": "This is about what was handed in: mend it and hand it in again.",
    "machine": "This is the fault of the machine that graded, not yours. No points are lost for good: "
    "it only has to be graded again.",
    "grader": "This is the grader's own fault, not yours. No points are lost for good: "
    "your teacher can have it graded again.",
}


def blame(kind: str) -> str:
    """Whose fault an error of this kind is: `submission`, `machine` or `grader`."""
    return next((found.blame for found in _kinds(GraderError) if found.kind == kind), "grader")


def _kinds(error: type[GraderError]) -> Iterator[type[GraderError]]:
    yield error
    for below in error.__subclasses__():
        yield from _kinds(below)


def points(value: float) -> str:
    """`1 point`, `2.5 points`."""
    return plural(value, "point")


def verdict(result: GradingResult, rubric: Rubric, hidden: int) -> tuple[str, str]:
    """Whether it passed as a status of the page and in a few words."""
    if not_graded(result):
        return "error", "Not graded"
    if not hidden and passed(rubric, result):
        return "pass", "Passed"
    if result.status != "graded":
        return "inconclusive", "Not settled yet"
    if hidden:
        reached = all(c.status is Status.PASS for c in result.criteria if c.max_points > 0)
        return ("pass", "So far, so good") if reached else ("partial", "There is something to mend")
    return "fail", "Not passed yet"


def pass_mark(result: GradingResult, rubric: Rubric, hidden: int) -> str:
    """What it takes to pass."""
    if rubric.pass_mark is None:
        return f"To pass, every {'visible ' if hidden else ''}criterion that counts has to be reached."
    mark = f"To pass, it takes {points(rubric.pass_mark)} of {number(rubric.max_points)}"
    if not_graded(result):
        return f"{mark}."
    if hidden:
        return f"{mark}, those of criteria that run at grading included."
    missing = rubric.pass_mark - result.points
    return (
        f"{mark}: {points(missing)} {'is' if missing == 1 else 'are'} missing." if missing > 0 else f"{mark}."
    )


def in_short(result: GradingResult, view: ReportView) -> str:
    """What was lost, in one or two sentences."""
    lost = sum(loss.points for loss in view.lost)
    if not_graded(result):
        return "Nothing could be judged."
    late = result.late.points_before - result.late.points if result.late else 0.0
    if lost <= 0 and late <= 0 and not view.open:
        return "Nothing was lost: every criterion that counts is reached. Well done!"
    said = [] if late > 0 else ["Nothing was lost."]
    if lost > 0:
        costs = "costs" if len(view.lost) == 1 else "cost"
        said = [f"{plural(len(view.lost), 'thing')} {costs} you {points(lost)}."]
    if len(view.lost) > 1:
        said.append(f"The first one alone is worth {points(view.lost[0].points)}.")
    if late > 0:
        said.append(f"Being late costs you {points(late)}.")
    if view.open:
        still = sum(loss.points for loss in view.open)
        said.append(f"{points(still)} {'is' if still == 1 else 'are'} still open.")
    return " ".join(said)


def lost_words(criterion: CriterionResult, blocked: float) -> str:
    """`10 points lost, and 25 more in what it holds back`; points that are open are not lost."""
    own = criterion.max_points - criterion.points
    state = "still open" if criterion.status.is_open else "lost"
    said = f"{points(own)} {state}" if own else "costs nothing itself"
    return f"{said}, and {number(blocked)} more in what it holds back" if blocked else said
