"""What `grader explain` prints: a check, or a criterion with its check."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from rich.padding import Padding
from rich.text import Text

from grader.checks import HEADINGS, Check
from grader.errors import UsageError
from grader.model.record import Record
from grader.model.repair import BY_HAND, RepairKind
from grader.report.terminal import emit, open_console
from grader.report.text import visible
from grader.report.view import see_words
from grader.rubric.find import known_labs
from grader.rubric.load import LoadedRubric, all_rubrics, load_rubric
from grader.rubric.model import Criterion, Rubric
from grader.rubric.own_checks import known_checks
from grader.rubric.schema import REQUIRED, inner_records, parameters
from grader.wording import did_you_mean, number

Paragraph = tuple[str, int]
"""A paragraph and how far it is indented."""

SLIPS: tuple[tuple[tuple[str, ...], tuple[RepairKind, ...]], ...] = (
    (("executable",), ("executable-bit", "line-ends", "shebang", "byte-order-mark", "encoding", "file-name")),
    (("build", "cmake"), ("build-line", "package-name", "manifest-line")),
    (("manifest", "dependencies"), ("manifest-line", "package-name")),
    (("launch", "opens"), ("launch-syntax", "launch-type", "package-name", "file-name", "executable-bit")),
    (("param",), ("parameter-name", "python-syntax")),
    (("service", "calls", "action"), ("service-name", "python-syntax", "missing-import", "missing-call")),
    (("node",), ("node-name", "python-syntax", "missing-import", "missing-call")),
    (
        ("topic", "rate", "message", "hears"),
        ("topic-name", "python-syntax", "missing-import", "missing-call"),
    ),
)
"""By what the name of a check begins with: the slips that often cost it."""


def print_explanation(name: str, rubric: str | None) -> None:
    """Print how to fix it and what is checked; of a check, also why, how it is measured and what a rubric can set.
    Raises UsageError for an unknown name.

    Of a criterion, the rest stays behind a line that says where it is: most terminals show 24 lines. The name is
    looked up in `rubric` beside the grader's own checks; `LAB/criterion` says the same.
    """
    lab, slash, criterion = ("", "", name) if rubric is not None else name.rpartition("/")
    loaded = [load_rubric(rubric or lab)] if rubric is not None or slash else list(all_rubrics())
    # students ask here: hidden criteria are as if there were none
    found = [
        (r, c) for r in loaded for c in r.rubric.criteria if c.id == criterion and c.visibility == "visible"
    ]
    known = loaded[0].checks if rubric is not None else known_checks(Path(), {})
    told = {name} if not slash and name in known else set[str]()
    if not found and not told:
        raise _unknown(name, loaded, known)
    for check in tuple(told):
        _print(_check_lines(known[check]))
    for each, item in found:
        _print(_criterion_lines(each.rubric, item))
        if item.check in each.checks and item.check not in told:
            told.add(item.check)
            asked = [] if rubric is None or item.check in known_checks(Path(), {}) else ["--rubric", rubric]
            _print(
                _check_lines(
                    each.checks[item.check], more=shlex.join(["grader", "explain", item.check, *asked])
                )
            )


def _unknown(name: str, rubrics: list[LoadedRubric], checks: Mapping[str, Check]) -> UsageError:
    criteria = (c.id for r in rubrics for c in r.rubric.criteria if c.visibility == "visible")
    near = did_you_mean(
        name.rpartition("/")[2], [*checks, *criteria, *(f"{lab.id}/" for lab in known_labs())]
    )
    return UsageError(
        f'there is no check or criterion "{name}"{near}',
        hint="give a check, a criterion of a lab, or LAB/criterion; grader labs lists the labs",
    )


def _criterion_lines(rubric: Rubric, criterion: Criterion) -> Iterator[Paragraph]:
    yield f"{rubric.id}/{criterion.id}: {criterion.title}", 0
    yield f"{worth_of(criterion, rubric)}, judged by the check {criterion.check}", 2
    if criterion.hint:
        yield f"hint: {criterion.hint}", 2
    if criterion.reproduce:
        yield f"see it yourself: {see_words(criterion.reproduce)}", 2
    yield "", 0


def worth_of(criterion: Criterion, rubric: Rubric) -> str:
    """Return `10 of 100 points, the best 3 of 4 count`, or `a bonus of 5 points`."""
    if criterion.extra:
        return f"a {'bonus' if criterion.bonus else 'penalty'} of {number(abs(criterion.extra))} points"
    said = [f"{number(criterion.points)} of {number(rubric.max_points)} points"]
    said += [
        f"the best {group.best} of {len(group.criteria)} in {name} count"
        for name, group in rubric.groups.items()
        if group.best and criterion.id in group.criteria
    ]
    said += [
        f"without it at most {number(gate.at_most)} points count"
        for gate in rubric.gates
        if gate.criterion == criterion.id
    ]
    return ", ".join(said)


def _check_lines(check: Check, *, more: str = "") -> Iterator[Paragraph]:
    """Yield all about a check; with `more`, the command that prints all, only what helps to fix it."""
    yield f"{check.name}: {check.title}", 0
    what, *measured, fix = HEADINGS
    yield from _section(check, fix)
    slips = next((kinds for names, kinds in SLIPS if check.name.startswith(names)), ())
    if slips:
        yield "", 0
        yield "Common mistakes, and how to repair them by hand", 0
        for kind in slips:
            yield BY_HAND[kind], 2
    yield from _section(check, what)
    if more:
        yield "", 0
        yield f"Why it matters, and how it is measured: {more}", 0
        yield "", 0
        return
    for heading in measured:
        yield from _section(check, heading)
    yield from _parameter_lines(check.params, "What a rubric can set")
    for record, words in inner_records(check.params).items():
        yield from _parameter_lines(record, f"Keys of {words}")
    yield "", 0


def _section(check: Check, heading: str) -> Iterator[Paragraph]:
    if heading in check.sections:
        yield "", 0
        yield heading, 0
        for paragraph in check.sections[heading].split("\n\n"):
            yield paragraph, 2


def _parameter_lines(record: type[Record], heading: str) -> Iterator[Paragraph]:
    rows = parameters(record)
    if rows:
        yield "", 0
        yield heading, 0
    for one in rows:
        default = REQUIRED if one.default == REQUIRED else f"default {one.default}"
        yield f"{one.name} ({one.type}; {default}): {one.meaning}".replace("`", ""), 2


def _print(lines: Iterator[Paragraph]) -> None:
    parts = [Padding(Text(visible(text) or " "), (0, 0, 0, indent)) for text, indent in lines]
    emit(open_console(sys.stdout), parts)
