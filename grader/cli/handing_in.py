"""Shows what git lacks of what was checked. git is asked beside the grading, which never waits long for it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.text import Text

from grader.cli.output import say_beside
from grader.model.result import Point, Standing
from grader.report.terminal import emit
from grader.report.text import line
from grader.student.git_status import advise, read_environment

TITLE = "What is marked is what is pushed. It differs from what was checked:"
REMARKS = "Handing in"
LIMIT = 300
PATIENCE_S = 10.0


class Inquiry:
    """Asks git about the package in `package`, in a thread that ends with the program."""

    def __init__(self, package: Path, base: Path) -> None:
        self._package, self._base = package, base
        self._environment = read_environment(os.environ, Path.cwd())
        self._found = Standing()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    def result(self) -> Standing:
        """What there is to say; nothing where git does not come back."""
        self._thread.join(PATIENCE_S)
        return self._found

    def _ask(self) -> None:
        self._found = advise(self._package, self._base, self._environment)


def news(found: Standing, told: set[str]) -> Standing:
    """What is not among the texts that were `told` already; it is from now on."""
    points = tuple(point for point in found.points if point.text not in told)
    summary = found.summary if found.summary not in told else ""
    told |= {found.summary, *(point.text for point in points)}
    return Standing(points=points, summary=summary)


def print_standing(found: Standing, console: Console) -> None:
    """Print it below a report."""
    emit(console, _parts(found, console.encoding))


def print_beside(found: Standing) -> None:
    """Print it to stderr, where stdout is for a program."""
    for point in found.points:
        say_beside(point.text)


def _parts(found: Standing, encoding: str) -> Iterator[RenderableType]:
    if found.summary:
        yield Text(f"\n{_fitted(found.summary, encoding)}", "dim")
    differing = [point for point in found.points if not point.remark]
    remarks = [point for point in found.points if point.remark]
    for title, points in ((TITLE, differing), (REMARKS, remarks)):
        if points:
            yield Text(f"\n{title}", "bold")
        for point in points:
            yield from _point(point, encoding)


def _point(point: Point, encoding: str) -> Iterator[RenderableType]:
    yield Padding(Text(_fitted(point.text, encoding)), (0, 0, 0, 2))
    for command in filter(None, point.mend.split(" && ")):
        yield Padding(Text(_fitted(command, encoding), "bold"), (0, 0, 0, 6))


def _fitted(text: str, encoding: str) -> str:
    return line(text, LIMIT).encode(encoding, "backslashreplace").decode(encoding)
