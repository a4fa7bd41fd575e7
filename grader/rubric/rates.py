"""What the recorder needs to know of the criteria: rates that end a run when they are clear, and how long to watch."""

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


def watched_of(rubric: Rubric) -> dict[str, float]:
    """Return, by scenario, for how many seconds its nodes have to be watched for all to be judged."""
    found: dict[str, float] = defaultdict(float)
    for criterion in rubric.criteria:
        check = CHECKS.get(criterion.check)
        for one in check.references(criterion.parameters) if check and criterion.scenario else ():
            if one.to == "watched_s" and isinstance(one.value, int | float):
                found[criterion.scenario or ""] = max(found[criterion.scenario or ""], one.value)
    return dict(found)
