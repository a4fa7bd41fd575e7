"""A mutants file into its records. Every fault is named at once, as a rubric's are."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.authoring.mutation.model import Mutant, MutantsFile
from grader.authoring.mutation.operators import OPERATORS
from grader.errors import RubricError
from grader.model.record import Record
from grader.model.version import MUTANTS
from grader.rubric.faults import model_faults
from grader.rubric.load import refuse_newer
from grader.rubric.model import Rubric
from grader.rubric.source import Fault, KeyPath, Source, as_map, as_maps, read_source
from grader.suggest import did_you_mean


@dataclass(frozen=True, kw_only=True)
class LoadedMutants:
    """The records, and their text for faults that show only later."""

    mutants: tuple[Mutant, ...]
    source: Source


def load_mutants(path: Path, rubric: Rubric) -> LoadedMutants:
    """The mutants that the file declares for this rubric. Raises RubricError with every fault.

    A criterion that the rubric does not have is no fault of the file: the mutant then survives.
    """
    source = read_source(path, _short(path))
    if not isinstance(source.data, dict):
        raise RubricError(
            [source.fault((), "a mutants file is a map, beginning with schema: grader.mutants/1")]
        )
    refuse_newer(source, MUTANTS)
    found = [*source.faults, *model_faults(MutantsFile, source.data), *_cross_faults(source.data, rubric)]
    if found:
        ordered = sorted(dict.fromkeys(found), key=lambda fault: source.line(fault[0]))
        raise RubricError([source.fault(*fault) for fault in ordered])
    records = MutantsFile.model_validate_json(json.dumps(source.data), strict=True)
    return LoadedMutants(mutants=records.mutants, source=source)


def parameters_of(operator: str, given: dict[str, Any]) -> Record:
    """The operator's own record of what was given."""
    return OPERATORS[operator].params.model_validate_json(json.dumps(given), strict=True)


def _cross_faults(data: dict[str, Any], rubric: Rubric) -> Iterator[Fault]:
    name = data.get("rubric")
    if isinstance(name, str) and name != rubric.id:
        yield ("rubric",), f"these mutants are for {name}, not for {rubric.id}"
    first: dict[str, int] = {}
    for index, mutant in as_maps(data.get("mutants")):
        path: KeyPath = ("mutants", index)
        yield from _step_faults(path, mutant)
        for position, step in as_maps(mutant.get("also")):
            yield from _step_faults((*path, "also", position), step)
        same = json.dumps([mutant.get(key) for key in ("operator", "at", "with", "also")], sort_keys=True)
        if first.setdefault(same, index) != index:
            yield path, f"is the same mutant as mutants[{first[same]}]"


def _step_faults(path: KeyPath, step: dict[str, Any]) -> Iterator[Fault]:
    name = step.get("operator")
    if not isinstance(name, str):
        return
    if name not in OPERATORS:
        yield (*path, "operator"), f'there is no operator "{name}"{did_you_mean(name, OPERATORS)}'
        return
    yield from model_faults(OPERATORS[name].params, as_map(step.get("with")), (*path, "with"))


def _short(path: Path) -> str:
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
