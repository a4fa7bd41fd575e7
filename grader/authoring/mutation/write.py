"""A first mutants file out of what a test's mutants cost, ready to edit."""

from __future__ import annotations

from collections.abc import Sequence

import yaml

from grader.authoring.mutation.model import MutantResult, Step
from grader.authoring.mutation.plan import Planned
from grader.untrusted_text import visible

HEADER = """\
# The mutants of {rubric}'s reference solution, and the criteria that each of them must cost, no more and no less.
# Written from a test's run: keep those that say something, and correct what a mutant should cost.
schema: grader.mutants/1
rubric: {rubric}

mutants:
"""
NOT_KILLED = {
    "survived": "costs nothing: the rubric does not see this mistake",
    "inconclusive": "could not be judged",
    "error": "could not be graded",
}


def mutants_text(rubric: str, planned: Sequence[Planned], results: Sequence[MutantResult]) -> str:
    """The file's text. Mutants that cost nothing, or were not judged, stand in it as comments."""
    steps = {mutant.name: mutant.step for mutant in planned}
    parts = [HEADER.format(rubric=rubric)]
    for result in results:
        costs = {criterion.id: criterion.status for criterion in result.lost}
        text = _entry(steps[result.name], costs)
        if result.state in NOT_KILLED:
            text = "".join(f"  # {line.strip()}\n" for line in [NOT_KILLED[result.state], *text.splitlines()])
        parts.append(text)
    return "\n".join(parts)


def _entry(step: Step, costs: dict[str, str]) -> str:
    lines = [f"  - operator: {step.operator}"]
    if step.at:
        lines.append(f"    at: {_flow(step.at)}")
    if step.parameters:
        lines.append(f"    with: {_flow(step.parameters)}")
    return "\n".join([*lines, f"    costs: {_flow(costs)}", ""])


def _flow(data: object) -> str:
    """A map in one line; letters are escaped where there is something that cannot be seen."""

    def dump(*, letters: bool) -> str:
        return yaml.safe_dump(
            data, default_flow_style=True, sort_keys=False, allow_unicode=letters, width=10_000
        ).strip()

    text = dump(letters=True)
    return text if visible(text, lines=True) == text else dump(letters=False)
