"""`grader rubric schema`: for editors that know JSON Schema."""

from __future__ import annotations

import json

from grader.errors import ExitCode
from grader.rubric.schema import rubric_schema


def run() -> ExitCode:
    """Print the schema."""
    print(json.dumps(rubric_schema(), indent=2, ensure_ascii=False))
    return ExitCode.PASSED
