"""What a machine that cannot run ROS 1's nodes can do all the same, and how to get the rest."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from grader.arena.static_recorder import why_unrun
from grader.cli.row import Row
from grader.errors import RosMissing
from grader.portable import system

PAGE = "docs/how-to/without-ros.md"
WAYS = {
    "Windows": "WSL 2 or the Docker image",
    "macOS": "the Docker image",
    "": "grader doctor, RoboStack or the Docker image",
}
WITHOUT = "check --static, judge, report, explain, labs, rubric validate"
LACKS = "grade, record, and check beyond the files: ROS 1's nodes are run on Linux"


def nothing_runs() -> str:
    """Why `grader check` only looks at files on this machine; "" where it can run nodes."""
    with suppress(RosMissing):  # where ROS is not where it was said to be, the grading says so
        return why_unrun()
    return ""


def the_rest() -> tuple[str, str]:
    """Two lines that say how what was not run can be run."""
    here = f"Only your files were checked: {nothing_runs()}."
    way = WAYS.get(system(), WAYS["macOS"])
    return here, f"For the rest: {way}; see {PAGE}."


def elsewhere() -> Iterator[Row]:
    """What can and cannot be done on a system that is not Linux."""
    yield Row(name=system(), state="ok", detail=f"can: {WITHOUT}")
    way = WAYS.get(system(), WAYS["macOS"])
    yield Row(name="ROS 1", state="missing", detail=f"cannot: {LACKS}", mend=f"{way}; see {PAGE}")
