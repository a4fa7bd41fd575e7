"""Results that were never graded: the records of a class, with every field that a test does not name left empty."""

from __future__ import annotations

from grader import __version__
from grader.judging.summary import overall_status, total_points
from grader.model.result import (
    CriterionResult,
    EnvironmentInfo,
    ErrorInfo,
    GradingResult,
    RubricInfo,
    SubmissionInfo,
    TimingInfo,
)
from grader.model.verdict import Status
from grader.rubric.load import LoadedRubric


def criterion(
    name: str, status: Status, points: float, max_points: float, **fields: object
) -> CriterionResult:
    """A criterion's result with nothing in it but what is given."""
    data: dict[str, object] = {
        "id": name,
        "title": f"title of {name}",
        "check": "some-check",
        "scenario": None,
        "status": status,
        "points": points,
        "max_points": max_points,
        "message": "",
        "expected": "",
        "measured": "",
        "hint": "",
        "reproduce": "",
        "citations": (),
    }
    return CriterionResult.model_validate({**data, **fields})


def made_result(
    name: str,
    criteria: tuple[CriterionResult, ...] = (),
    *,
    source: str = "s",
    commit: str | None = None,
    wall_s: float = 0.0,
    error: str = "",
    error_kind: str = "submission",
    **fields: object,
) -> GradingResult:
    """The result of a submission with these criteria: `graded`, unless `fields` or an `error` say otherwise."""
    data: dict[str, object] = {
        "submission": SubmissionInfo(id=name, source=source, commit=commit, digest="d", package="lab1"),
        "rubric": RubricInfo(id="lab1", version="1", digest="d"),
        "status": "error" if error else "graded",
        "points": sum(criterion.points for criterion in criteria),
        "max_points": sum(criterion.max_points for criterion in criteria),
        "criteria": criteria,
        "environment": EnvironmentInfo(grader=__version__, ros="noetic", python="3.11", sandbox="bwrap"),
        "timing": TimingInfo(wall_s=wall_s, cpu_s=wall_s / 8, student_cpu_s=wall_s / 4),
        "error": ErrorInfo(kind=error_kind, message=error, hint="submit it again") if error else None,
    }
    return GradingResult.model_validate({**data, **fields})


def judged_result(
    name: str, rubric: LoadedRubric, criteria: tuple[CriterionResult, ...], **fields: object
) -> GradingResult:
    """The same of a rubric, with the status and the points that these criteria come to."""
    data: dict[str, object] = {
        "source": f"/gone/{name}",
        "rubric": RubricInfo(id=rubric.rubric.id, version=rubric.rubric.version, digest=rubric.digest),
        "status": "error" if fields.get("error") else overall_status(criteria),
        "points": total_points(rubric.rubric, criteria),
        "max_points": rubric.rubric.max_points,
    }
    return made_result(name, criteria, **{**data, **fields})  # type: ignore[arg-type] - names as they are
