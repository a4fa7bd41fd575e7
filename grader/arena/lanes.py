"""Which runs go side by side: those that do not disturb each other."""

from __future__ import annotations

from grader.arena.scenario import expected_s
from grader.rubric.model import Rubric, Scenario

LONG_S = 3.0
RATE = "rate"


def lanes(rubric: Rubric) -> tuple[tuple[str, ...], ...]:
    """Names of the runs that go one after the other; the lanes go side by side.

    Runs whose rates are judged have a lane of their own, and so have long ones that only watch. The others share one
    where a rate is measured beside them, else two of about the same length: starting processes takes CPU.
    """
    scenarios = rubric.scenarios
    rated = {c.scenario for c in rubric.criteria if c.check == RATE}
    measuring = tuple(n for n, s in scenarios.items() if n in rated and s.clock == "real")
    watching = tuple(n for n, s in scenarios.items() if n not in measuring and _watches(s))
    others = [n for n in scenarios if n not in measuring and n not in watching]
    if measuring:
        return tuple(lane for lane in (measuring, watching, tuple(others)) if lane)
    first: list[str] = []
    second: list[str] = []
    for name in others:
        shorter = min(first, second, key=lambda lane: sum(expected_s(scenarios[n]) for n in lane))
        shorter.append(name)
    return tuple(lane for lane in (watching, tuple(first), tuple(second)) if lane)


def _watches(scenario: Scenario) -> bool:
    until = scenario.until
    return scenario.clock == "real" and max(until.window_s or 0, until.alive_s or 0) >= LONG_S
