"""Every command, as a typed function: see `grader.cli.declare`. The order of these imports is that of the help.

A module here has no `from __future__ import annotations`, since the parser is made from the annotations.
"""

from grader.cli.commands import grading, classes, labs, integrations  # noqa: I001 - their order

__all__ = ["classes", "grading", "integrations", "labs"]
