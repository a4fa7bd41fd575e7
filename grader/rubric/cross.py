"""What the records' types cannot say: names that must exist, points that must add up, circles.

Works on the data as read, so that a fault in one place hides none elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from grader.checks.registry import Check
from grader.rubric.faults import model_faults
from grader.rubric.runs import scenario_faults
from grader.rubric.source import Fault, KeyPath, as_map, as_maps, as_texts
from grader.suggest import did_you_mean

TOTAL_POINTS = 100
ANSWERS = "service-answers"
MANUAL = "manual"  # a person gives the points, no check does


def cross_faults(data: object, checks: Mapping[str, Check], *, complete: bool = True) -> list[Fault]:
    """Every fault that shows only between one part of a rubric and another, or between it and the checks.

    Where `checks` are not complete, because the instructor's file of them is broken, a name that is near none is
    left alone: it may be one of theirs.
    """
    rubric = as_map(data)
    scenarios = as_map(rubric.get("scenarios"))
    criteria = as_maps(rubric.get("criteria"))
    faults = [f for name, s in scenarios.items() for f in scenario_faults(("scenarios", name), as_map(s))]
    for index, criterion in criteria:
        path = ("criteria", index)
        faults += _check(path, criterion, checks, complete=complete)
        faults += _place(path, criterion, scenarios, checks)
        faults += _uncalled(path, criterion, scenarios)
    faults += _names(criteria)
    faults += _circles(criteria)
    faults += _points(rubric, criteria)
    faults += _late(rubric)
    return faults


def _check(
    path: KeyPath, criterion: dict[str, Any], checks: Mapping[str, Check], *, complete: bool
) -> Iterator[Fault]:
    name = criterion.get("check")
    if not isinstance(name, str):
        return
    if name == MANUAL:
        yield from (((*path, "with"), "a person needs no parameters") for _ in as_map(criterion.get("with")))
        return
    if name not in checks:
        near = did_you_mean(name, [*checks, MANUAL])
        if complete or near:
            yield (*path, "check"), f'there is no check "{name}"{near}'
        return
    parameters = criterion.get("with", {})
    if isinstance(parameters, dict):
        yield from model_faults(checks[name].params, parameters, (*path, "with"))


def _place(
    path: KeyPath, criterion: dict[str, Any], scenarios: dict[str, Any], checks: Mapping[str, Check]
) -> Iterator[Fault]:
    scenario, check = criterion.get("scenario"), criterion.get("check")
    if scenario is None:
        if isinstance(check, str) and check in checks and checks[check].needs_run:
            yield (*path, "scenario"), f'is missing: "{check}" judges a run'
    elif isinstance(scenario, str) and scenario not in scenarios:
        yield (*path, "scenario"), f'there is no scenario "{scenario}"{did_you_mean(scenario, scenarios)}'
    elif isinstance(scenario, str) and isinstance(check, str) and check in checks:
        recorded = as_map(scenarios[scenario]).get("recording") is not None
        if recorded and checks[check].needs_run and not checks[check].messages_only:
            yield (*path, "check"), f'"{check}" judges more than messages, and a recording holds no more'


def _uncalled(path: KeyPath, criterion: dict[str, Any], scenarios: dict[str, Any]) -> Iterator[Fault]:
    """Answers can only be judged to calls that the scenario makes."""
    given, scenario = as_map(criterion.get("with")), criterion.get("scenario")
    expect, service = given.get("expect"), given.get("service")
    if criterion.get("check") != ANSWERS or not isinstance(expect, list) or scenario not in scenarios:
        return
    calls = [c for _, c in as_maps(as_map(scenarios[scenario]).get("calls")) if c.get("service") == service]
    if len(calls) < len(expect):
        made = f"{len(calls)} of them" if calls else "none"
        yield (*path, "with", "expect"), f"asks for {len(expect)} calls of {service}; {scenario} makes {made}"


def _names(criteria: list[tuple[int, dict[str, Any]]]) -> Iterator[Fault]:
    first: dict[str, int] = {}
    for index, criterion in criteria:
        name = criterion.get("id")
        if isinstance(name, str) and first.setdefault(name, index) != index:
            yield ("criteria", index, "id"), f'"{name}" is the id of criteria[{first[name]}] already'
    for index, criterion in criteria:
        for position, name in as_texts(criterion.get("requires")):
            if name not in first:
                path = ("criteria", index, "requires", position)
                yield path, f'there is no criterion "{name}"{did_you_mean(name, first)}'


def _circles(criteria: list[tuple[int, dict[str, Any]]]) -> Iterator[Fault]:
    """Each circle once, named from the criterion of it that comes first."""
    needs = {str(c.get("id")): [name for _, name in as_texts(c.get("requires"))] for _, c in criteria}
    places = {str(c.get("id")): index for index, c in reversed(criteria)}
    told: set[frozenset[str]] = set()
    for name, index in sorted(places.items(), key=lambda item: item[1]):
        circle = _circle(name, needs)
        if circle and frozenset(circle) not in told:
            told.add(frozenset(circle))
            yield ("criteria", index, "requires"), "goes in a circle: " + " → ".join([*circle, name])


def _circle(start: str, needs: dict[str, list[str]]) -> list[str]:
    """The shortest way from `start` along `requires` back to itself; empty where there is none."""
    ways, seen = [[start]], {start}
    for way in ways:
        for name in needs.get(way[-1], ()):
            if name == start:
                return way
            if name not in seen:
                seen.add(name)
                ways.append([*way, name])
    return []


def _points(rubric: dict[str, Any], criteria: list[tuple[int, dict[str, Any]]]) -> Iterator[Fault]:
    points = [c.get("points") for _, c in criteria]
    numbers = [p for p in points if isinstance(p, int | float) and not isinstance(p, bool)]
    if not numbers or len(numbers) < len(points):
        return
    total = sum(numbers)
    if abs(total - TOTAL_POINTS) > 1e-6:
        yield ("criteria",), f"the points add up to {total:g}, not to {TOTAL_POINTS}"
    mark = rubric.get("pass_mark")
    if isinstance(mark, int | float) and mark > total:
        yield ("pass_mark",), f"{mark:g} is more than all the points, {total:g}"


def _late(rubric: dict[str, Any]) -> Iterator[Fault]:
    late = as_map(rubric.get("late"))
    if late and rubric.get("deadline") is None:
        yield ("late",), "needs a deadline: deadline: 2026-11-20T23:59:00+01:00"
    grace, cut_off = late.get("grace_minutes"), late.get("cut_off_days")
    if isinstance(grace, int | float) and isinstance(cut_off, int | float) and grace > cut_off * 24 * 60:
        yield (
            ("late", "grace_minutes"),
            f"is longer than cut_off_days, after which nothing counts: {cut_off:g}",
        )
