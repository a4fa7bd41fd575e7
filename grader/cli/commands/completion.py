"""`grader completion SHELL`: the script that the shell loads."""

from __future__ import annotations

from grader.cli.completion import script
from grader.cli.output import say_document
from grader.errors import ExitCode


def run(*, shell: str) -> ExitCode:
    """Print it."""
    say_document(lambda _: script(shell))
    return ExitCode.PASSED
