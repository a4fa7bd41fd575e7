"""What a mutant lost, against what it must cost."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from grader.model.mutants import Cost, LostCriterion, State
from grader.model.result import CriterionResult
from grader.model.verdict import Status


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """See `MutantResult`."""

    state: State
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()


def lost_criteria(
    criteria: Sequence[CriterionResult], ignored: Collection[str] = ()
) -> tuple[LostCriterion, ...]:
    """The criteria that were not reached; a person's points are nobody's loss."""
    return tuple(
        LostCriterion(id=c.id, status=c.status.value, message=c.message, hint=c.hint)
        for c in criteria
        if c.status not in {Status.PASS, Status.MANUAL} and c.id not in ignored
    )


def compare(
    expected: dict[str, Cost] | None, criteria: Sequence[CriterionResult], ignored: Collection[str] = ()
) -> Comparison:
    """Without declared costs, a mutant is killed by whatever it costs. `ignored` are criteria that the reference
    solution does not reach either: advice, where it has some."""
    found = {c.id: c.status for c in criteria if c.id not in ignored}
    if any(status.is_retryable for status in found.values()):
        return Comparison(state="inconclusive")
    lost = {name: status.value for name, status in found.items() if status.is_lost}
    if expected is None:
        return Comparison(state="killed" if lost else "survived")
    known = {c.id for c in criteria}
    missing = tuple(_missing(name, known) for name in expected if name not in lost)
    surplus = tuple(name for name in lost if name not in expected)
    differing = tuple(
        f"{name} is {lost[name]}, not {wanted}"
        for name, wanted in expected.items()
        if name in lost and lost[name] != wanted
    )
    if not (missing or surplus or differing):
        return Comparison(state="killed")
    state: State = "differs" if lost else "survived"
    return Comparison(state=state, missing=missing, surplus=surplus, differing=differing)


def _missing(name: str, known: Collection[str]) -> str:
    return name if name in known else f"{name} (the rubric has no such criterion)"
