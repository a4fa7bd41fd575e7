"""What plots show: numbers and texts from the evidence, measured with the checks' own functions.

Pure: runs and verdicts come in, records of bounded size go out, and nothing that is wrong with the evidence raises.
Whatever cannot be shown is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import signature
from itertools import islice
from typing import ParamSpec, TypeVar

from grader.checks import CHECKS
from grader.evidence.events import PACKAGE_RUN
from grader.evidence.run import Run
from grader.judging.facts import Facts, try_facts
from grader.judging.repeats_and_repairs import split_runs
from grader.model.figure import Figure, Figures, RateFigure
from grader.model.result import CriterionResult
from grader.model.verdict import Verdict
from grader.report.figures.measurements import (
    end_figures,
    heard_figures,
    path_figures,
    rate_figures,
    region_figures,
    start_figures,
    step_figures,
    wrap_figures,
)
from grader.report.figures.runs import code_figures, console_of, graph_of, timeline_of, with_faults
from grader.rubric.made_up import with_recorded_values
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
    "ends-at": end_figures,
    "stays-within": region_figures,
}
"""By check, what takes its figures from the facts of the same names."""


def figures_of(rubric: Rubric, runs: Mapping[str, Run], criteria: Sequence[CriterionResult]) -> Figures:
    """Return the figures of these criteria, and of the rubric's scenarios; none of hidden criteria that are left out.

    `runs` are the recorded runs by scenario, and `package`, as the judge takes them. A criterion without any figure, a
    scenario without nodes and one in which nothing was printed are not in it.
    """
    rubric = with_recorded_values(rubric, runs)
    split = split_runs(runs)  # the runs of a repaired copy stand in the place of the first ones
    found = (split.first, {**split.first, **split.repaired})
    facts, on_copy = (_try_make(try_facts, rubric, one) for one in found)
    known = facts.runs if facts else runs
    shown = {
        name: run for name, run in islice(known.items(), RUNS_MAX) if name in {*rubric.scenarios, PACKAGE_RUN}
    }
    return Figures(
        by_criterion=_by_criterion(rubric, facts, on_copy or facts, criteria) if facts else {},
        timelines=_each(timeline_of, {name: run for name, run in shown.items() if name != PACKAGE_RUN}),
        graphs=_each(graph_of, {name: run for name, run in shown.items() if name != PACKAGE_RUN}),
        consoles=_each(console_of, shown),
    )


def _by_criterion(
    rubric: Rubric, first: Facts, on_copy: Facts, criteria: Sequence[CriterionResult]
) -> dict[str, tuple[Figure, ...]]:
    asked = {criterion.id: criterion for criterion in rubric.criteria}
    judged_by = {c.id: on_copy if c.repaired and not c.repaired.charged else first for c in criteria}
    found = {}
    for result in (c for c in criteria if c.id in asked):
        facts, criterion = judged_by[result.id], asked[result.id]
        shown = _figures_of_check(facts, criterion, result) or _graph(facts, criterion, result)
        found[result.id] = (*shown, *_cited_code(facts, result))
    return {name: figures for name, figures in found.items() if figures}


def _figures_of_check(facts: Facts, criterion: Criterion, result: CriterionResult) -> tuple[Figure, ...]:
    """Return what shows the check's measurement; nothing if the check itself was given no run to judge. If it is lost
    all the same, how late the machine was has decided nothing."""
    found = _try_make(_from_facts, facts, criterion) or ()
    if not result.status.is_lost:
        return found
    return tuple(one.model_copy(update={"late": ()}) if isinstance(one, RateFigure) else one for one in found)


def _from_facts(facts: Facts, criterion: Criterion) -> tuple[Figure, ...]:
    draw = DRAWN.get(criterion.check)
    if draw is None:
        return ()
    check = CHECKS[criterion.check]
    given = facts.of(check, criterion, check.params.model_validate(criterion.parameters))
    if isinstance(given, Verdict):
        return ()
    return tuple(islice(draw(**{name: given[name] for name in signature(draw).parameters}), FIGURES_MAX))


def _graph(facts: Facts, criterion: Criterion, result: CriterionResult) -> tuple[Figure, ...]:
    """Return for what was lost in a run, and has no measurement to draw, who was joined with whom, and what is wrong
    with that, if anything is."""
    run = facts.runs.get(criterion.scenario or "")
    graph = _try_make(graph_of, run) if run and result.status.is_lost else None
    if graph is None:
        return ()
    params = CHECKS[criterion.check].params.model_validate(criterion.parameters)
    marked = _try_make(with_faults, graph, criterion.check, params)
    return (marked,) if marked and marked.wrong else ()


def _cited_code(facts: Facts, result: CriterionResult) -> tuple[Figure, ...]:
    build = facts.runs.get(PACKAGE_RUN)
    found = _try_make(lambda: tuple(code_figures(build, result.citations))) if build else None
    return found or ()


def _each(make: Callable[[Run], Made | None], runs: Mapping[str, Run]) -> dict[str, Made]:
    found = ((name, _try_make(make, run)) for name, run in runs.items())
    return {name: figure for name, figure in found if figure is not None}


def _try_make(make: Callable[Asked, Made], *args: Asked.args, **kwargs: Asked.kwargs) -> Made | None:
    """Return what is made; None for what cannot be made: a report without a picture is better than none."""
    try:
        return make(*args, **kwargs)
    except Exception:  # noqa: BLE001 - evidence holds anything, and no verdict hangs on a picture
        return None
