"""What is known of labs: their ids, their criteria, the mistakes that their packages are tested with.

Read from the files as YAML alone. To load rubrics properly takes longer than somebody waits for a key.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from grader.rubric.find import rubric_ids, rubrics_folder

SAID_CHARS = 80


def lab_ids(**_asked: object) -> dict[str, str]:
    """The labs that come with the grader, each with its title."""
    return {lab: _line(_read(_shipped(lab)).get("title")) for lab in rubric_ids()}


def explained(*, prefix: str, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """What `grader explain` knows: criteria with their titles, with their lab before them once one is begun; checks."""
    rubric = getattr(parsed_args, "rubric", None)
    if rubric:
        path = _shipped(rubric) if rubric in rubric_ids() else Path(rubric)
        return {**_checks(), **dict(_criteria(path))}
    if "/" in prefix:
        lab = prefix.partition("/")[0]
        return {f"{lab}/{name}": title for name, title in _criteria(_shipped(lab))}
    criteria = {name: title for lab in rubric_ids() for name, title in _criteria(_shipped(lab))}
    labs = {f"{lab}/": "a criterion of this lab" for lab in rubric_ids()}
    return {**_checks(), **criteria, **labs}


def mutants(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """The faulty packages that the named lab's rubric is tested with."""
    return _mutants(str(getattr(parsed_args, "rubric", "")))


def mistakes(*, parsed_args: argparse.Namespace, **_asked: object) -> dict[str, str]:
    """The faulty packages of the named lab, for `grader example --mistake`."""
    return _mutants(str(getattr(parsed_args, "lab", "")))


def _checks() -> dict[str, str]:
    from grader.checks import CHECKS  # noqa: PLC0415 - most completions do without

    return {check.name: _line(check.title) for check in CHECKS.values()}


def _criteria(path: Path) -> Iterator[tuple[str, str]]:
    """Those that students may know of."""
    for criterion in _entries(path, "criteria"):
        if criterion.get("visibility", "visible") == "visible":
            yield str(criterion.get("id", "")), _line(criterion.get("title"))


def _mutants(lab: str) -> dict[str, str]:
    declared = (
        _read(rubrics_folder().parent / "fixtures" / f"{lab}.yaml").get("mutants")
        if lab in rubric_ids()
        else {}
    )
    found = declared.items() if isinstance(declared, dict) else ()
    return {
        str(name): _line(mutant.get("summary"))
        for name, mutant in found
        if isinstance(mutant, dict) and mutant.get("expect")
    }


def _shipped(lab: str) -> Path:
    return rubrics_folder() / f"{lab}.yaml"


def _entries(path: Path, key: str) -> list[dict[str, Any]]:
    entries = _read(path).get(key)
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _read(path: Path) -> dict[str, Any]:
    """What the file says; empty where it cannot be read, as nothing may be said while somebody types."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        data = yaml.load(path.read_bytes(), loader)  # noqa: S506 - either of them is a safe one
    except (OSError, ValueError, yaml.YAMLError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def _line(words: object) -> str:
    return " ".join(str(words or "").split())[:SAID_CHARS]
