"""`grader rubric schema`: for editors that know JSON Schema."""

from __future__ import annotations

import json

from grader.errors import ExitCode
from grader.rubric.load import load_rubric
from grader.rubric.schema import rubric_schema


def run(*, rubric: str | None = None) -> ExitCode:
    """Print the schema; with `rubric`, that rubric's own checks are part of it."""
    checks = load_rubric(rubric).checks if rubric is not None else None
    print(json.dumps(rubric_schema(checks), indent=2, ensure_ascii=False))
    return ExitCode.PASSED
