"""A rubric's file into its records. Every fault is named at once, as `file:line: key.path: what is wrong`."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from grader.checks import CHECKS
from grader.errors import RubricError, UsageError
from grader.model.record import Record
from grader.rubric.cross import cross_faults
from grader.rubric.faults import model_faults
from grader.rubric.find import locate, rubric_ids, rubrics_folder
from grader.rubric.model import Rubric
from grader.rubric.source import Source, read_source


class LoadedRubric(Record):
    """A rubric and where it came from; `digest` is the sha256 of the file's bytes."""

    rubric: Rubric
    path: Path
    digest: str


def load_rubric(name_or_path: str) -> LoadedRubric:
    """The rubric of that id (of those that come with the grader), or in that file.

    Raises RubricError with every fault that it has.
    """
    path, name = locate(name_or_path)
    source = read_source(path, name)
    faults = _faults(source)
    if faults:
        raise RubricError(faults)
    rubric = Rubric.model_validate_json(json.dumps(source.data), strict=True)
    return LoadedRubric(rubric=rubric, path=path, digest=hashlib.sha256(source.raw).hexdigest())


def all_rubrics() -> tuple[LoadedRubric, ...]:
    """Those that come with the grader, in order of their ids."""
    return tuple(load_rubric(str(rubrics_folder() / f"{name}.yaml")) for name in rubric_ids())


def find_rubric_for_package(name: str) -> str | None:
    """The id of the rubric for a package of that name, or None. Raises UsageError where there are several."""
    found = [r.rubric.id for r in all_rubrics() if r.rubric.package.lower() == name.lower()]
    if len(found) > 1:
        raise UsageError(
            f"{len(found)} rubrics are for a package named {name}: {', '.join(found)}",
            hint="choose one with --rubric",
        )
    return found[0] if found else None


def _faults(source: Source) -> list[str]:
    if not isinstance(source.data, dict):
        return [
            source.fault((), "a rubric is a map of keys and values, beginning with schema: grader.rubric/1")
        ]
    found = [
        *source.faults,
        *model_faults(Rubric, source.data),
        *cross_faults(source.data, CHECKS),
    ]
    unique = dict.fromkeys(found)
    return [source.fault(*fault) for fault in sorted(unique, key=lambda fault: source.line(fault[0]))]
