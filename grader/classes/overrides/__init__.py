"""`overrides.yaml`: what people decided about criteria, read here and edited in `write`.

All faults are reported at once, as `file:line: submission.criterion: what is wrong`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TypeAlias

from grader.errors import RubricError
from grader.intake.names import safe_name
from grader.model.result import Override
from grader.model.version import OVERRIDES
from grader.rubric.faults import model_faults, shown
from grader.rubric.load import refuse_newer
from grader.rubric.model import Rubric
from grader.rubric.source import Fault, Form, Source, as_map, read_source
from grader.wording import did_you_mean

FILE = "overrides.yaml"
SCHEMA_KEY, SCHEMA = "schema", str(OVERRIDES)
FORM = Form(
    what="an overrides file",
    usual="overrides of a class are far less",
    bytes_max=20_000_000,
    nodes_max=300_000,
    times=frozenset({"date"}),
    written_keys=True,
    may_be_empty=True,
)
HINT = "each is `submission: {criterion: {points: 7, comment: …, author: …, date: 2026-11-02}}`"
Overrides: TypeAlias = Mapping[str, Mapping[str, Override]]
"""By the submission's id as the roster has it, then by criterion."""


def read_overrides(path: Path, rubric: Rubric, ids: Collection[str]) -> Overrides:
    """What people decided about the submissions of these ids; nothing where there is no such file.

    In the file a submission may go by its id, or by the name of its folder of results. Raises RubricError with every
    fault.
    """
    if not os.path.lexists(path):
        return {}
    source = read_source(path, str(path), FORM)
    refuse_newer(source, OVERRIDES)
    reading = _Reading(source, rubric, ids)
    reading.read()
    if reading.faults:
        told = sorted(dict.fromkeys(reading.faults), key=lambda fault: source.line(fault[0]))
        raise RubricError([source.fault(*fault) for fault in told], hint=HINT)
    return reading.found


def folder_key(name: str) -> str:
    """What two names of the same folder of results have in common."""
    return safe_name(name).casefold()


class _Reading:
    """Goes through the file, and collects what is sound in `found` and the rest in `faults`."""

    def __init__(self, source: Source, rubric: Rubric, ids: Collection[str]) -> None:
        self._source = source
        self._points = {c.id: (min(0.0, c.extra), c.points + max(0.0, c.extra)) for c in rubric.criteria}
        self._ids = {folder_key(name): name for name in ids}
        self.found: dict[str, dict[str, Override]] = {}
        self.faults: list[Fault] = list(source.faults)

    def read(self) -> None:
        data = self._source.data
        if not isinstance(data, dict):
            self.faults.append(((), f"must be a map from submissions to criteria, not {shown(data)}"))
            return
        first: dict[str, str] = {}
        for key, value in data.items():
            if key == SCHEMA_KEY:
                self._schema(value)
                continue
            name = self._ids.get(folder_key(key))
            if name is None:
                self.faults.append(((key,), f'there is no submission "{key}"{self._near(key)}'))
            elif first.setdefault(name, key) != key:
                line = self._source.line((first[name],))
                self.faults.append(((key,), f"is the submission of line {line} already, {first[name]}"))
            self._submission(key, value, name)

    def _schema(self, value: object) -> None:
        if value != SCHEMA:
            self.faults.append(((SCHEMA_KEY,), f'must be "{SCHEMA}", not {shown(value)}'))

    def _near(self, key: str) -> str:
        return did_you_mean(key, self._ids.values()) or did_you_mean(folder_key(key), self._ids)

    def _submission(self, key: str, value: object, name: str | None) -> None:
        if value is not None and not isinstance(value, dict):
            self.faults.append(((key,), f"must be a map from criteria to points, not {shown(value)}"))
        for criterion, given in as_map(value).items():
            faults = self._faults(key, criterion, given)
            self.faults += faults
            if not faults and name is not None:
                override = Override.model_validate_json(json.dumps(_given(given)), strict=True)
                self.found.setdefault(name, {})[criterion] = override

    def _faults(self, key: str, criterion: str, given: object) -> list[Fault]:
        path = (key, criterion)
        found = model_faults(Override, _given(given), path)
        if criterion not in self._points:
            near = did_you_mean(criterion, self._points)
            return [(path, f'there is no criterion "{criterion}"{near}'), *found]
        points, (least, most) = as_map(given).get("points"), self._points[criterion]
        if isinstance(points, int | float) and not isinstance(points, bool):
            if points > most:
                found.append(((*path, "points"), f"{points:g} is more than the criterion has: {most:g}"))
            if points < least:
                found.insert(0, ((*path, "points"), f"must be at least {least:g}, not {points:g}"))
        return found


def _given(value: object) -> object:
    """Without what was left empty, as in a form that someone has begun to fill in."""
    if not isinstance(value, dict):
        return value
    return {
        key: item
        for key, item in value.items()
        if item is not None or key not in {"comment", "author", "date"}
    }
