"""The rates that a rubric judges, for the recorder: a run may end when they are clear."""

from __future__ import annotations

from collections import defaultdict

from grader.checks.rate import RateParams
from grader.model.message_rate import RateBounds
from grader.rubric.model import Rubric

RATE = "rate"


def rates_of(rubric: Rubric) -> dict[str, tuple[RateBounds, ...]]:
    """By scenario."""
    found: dict[str, list[RateBounds]] = defaultdict(list)
    for criterion in rubric.criteria:
        if criterion.check == RATE and criterion.scenario is not None:
            found[criterion.scenario].append(RateParams.model_validate(criterion.parameters).bounds)
    return {scenario: tuple(rates) for scenario, rates in found.items()}
