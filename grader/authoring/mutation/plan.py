"""From declarations, or from all operators, to mutants that can be graded."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from grader.authoring.mutation.load import LoadedMutants, parameters_of
from grader.authoring.mutation.model import Cost, Mutant, Step, label
from grader.authoring.mutation.operators import OPERATORS
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.tree import Tree
from grader.errors import RubricError, UsageError
from grader.suggest import did_you_mean

SHOWN_PLACES = 6
Place = Mapping[str, str | int]


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A mutant that is ready: `name` is fit for a folder, `costs` None where nothing is declared."""

    name: str
    label: str
    step: Step
    tree: Tree
    costs: dict[str, Cost] | None = None

    @property
    def operators(self) -> tuple[str, ...]:
        also = self.step.also if isinstance(self.step, Mutant) else ()
        return (self.step.operator, *(step.operator for step in also))


class DoesNotFitError(Exception):
    """An operator that has no place, or no single one, in a solution; says why."""


def plan_declared(loaded: LoadedMutants, solution: Solution) -> tuple[list[Planned], list[str]]:
    """The mutants of the file, and for those that this solution has no place for, what is wrong, with its line."""
    planned: list[Planned] = []
    faults: list[str] = []
    for index, mutant in enumerate(loaded.mutants):
        try:
            places, tree = mutated(solution, mutant)
        except DoesNotFitError as error:
            faults.append(loaded.source.fault(("mutants", index), str(error)))
            continue
        steps = zip((mutant, *mutant.also), places, strict=True)
        words = " + ".join(label(step.operator, at, step.parameters) for step, at in steps)
        planned.append(Planned(name="", label=words, step=mutant, tree=tree, costs=dict(mutant.costs)))
    return _named(planned), faults


def plan_all(solution: Solution) -> list[Planned]:
    """Every operator at every place where it fits, with its own parameters."""
    planned = []
    for operator in OPERATORS.values():
        for site in operator.sites(solution):
            step = Step.model_validate({"operator": operator.name, "at": site.at})
            planned.append(
                Planned(name="", label=label(operator.name, site.at, {}), step=step, tree=site.tree)
            )
    return _named(planned)


def mutated(solution: Solution, mutant: Mutant) -> tuple[list[Place], Tree]:
    """Where each of the mutant's mistakes is, and the tree with all of them. Raises DoesNotFitError."""
    places = []
    for step in (mutant, *mutant.also):
        site = _site(solution, step)
        places.append(site.at)
        solution = solution.then(site.tree)
    return places, solution.tree


def _site(solution: Solution, step: Step) -> Site:
    operator = OPERATORS[step.operator]
    sites = operator.sites(solution, parameters_of(step.operator, step.parameters))
    if not sites:
        raise DoesNotFitError(f"{step.operator} fits nowhere in this package; it fits {operator.fits}")
    chosen = [site for site in sites if step.at.items() <= site.at.items()]
    if len(chosen) == 1:
        return chosen[0]
    where = "; ".join(_place(site.at) for site in (chosen or sites)[:SHOWN_PLACES])
    if not chosen:
        raise DoesNotFitError(f"{step.operator} does not fit at {_place(step.at)}; it fits at {where}")
    raise DoesNotFitError(f"{step.operator} fits in {len(chosen)} places: say in `at` which: {where}")


def _place(at: Place) -> str:
    return "{" + ", ".join(f"{key}: {value}" for key, value in at.items()) + "}"


def _named(planned: Sequence[Planned]) -> list[Planned]:
    """Each with a name of its own, made from its label."""
    seen: dict[str, int] = {}
    named = []
    for mutant in planned:
        name = re.sub(r"[^a-z0-9.]+", "-", mutant.label.lower()).strip("-.")[:80]
        seen[name] = seen.get(name, 0) + 1
        unique = name if seen[name] == 1 else f"{name}-{seen[name]}"
        named.append(
            Planned(name=unique, label=mutant.label, step=mutant.step, tree=mutant.tree, costs=mutant.costs)
        )
    return named


def chosen(planned: Sequence[Planned], only: Sequence[str]) -> list[Planned]:
    """Those that `only` names, by mutant or by operator, `*` allowed. Raises UsageError for one that none has."""
    if not only:
        return list(planned)
    for pattern in only:
        if not any(_matches(mutant, pattern) for mutant in planned):
            known = dict.fromkeys(name for m in planned for name in (m.name, *m.operators))
            raise UsageError(
                f'there is no mutant "{pattern}"{did_you_mean(pattern, known)}',
                hint="--only takes an operator's name, or a mutant's as the table shows it",
            )
    return [mutant for mutant in planned if any(_matches(mutant, pattern) for pattern in only)]


def _matches(mutant: Planned, pattern: str) -> bool:
    return any(fnmatchcase(name, pattern) for name in _names(mutant))


def _names(mutant: Planned) -> Iterator[str]:
    yield from (mutant.name, mutant.label, *mutant.operators)


def refuse_unfit(faults: list[str]) -> None:
    """Raise RubricError where a mutants file does not fit the reference solution that it was written for."""
    if faults:
        raise RubricError(faults, hint="the mutants file and the reference solution do not fit each other")
