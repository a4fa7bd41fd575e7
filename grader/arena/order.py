"""In which order the runs of one submission ask to begin. Each has an arena of its own: they go side by side."""

from __future__ import annotations

from grader.arena.scenario import expected_s
from grader.rubric.model import Rubric

RATE = "rate"


def in_order(rubric: Rubric) -> tuple[str, ...]:
    """The runs' names: those in which a rate is measured first, then the longest first.

    Who watches for long begins early, so that the others start meanwhile.
    """
    scenarios = rubric.scenarios
    rated = {c.scenario for c in rubric.criteria if c.check == RATE}
    measuring = {n for n, s in scenarios.items() if n in rated and s.clock == "real"}
    return tuple(sorted(scenarios, key=lambda n: (n not in measuring, -expected_s(scenarios[n]))))
