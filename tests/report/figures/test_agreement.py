"""Figures and verdicts never differ: on every timeline of a check that has figures."""

from __future__ import annotations

import re
from typing import Any

import pytest

from grader.evidence.run import Run
from grader.judging import judge
from grader.model.figure import CounterFigure, Figure, HeardFigure, PathFigure, RateFigure
from grader.model.result import CriterionResult
from grader.model.verdict import EvidenceCitation, Status
from grader.report.figures import DRAWN, figures_of
from tests.checks.examples import Example, examples_of, runs_of
from tests.report.figures.made import criterion
from tests.support.rubrics import SCENARIO, rubric

NOTHING = re.compile(r"no message|no number|not started|ended|no subscription|subscribed to|no path|nothing")


def _examples(check: str) -> list[Any]:
    """The timelines of a check; every third of them in `make test`, which judges all of them elsewhere."""
    return [
        pytest.param(e, id=e.id, marks=[pytest.mark.full] if number % 3 else [])
        for number, e in enumerate(examples_of(check))
    ]


def _drawn(example: Example) -> tuple[tuple[Figure, ...], CriterionResult, Run]:
    runs = runs_of(example.data)
    asked = rubric(
        {**criterion(example.check, **example.data.get("with", {})), "scenario": "run"},
        scenarios={"run": {**SCENARIO, "start": [], "recording": "*.bag"}},
    )
    (result,) = judge(asked, runs)
    figures = figures_of(asked, runs, [result])
    return figures.by_criterion.get(example.check, ()), result, runs["run"]


@pytest.mark.full
@pytest.mark.parametrize("example", _examples("rate"))
def test_rates(example: Example) -> None:
    figures, result, run = _drawn(example)
    together = [f for f in figures if isinstance(f, RateFigure)]
    measured = re.match(r"([\d.]+)(?: ± [\d.]+)?(?: Hz) over .*: (\d+) messages?,", result.measured)
    in_stretches = "cause" in example.data.get(
        "with", {}
    )  # one of them may be silent, and the others are drawn
    assert bool(together) == bool(measured) or in_stretches, result.measured
    if not measured:
        return
    judged = [
        f for f in together if f.messages == int(measured[2]) and f"{f.mean_hz:.2f}".startswith(measured[1])
    ]
    figure = judged[0] if in_stretches else together[0]
    assert figure in judged
    assert f"longest {max(figure.gaps_s):.3f} s" in result.measured or max(figure.gaps_s) < 0.01
    if result.status is Status.PASS:
        assert figure.low_hz - 1e-3 <= (figure.mean_hz or 0) <= figure.high_hz + 1e-3
    if "late itself" in result.message:
        assert figure.late
    assert all(0 <= a < b <= (run.end_ns - run.start_ns) / 1e9 for a, b in figure.late)


@pytest.mark.parametrize("example", [e for c in DRAWN if c.startswith("counter") for e in _examples(c)])
def test_counters(example: Example) -> None:
    figures, result, run = _drawn(example)
    if NOTHING.fullmatch(result.measured):
        assert not any(isinstance(f, CounterFigure) for f in figures)
        return
    (figure,) = (f for f in figures if isinstance(f, CounterFigure))
    if result.status is Status.PASS:
        assert figure.wrong == ()
    if example.check == "counter-start":
        assert bool(figure.wrong) == (result.status is Status.FAIL)
    cited = [c for c in result.citations if isinstance(c, EvidenceCitation) and c.to_ns is not None]
    at_s = round(((cited[0].to_ns or 0) - run.start_ns) / 1e9, 6)
    names_a_step = (
        re.search("(?<!ended )after ", result.message) is not None or example.check == "counter-start"
    )
    if result.status is Status.FAIL and names_a_step and "stops publishing" not in result.message:
        assert figure.wrong
        assert at_s in {figure.times_s[i] for i in figure.wrong}
        assert figure.texts[0]


@pytest.mark.parametrize("example", _examples("hears"))
def test_what_was_heard(example: Example) -> None:
    figures, result, _ = _drawn(example)
    measured = re.match(r"(\d+) of (\d+) messages? printed", result.measured)
    heard = [f for f in figures if isinstance(f, HeardFigure)]
    if not measured or "so many numbers" in result.message:
        assert heard == []
        return
    (figure,) = heard
    assert len(figure.rows) == int(measured[2])
    assert sum(row.heard is not None for row in figure.rows) == int(measured[1])
    assert figure.out_of_order == ("not in the order" in result.message)
    if result.status is Status.PASS:
        assert all(row.after_s is not None and row.after_s > -0.06 for row in figure.rows)


@pytest.mark.parametrize("example", _examples("path"))
def test_paths(example: Example) -> None:
    figures, result, _ = _drawn(example)
    measured = re.search(r"(\d+) of (\d+) points$", result.measured)
    paths = [f for f in figures if isinstance(f, PathFigure)]
    assert bool(paths) == bool(measured), result.measured
    if not measured:
        return
    (figure,) = paths
    assert (figure.reached, len(figure.corners)) == (int(measured[1]), int(measured[2]))
    if result.status is Status.PASS:
        assert figure.strayed is None
    if "strays" in result.message:
        assert figure.strayed is not None


@pytest.mark.full
@pytest.mark.parametrize("check", DRAWN)
def test_every_kind_is_drawn_from_some_timeline(check: str) -> None:
    """Or the tests above would hold of nothing."""
    statuses = {
        result.status
        for param in _examples(check)
        for figures, result, _ in [_drawn(param.values[0])]
        if figures
    }
    assert {Status.PASS, Status.FAIL} <= statuses
