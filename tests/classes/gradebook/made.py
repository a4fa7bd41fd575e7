"""Books and rows made in a test."""

from __future__ import annotations

from grader.classes.gradebook import Book, GradebookRow
from grader.model.batch import Entry
from grader.model.result import AppliedOverride, Automatic, CriterionResult, Lateness
from grader.model.verdict import Status
from tests.support.a_class import criterion as made_criterion
from tests.support.a_class import made_result

BOOK = Book(
    title="Lab 1",
    rubric_id="lab1",
    max_points=100,
    criteria=(("rate", "Right rate", 60), ("name", "Right name", 40), ("advice", "Advice", 0)),
    columns=("Seat", "SIS User ID", "Email"),
)
MAXIMA = {"rate": 60.0, "name": 40.0, "advice": 0.0}


def criterion(criterion_id: str, points: float, status: Status = Status.PARTIAL) -> CriterionResult:
    return made_criterion(criterion_id, status, points, MAXIMA[criterion_id])


def row(
    who: str, points: float = 87.5, *, name: str = "", open_: str = "", error: str = "", **extra: str
) -> GradebookRow:
    """`open_` is a criterion that a person has to look at. `extra` are the roster's further columns."""
    criteria = [criterion("rate", points - 40), criterion("name", 40.0), criterion("advice", 0.0)]
    if open_:
        criteria = [c if c.id != open_ else criterion(open_, 0, Status.INCONCLUSIVE) for c in criteria]
    result = made_result(
        who,
        () if error else tuple(criteria),
        status="error" if error else "inconclusive" if open_ else "graded",
        points=0 if error else points,
        max_points=100,
        error=error,
    )
    columns = {column.replace("_", " "): text for column, text in extra.items()}
    return GradebookRow(entry=Entry(id=who, source="s", name=name, extra=columns), result=result)


def late(one: GradebookRow, before: float) -> GradebookRow:
    """The same, handed in a day late."""
    lateness = Lateness(
        late_s=86400, points_before=before, points=one.result.points, text="1 day late: 10 taken"
    )
    return one.model_copy(update={"result": one.result.model_copy(update={"late": lateness})})


def overridden(one: GradebookRow) -> GradebookRow:
    """The same, with a person's points."""
    said = Automatic(status=Status.FAIL, points=0, message="")
    override = AppliedOverride(
        criterion="rate", points=50, comment="=ran by hand", author="kim", automatic=said, was=said
    )
    return one.model_copy(update={"result": one.result.model_copy(update={"overrides": (override,)})})
