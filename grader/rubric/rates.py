"""The rates that a rubric judges, for the recorder: a run may end when they are clear."""

from __future__ import annotations

from collections import defaultdict

from grader.checks import CHECKS
from grader.model.message_rate import RateBounds
from grader.rubric.model import Rubric


def rates_of(rubric: Rubric) -> dict[str, tuple[RateBounds, ...]]:
    """Return them by scenario."""
    found: dict[str, list[RateBounds]] = defaultdict(list)
    for criterion in rubric.criteria:
        check = CHECKS.get(criterion.check)
        bounds = check.rate_bounds(criterion.parameters) if check and criterion.scenario else None
        if bounds is not None:
            found[criterion.scenario or ""].append(bounds)
    return {scenario: tuple(rates) for scenario, rates in found.items()}
