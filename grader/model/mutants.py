"""`rubrics/mutants/<lab>.yaml` as records, and what a rubric's test comes to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from grader.model.record import Record
from grader.model.result import RubricInfo
from grader.rubric.model import Name

Cost = Literal["fail", "partial", "blocked"]
State = Literal["killed", "survived", "differs", "inconclusive", "error"]


class Step(Record):
    """One operator at one place. `at` names the place where the operator fits in several; `with` its parameters."""

    operator: str
    at: Annotated[dict[str, str | int], Field(default_factory=dict)]
    parameters: Annotated[dict[str, Any], Field(alias="with", default_factory=dict)]


class Mutant(Step):
    """What it must cost: criteria by id, with the status that each must get; all others must be reached.

    `also` are further mistakes in the same mutant, made one after the other.
    """

    also: tuple[Step, ...] = ()
    costs: Annotated[dict[str, Cost], Field(min_length=1)]


class MutantsFile(Record):
    """The mutants of one lab's reference solution."""

    schema_: Annotated[Literal["grader.mutants/1"], Field(alias="schema")]
    rubric: Name
    mutants: Annotated[tuple[Mutant, ...], Field(min_length=1)]


def label(operator: str, at: Mapping[str, str | int], parameters: Mapping[str, Any]) -> str:
    """How a mutant is called: `other-rate: src/talker.py (factor 0.5)`."""
    place = ", ".join(str(value) for value in at.values())
    given = ", ".join(f"{name} {value}" for name, value in parameters.items())
    return operator + (f": {place}" if place else "") + (f" ({given})" if given else "")


class LostCriterion(Record):
    """A criterion that was not reached, in the report's words."""

    id: str
    status: str
    message: str
    hint: str = ""


class MutantResult(Record):
    """One mutant's grading. `expected` is None where nothing was declared.

    `missing` are declared criteria that were reached or are not in the rubric, `surplus` those that were lost
    though not declared, `differing` those with another status, each with its reason in words. `evidence` is the
    folder of the grading, None where it was not kept.
    """

    name: str
    label: str
    operator: str
    mistake: str
    state: State
    expected: dict[str, Cost] | None
    lost: tuple[LostCriterion, ...]
    missing: tuple[str, ...] = ()
    surplus: tuple[str, ...] = ()
    differing: tuple[str, ...] = ()
    diff: str
    evidence: str | None = None
    error: str = ""
    wall_s: float


class ReferenceResult(Record):
    """How the correct package fared; `lost` is empty where it got everything."""

    points: float
    max_points: float
    lost: tuple[LostCriterion, ...]
    evidence: str | None = None


class RubricTest(Record):
    """`grader rubric test --json`. `uncosted` are criteria worth points that no mutant cost; None where only some of
    the mutants were tried. `unfit` are mutants that a solution of the user's own has no place for."""

    schema_: Literal["grader.rubric-test/1"] = Field(default="grader.rubric-test/1", alias="schema")
    rubric: RubricInfo
    solution: str
    reference: ReferenceResult
    mutants: tuple[MutantResult, ...]
    uncosted: tuple[str, ...] | None
    unfit: tuple[str, ...] = ()
    wall_s: float
    passed: bool
