"""What a submission has to hold for a rubric."""

from __future__ import annotations

from collections.abc import Mapping

from grader.checks import Check
from grader.rubric.load import LoadedRubric
from grader.rubric.model import Criterion, Rubric


def started(rubric: Rubric) -> Rubric:
    """The rubric without the scenarios for which nothing is run."""
    scenarios = {name: s for name, s in rubric.scenarios.items() if s.recording is None}
    return rubric.model_copy(update={"scenarios": scenarios})


def needs_package(loaded: LoadedRubric) -> bool:
    """Whether there is anything to run, or any check that looks at the package's files."""
    rubric, checks = loaded.rubric, loaded.checks
    return bool(started(rubric).scenarios) or any(_looks_at_files(c, checks) for c in rubric.criteria)


def needs_ros(loaded: LoadedRubric) -> bool:
    """Whether anything is to be built or run: files alone decide everything else."""
    rubric, checks = loaded.rubric, loaded.checks
    return bool(started(rubric).scenarios) or any(_needs_build(c, checks) for c in rubric.criteria)


def _needs_build(criterion: Criterion, checks: Mapping[str, Check]) -> bool:
    check = checks.get(criterion.check)
    return check is not None and "build" in check.facts


def _looks_at_files(criterion: Criterion, checks: Mapping[str, Check]) -> bool:
    check = checks.get(criterion.check)
    return check is not None and not check.messages_only and bool({"package", "build"} & set(check.facts))
