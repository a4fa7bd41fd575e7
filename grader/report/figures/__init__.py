"""Pictures of what was measured: numbers and texts out of the evidence, by the measure of the checks themselves.

Pure: runs and verdicts come in, records of bounded size go out, and nothing that is wrong with the evidence raises.
Whatever cannot be shown is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import signature
from itertools import islice
from typing import ParamSpec, TypeVar

from grader.checks import CHECKS
from grader.evidence.run import Run
from grader.judging.facts import PACKAGE_RUN, Facts, try_facts
from grader.model.figure import Figure, Figures
from grader.model.result import CriterionResult
from grader.model.verdict import Verdict
from grader.report.figures.measurements import (
    heard_figures,
    path_figures,
    rate_figures,
    start_figures,
    step_figures,
    wrap_figures,
)
from grader.report.figures.runs import code_figures, console_of, graph_of
from grader.rubric.model import Criterion, Rubric

FIGURES_MAX = 4
RUNS_MAX = 40

Made = TypeVar("Made")
Asked = ParamSpec("Asked")
DRAWN: Mapping[str, Callable[..., Iterable[Figure]]] = {
    "rate": rate_figures,
    "counter-start": start_figures,
    "counter-step": step_figures,
    "counter-wrap": wrap_figures,
    "hears": heard_figures,
    "path": path_figures,
}
"""By check, what takes its figures from the facts of the same names."""


def figures_of(rubric: Rubric, runs: Mapping[str, Run], criteria: Sequence[CriterionResult]) -> Figures:
    """Of these criteria, and of the rubric's scenarios; without hidden criteria, none are made for those.

    `runs` are the recorded runs by scenario, and `package`, as the judge takes them. A criterion without any figure, a
    scenario without nodes and one in which nothing was printed are not in it.
    """
    facts = _made(try_facts, rubric, runs)
    known = facts.runs if facts else runs
    shown = {
        name: run for name, run in islice(known.items(), RUNS_MAX) if name in {*rubric.scenarios, PACKAGE_RUN}
    }
    return Figures(
        by_criterion=_by_criterion(rubric, facts, criteria) if facts else {},
        graphs=_each(graph_of, {name: run for name, run in shown.items() if name != PACKAGE_RUN}),
        consoles=_each(console_of, shown),
    )


def _by_criterion(
    rubric: Rubric, facts: Facts, criteria: Iterable[CriterionResult]
) -> dict[str, tuple[Figure, ...]]:
    asked = {criterion.id: criterion for criterion in rubric.criteria}
    found = {
        result.id: (*_drawn(facts, asked[result.id]), *_cited(facts, result))
        for result in criteria
        if result.id in asked
    }
    return {name: figures for name, figures in found.items() if figures}


def _drawn(facts: Facts, criterion: Criterion) -> tuple[Figure, ...]:
    """What shows the check's measurement; nothing where the check itself was given no run to judge."""
    return _made(_from_facts, facts, criterion) or ()


def _from_facts(facts: Facts, criterion: Criterion) -> tuple[Figure, ...]:
    draw = DRAWN.get(criterion.check)
    if draw is None:
        return ()
    check = CHECKS[criterion.check]
    given = facts.of(check, criterion, check.params.model_validate(criterion.parameters))
    if isinstance(given, Verdict):
        return ()
    return tuple(islice(draw(**{name: given[name] for name in signature(draw).parameters}), FIGURES_MAX))


def _cited(facts: Facts, result: CriterionResult) -> tuple[Figure, ...]:
    build = facts.runs.get(PACKAGE_RUN)
    found = _made(lambda: tuple(code_figures(build, result.citations))) if build else None
    return found or ()


def _each(make: Callable[[Run], Made | None], runs: Mapping[str, Run]) -> dict[str, Made]:
    found = ((name, _made(make, run)) for name, run in runs.items())
    return {name: figure for name, figure in found if figure is not None}


def _made(make: Callable[Asked, Made], *args: Asked.args, **kwargs: Asked.kwargs) -> Made | None:
    """None for what cannot be made: a report without a picture is better than none."""
    try:
        return make(*args, **kwargs)
    except Exception:  # noqa: BLE001 - evidence holds anything, and no verdict hangs on a picture
        return None
