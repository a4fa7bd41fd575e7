"""`grader rubric schema`: for editors that know JSON Schema."""

from __future__ import annotations

from grader.cli.output import say_json
from grader.errors import ExitCode
from grader.rubric.load import load_rubric
from grader.rubric.schema import rubric_schema


def run(*, rubric: str | None = None) -> ExitCode:
    """Print the schema; with `rubric`, that rubric's own checks are part of it."""
    checks = load_rubric(rubric).checks if rubric is not None else None
    say_json(rubric_schema(checks))
    return ExitCode.PASSED
