"""`grader rubric validate FILE…`: every fault of every file."""

from __future__ import annotations

from grader.cli.output import say
from grader.errors import ExitCode, RubricError
from grader.rubric.load import load_rubric
from grader.wording import number


def run(*, files: list[str]) -> ExitCode:
    """One line for each sound file. Raises RubricError with the faults of all the others."""
    errors = [error for file in files if (error := _validate(file))]
    if errors:
        faults = [fault for error in errors for fault in error.faults]
        raise RubricError(faults, hint=next((e.hint for e in errors if e.hint), ""))
    return ExitCode.PASSED


def _validate(file: str) -> RubricError | None:
    try:
        rubric = load_rubric(file).rubric
    except RubricError as error:
        return error
    points = number(rubric.max_points)
    say(f"{file}: ok, {rubric.id}, {len(rubric.criteria)} criteria, {points} points")
    return None
