"""Figures of evidence that is written as text, beside the verdicts on it."""

from __future__ import annotations

from typing import Any, TypeVar

from grader.evidence.run import Run
from grader.judging import judge
from grader.model.figure import CodeFigure, Figures
from grader.model.result import CriterionResult
from grader.report.figures import figures_of
from tests.support.rubrics import rubric
from tests.support.timeline import build_runs

Kind = TypeVar("Kind")
SCENARIO = "talker"


def criterion(check: str, **params: Any) -> dict[str, Any]:
    """A criterion named after its check, of the scenario `talker`."""
    return {"id": check, "check": check, "with": params, "scenario": SCENARIO}


def drawn(
    run: dict[str, Any] | Run, *criteria: dict[str, Any], package: dict[str, Any] | None = None, **keys: Any
) -> tuple[Figures, dict[str, CriterionResult]]:
    """Of one run; `package` are its package facts, `attachments` its files."""
    given = {"package": package or {}, "attachments": keys.get("attachments", {})}
    timeline = {} if isinstance(run, Run) else run
    runs = build_runs({"runs": {SCENARIO: timeline, "package": given}})
    if isinstance(run, Run):
        runs[SCENARIO] = run
    asked = rubric(*(criteria or ({"id": "only", "check": "manual"},)))
    results = judge(asked, runs)
    return figures_of(asked, runs, results), {result.id: result for result in results}


def only(figures: Figures, name: str, kind: type[Kind]) -> Kind:
    """The only figure of a criterion, but for lines of code that it cites."""
    (figure,) = [one for one in figures.by_criterion[name] if kind is CodeFigure or one.kind != "code"]
    assert isinstance(figure, kind)
    return figure
