"""A lab's file of faulty packages: read into records with every fault named, and a first one written from a test."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from grader.authoring.mutation.operators import OPERATORS
from grader.errors import RubricError
from grader.model.mutants import Mutant, MutantResult, MutantsFile
from grader.model.record import Record
from grader.model.version import MUTANTS
from grader.rubric.faults import model_faults
from grader.rubric.find import rubrics_folder
from grader.rubric.load import LoadedRubric, refuse_newer
from grader.rubric.model import Rubric
from grader.rubric.source import Fault, KeyPath, Source, as_map, as_maps, read_source
from grader.untrusted_text import visible
from grader.wording import did_you_mean

HEADER = """\
# Faulty packages for {rubric}: the reference solution with edits, and the criteria that each package must not reach.
# Written by a test: keep those that say something, and correct what a package should cost.
schema: grader.mutants/1
rubric: {rubric}

mutants:
"""
NOT_KILLED = {
    "survived": "costs nothing: the rubric does not notice this mistake",
    "inconclusive": "could not be judged",
    "error": "could not be graded",
}


@dataclass(frozen=True, kw_only=True)
class LoadedMutants:
    """The records, and their source for faults that show only when the packages are built."""

    mutants: dict[str, Mutant]
    source: Source


def mutants_file(rubric: LoadedRubric) -> Path | None:
    """Return `mutants/<id>.yaml` beside the rubric, or the file that comes with the grader; None without either."""
    name = f"{rubric.rubric.id}.yaml"
    beside, shipped = (
        rubric.path.absolute().parent / "mutants" / name,
        rubrics_folder().parent / "fixtures" / name,
    )
    return next((path for path in (beside, shipped) if path.is_file()), None)


def load_mutants(path: Path, rubric: Rubric) -> LoadedMutants:
    """Return the packages that the file declares for this rubric. Raises RubricError with every fault.

    A criterion that the rubric does not have is not a fault of the file: such a mutant survives.
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


def parse_parameters(operator: str, given: dict[str, Any]) -> Record:
    """Return an operator's parameters as its own record."""
    return OPERATORS[operator].params.model_validate_json(json.dumps(given), strict=True)


def _cross_faults(data: dict[str, Any], rubric: Rubric) -> Iterator[Fault]:
    name = data.get("rubric")
    if isinstance(name, str) and name != rubric.id:
        yield ("rubric",), f"these mutants are for {name}, not for {rubric.id}"
    first: dict[str, str] = {}
    for key, mutant in as_map(data.get("mutants")).items():
        edits = as_map(mutant).get("edits")
        for position, edit in as_maps(edits):
            yield from _operator_faults(("mutants", key, "edits", position), edit)
        same = first.setdefault(json.dumps(edits, sort_keys=True), key)
        if same != key and edits:
            yield ("mutants", key), f"has the same edits as mutants.{same}"


def _operator_faults(path: KeyPath, edit: dict[str, Any]) -> Iterator[Fault]:
    name = edit.get("operator")
    if not isinstance(name, str):
        return
    if name not in OPERATORS:
        yield (*path, "operator"), f'there is no operator "{name}"{did_you_mean(name, OPERATORS)}'
        return
    yield from model_faults(OPERATORS[name].params, as_map(edit.get("with")), (*path, "with"))


def _short(path: Path) -> str:
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


# ---- a first file


def mutants_text(rubric: str, mutants: dict[str, Mutant], results: Sequence[MutantResult]) -> str:
    """Return the text of a mutants file. Mutants that cost nothing, or were not judged, are in it as comments."""
    parts = [HEADER.format(rubric=rubric)]
    for result in results:
        costs = {criterion.id: criterion.status for criterion in result.lost}
        text = _entry(result.name, mutants[result.name], costs)
        if result.state in NOT_KILLED:
            text = "".join(f"  # {line.strip()}\n" for line in [NOT_KILLED[result.state], *text.splitlines()])
        parts.append(text)
    return "\n".join(parts)


def _entry(name: str, mutant: Mutant, costs: dict[str, str]) -> str:
    edits = [edit.model_dump(by_alias=True, exclude_unset=True) for edit in mutant.edits]
    lines = [f"    expect: {_flow(costs)}", "    edits:", *(f"      - {_flow(edit)}" for edit in edits)]
    return "\n".join([f"  {name}:", *lines, ""])


def _flow(data: object) -> str:
    """Return a map as YAML in one line, with invisible letters escaped."""

    def dump(*, letters: bool) -> str:
        return yaml.safe_dump(
            data, default_flow_style=True, sort_keys=False, allow_unicode=letters, width=10_000
        ).strip()

    text = dump(letters=True)
    return text if visible(text, lines=True) == text else dump(letters=False)
