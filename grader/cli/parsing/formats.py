"""The command that shows what the grader's files look like."""

from __future__ import annotations

from grader.cli.parsing.base import Adder
from grader.model.version import ALL


def add_formats(add: Adder) -> None:
    """Add `schema`."""
    schema = add("schema", "print the JSON Schema of a format that the grader writes or reads")
    schema.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        choices=[one.short for one in ALL],
        help=f"{', '.join(one.short for one in ALL)} (default: list them with their versions)",
    )
