"""The instructor's files that a rubric names, read before it is judged sound."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader.checks import Check
from grader.rubric.own_checks.files import FileFault, read_beside
from grader.rubric.own_checks.known import known_checks
from grader.rubric.own_checks.own import OwnChecks, run_checks_file
from grader.rubric.source import Fault, KeyPath, as_map, as_maps

PYTEST = "pytest"


@dataclass(frozen=True, kw_only=True)
class Beside:
    """The files by name, the instructor's own checks, all checks by name, and faults of the rubric's own keys."""

    files: dict[str, bytes]
    own: OwnChecks
    known: dict[str, Check]
    faults: tuple[Fault, ...]


def read_instructor(data: object, folder: Path) -> Beside:
    """Reads what `checks:` and `check: pytest` name, and runs the file of checks."""
    rubric = as_map(data)
    named: list[tuple[KeyPath, object]] = [(("checks",), rubric["checks"])] if "checks" in rubric else []
    named += [
        (("criteria", index, "with", "file"), as_map(criterion.get("with")).get("file"))
        for index, criterion in as_maps(rubric.get("criteria"))
        if criterion.get("check") == PYTEST
    ]
    files: dict[str, bytes] = {}
    faults: list[Fault] = []
    own = OwnChecks(complete=rubric.get("checks") is None)
    for path, name in named:
        if not isinstance(name, str):
            continue
        try:
            file, files[name] = read_beside(folder, name)
        except FileFault as fault:
            faults.append((path, str(fault)))
            continue
        if path == ("checks",):
            own = run_checks_file(file, files[name])
    return Beside(files=files, own=own, known=known_checks(folder, own.checks), faults=tuple(faults))
