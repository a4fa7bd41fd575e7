"""`grader schema [NAME]`: what the grader's files look like, for programs."""

from __future__ import annotations

from grader.cli.output import say, say_json
from grader.errors import ExitCode
from grader.report.formats import FORMATS, schema_of


def run(*, name: str | None = None) -> ExitCode:
    """Print the JSON Schema of that format, or list all of them with their versions."""
    if name is not None:
        say_json(schema_of(name))
        return ExitCode.PASSED
    wide = max(map(len, FORMATS))
    for known in FORMATS.values():
        say(f"{known.name:{wide}}  {known.is_!s:{wide + 9}}  {known.where}".replace("`", ""))
    return ExitCode.PASSED
