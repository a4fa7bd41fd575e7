"""`grader explain NAME`: a check, or a criterion with its check."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from rich.padding import Padding
from rich.text import Text

from grader.checks import CHECKS, HEADINGS, Check
from grader.errors import ExitCode, UsageError
from grader.report.terminal import emit, open_console
from grader.report.text import number, visible
from grader.rubric.faults import did_you_mean
from grader.rubric.find import rubric_ids
from grader.rubric.load import all_rubrics, load_rubric
from grader.rubric.model import Criterion, Rubric


def run(*, name: str) -> ExitCode:
    """Print what, why, how measured and how to fix. Raises UsageError for a name that nobody has."""
    lab, slash, criterion = name.rpartition("/")
    rubrics = [load_rubric(lab).rubric] if slash else [loaded.rubric for loaded in all_rubrics()]
    found = [(r, c) for r in rubrics for c in r.criteria if c.id == criterion and c.visibility == "visible"]
    if not slash and name in CHECKS:
        _print(_check_lines(CHECKS[name]))
    for rubric, item in found:
        _print(_criterion_lines(rubric, item))
    if not found and (slash or name not in CHECKS):
        raise _unknown(name, rubrics)
    return ExitCode.PASSED


def _unknown(name: str, rubrics: list[Rubric]) -> UsageError:
    known = [*CHECKS, *(c.id for r in rubrics for c in r.criteria), *(f"{i}/" for i in rubric_ids())]
    near = did_you_mean(name.rpartition("/")[2], known)
    return UsageError(
        f'there is no check and no criterion "{name}"{near}',
        hint="name a check, a criterion of a lab, or LAB/criterion; grader labs lists the labs",
    )


Line = tuple[str, int]


def _criterion_lines(rubric: Rubric, criterion: Criterion) -> Iterator[Line]:
    yield f"{rubric.id}/{criterion.id}: {criterion.title}", 0
    points = f"{number(criterion.points)} of {number(rubric.max_points)} points"
    yield f"{points}, judged by the check {criterion.check}", 2
    if criterion.hint:
        yield f"hint: {criterion.hint}", 2
    if criterion.reproduce:
        yield f"see it yourself: {criterion.reproduce}", 2
    yield "", 0
    if criterion.check in CHECKS:
        yield from _check_lines(CHECKS[criterion.check])


def _check_lines(check: Check) -> Iterator[Line]:
    yield f"{check.name}: {check.title}", 0
    for heading in HEADINGS:
        if heading in check.sections:
            yield "", 0
            yield heading, 0
            for paragraph in check.sections[heading].split("\n\n"):
                yield paragraph, 2
    yield "", 0


def _print(lines: Iterator[Line]) -> None:
    parts = [Padding(Text(visible(text) or " "), (0, 0, 0, indent)) for text, indent in lines]
    emit(open_console(sys.stdout), parts)
