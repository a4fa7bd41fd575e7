"""Says before a command begins that students' code will run without a sandbox."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from grader.arena.unrun import why_unrun
from grader.cli.say import say_beside
from grader.errors import GraderError
from grader.report.unwalled import without_sandbox
from grader.rubric.load import LoadedRubric
from grader.rubric.needs import needs_ros

if TYPE_CHECKING:
    from grader.arena.sandbox import Mode


def say_unwalled(mode: Mode, rubric: LoadedRubric | None = None) -> None:
    """Say it on stderr, where it is so. Nothing of a rubric for which nothing is run; what keeps a sandbox from being
    chosen is said by the grading itself."""
    with suppress(GraderError):
        if (rubric is not None and not needs_ros(rubric)) or why_unrun():
            return
        from grader.arena.probe import choose  # noqa: PLC0415 - where nothing is run, nobody needs it

        words = without_sandbox(choose(mode).label)
        if words:
            say_beside(words)
