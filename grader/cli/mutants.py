"""Shows a rubric's test: a table, then whatever did not go as declared with its diff and its evidence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from grader.model.mutants import LostCriterion, MutantResult, RubricTest
from grader.report.terminal import emit, open_console
from grader.report.text import line, number, visible

MARKS = {
    "killed": ("✓", "green"),
    "survived": ("✗", "red"),
    "differs": ("✗", "red"),
    "inconclusive": ("?", "yellow"),
    "error": ("!", "red"),
}
TEXT_CHARS = 500
DIFF_STYLES = {"+": "green", "-": "red", "@": "cyan"}


def print_test(test: RubricTest, stream: IO[str]) -> None:
    """The whole test on a terminal or in a file."""
    parts: list[RenderableType] = [_table(test)] if test.mutants else []
    parts += list(_reference(test))
    for mutant in test.mutants:
        if mutant.state != "killed":
            parts += [Text(), *_open(mutant)]
    parts += [Text(), *_summary(test)]
    emit(open_console(stream), parts)


def _table(test: RubricTest) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="dim")
    for heading in ("", "mutant", "lost"):
        table.add_column(heading, no_wrap=heading == "")
    for mutant in test.mutants:
        mark, style = MARKS[mutant.state]
        state = Text(f"{mark} {mutant.state}", style)
        table.add_row(state, Text(visible(mutant.label)), Text(_lost(mutant)))
    return table


def _lost(mutant: MutantResult) -> str:
    """`chatter fail, chatter-rate blocked`."""
    return ", ".join(f"{c.id} {c.status}" for c in mutant.lost) or line(mutant.error, TEXT_CHARS) or "nothing"


def _reference(test: RubricTest) -> Iterator[Text]:
    if test.reference.lost:
        reached = f"{number(test.reference.points)} of {number(test.reference.max_points)} points"
        yield Text(f"The reference solution does not get everything: {reached}", "bold red")
        yield Text(f"  {visible(test.solution)}")
        yield from _criteria(test.reference.lost)
        yield from _evidence(test.reference.evidence)


def _open(mutant: MutantResult) -> Iterator[Text]:
    """A mutant that was not killed."""
    yield Text(f"{mutant.state}: {visible(mutant.label)}", "bold red")
    yield Text(f"  {visible(mutant.mistake)}")
    if mutant.error:
        yield Text(f"  not graded: {line(mutant.error, TEXT_CHARS)}")
    for words, names in (
        ("should cost, and does not", mutant.missing),
        ("should not cost, and does", mutant.surplus),
        ("has another status", mutant.differing),
    ):
        if names:
            yield Text(f"  {words}: {visible(', '.join(names))}", "yellow")
    yield from _criteria(mutant.lost)
    for row in mutant.diff.rstrip("\n").split("\n"):
        yield Text(f"    {line(row, TEXT_CHARS)}", DIFF_STYLES.get(row[:1], ""))
    yield from _evidence(mutant.evidence)


def _criteria(lost: tuple[LostCriterion, ...]) -> Iterator[Text]:
    for criterion in lost:
        yield Text(f"  {criterion.id} {criterion.status}: {line(criterion.message, TEXT_CHARS)}")


def _evidence(folder: str | None) -> Iterator[Text]:
    if folder is not None:
        yield Text(f"  evidence: {visible(folder)}")


def _summary(test: RubricTest) -> Iterator[Text]:
    for fault in test.unfit:
        yield Text(f"not tried: {visible(fault)}", "yellow")
    if test.uncosted:
        names = ", ".join(test.uncosted)
        yield Text(f"No mutant costs {names}: add mutants that do, to see that these criteria work", "red")
    killed = sum(mutant.state == "killed" for mutant in test.mutants)
    text = f"{test.rubric.id}: {killed} of {len(test.mutants)} mutants killed, {test.wall_s:.0f} s"
    yield Text(text, "bold green" if test.passed else "bold red")
