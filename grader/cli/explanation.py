"""What `grader explain` prints: a check, or a criterion with its check."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from rich.padding import Padding
from rich.text import Text

from grader.checks import HEADINGS, Check
from grader.errors import UsageError
from grader.report.terminal import emit, open_console
from grader.report.text import visible
from grader.rubric.find import rubric_ids
from grader.rubric.instructor import known_checks
from grader.rubric.load import LoadedRubric, all_rubrics, load_rubric
from grader.rubric.model import Criterion
from grader.suggest import did_you_mean
from grader.wording import number

Line = tuple[str, int]
"""A paragraph and how far it is indented."""


def print_explanation(name: str, rubric: str | None) -> None:
    """Print what, why, how it is measured and how to fix it. Raises UsageError for an unknown name.

    The name is looked up in `rubric` beside the grader's own checks; `LAB/criterion` says the same.
    """
    lab, slash, criterion = ("", "", name) if rubric is not None else name.rpartition("/")
    loaded = [load_rubric(rubric or lab)] if rubric is not None or slash else list(all_rubrics())
    found = [
        (r, c) for r in loaded for c in r.rubric.criteria if c.id == criterion and c.visibility == "visible"
    ]
    known = loaded[0].checks if rubric is not None else known_checks(Path(), {})
    is_check = not slash and name in known
    if not found and not is_check:
        raise _unknown(name, loaded, known)
    checks = {name: known[name]} if is_check else {}
    for each, item in found:
        _print(_criterion_lines(each, item))
        checks |= {item.check: each.checks[item.check]} if item.check in each.checks else {}
    for check in checks.values():
        _print(_check_lines(check))


def _unknown(name: str, rubrics: list[LoadedRubric], checks: Mapping[str, Check]) -> UsageError:
    criteria = (c.id for r in rubrics for c in r.rubric.criteria if c.visibility == "visible")
    near = did_you_mean(name.rpartition("/")[2], [*checks, *criteria, *(f"{lab}/" for lab in rubric_ids())])
    return UsageError(
        f'there is no check or criterion "{name}"{near}',
        hint="give a check, a criterion of a lab, or LAB/criterion; grader labs lists the labs",
    )


def _criterion_lines(loaded: LoadedRubric, criterion: Criterion) -> Iterator[Line]:
    rubric = loaded.rubric
    yield f"{rubric.id}/{criterion.id}: {criterion.title}", 0
    points = f"{number(criterion.points)} of {number(rubric.max_points)} points"
    yield f"{points}, judged by the check {criterion.check}", 2
    if criterion.hint:
        yield f"hint: {criterion.hint}", 2
    if criterion.reproduce:
        yield f"see it yourself: {criterion.reproduce}", 2
    yield "", 0


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
