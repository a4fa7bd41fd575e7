"""Counters that count otherwise."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from pydantic import Field

from grader.authoring.mutation.counter import Counter, find_counter
from grader.authoring.mutation.python import Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import publishers
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit
from grader.model.record import Record


class ByParams(Record):
    """`by`: how far from the right number."""

    by: int = Field(default=1, ge=1)


class EarlyParams(Record):
    """`by`: how many numbers too early."""

    by: int = Field(default=28, ge=2)


def _sites(solution: Solution, change: Callable[[Script, Counter], list[Edit]]) -> Iterator[Site]:
    for script in solution.scripts:
        for publisher in publishers(script):
            counter = find_counter(script, publisher)
            edits = change(script, counter) if counter is not None else []
            if edits:
                line = script.text.count("\n", 0, min(edits).start) + 1
                yield Site(
                    at={"script": script.path, "topic": publisher.topic},
                    tree=solution.edited(script.path, edits),
                    line=line,
                )


def _add(script: Script, constants: list[ast.Constant], number: int) -> list[Edit]:
    """Each of the constants once, changed by `number`."""
    distinct = {script.span(c): c for c in constants if isinstance(c.value, int)}
    return [script.replace(c, str(c.value + number)) for c in distinct.values() if isinstance(c.value, int)]


def _set(script: Script, constants: list[ast.Constant], number: int) -> list[Edit]:
    return [script.replace(c, str(number)) for c in {script.span(c): c for c in constants}.values()]


@operator("counter-from-one")
def counter_from_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Begins to count at 1.

    Fits every integer topic that is fed by a counter with a first value.
    """
    yield from _sites(solution, lambda script, counter: _set(script, counter.starts, 1))


@operator("counter-skips", params=ByParams)
def counter_skips(solution: Solution, params: ByParams) -> Iterator[Site]:
    """Counts in steps that are too large.

    Fits every integer topic that is fed by a counter.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.steps, params.by))


@operator("reset-early", params=EarlyParams)
def reset_early(solution: Solution, params: EarlyParams) -> Iterator[Site]:
    """Goes back to the beginning too early.

    Fits every counter with a limit that is written as a number.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.limits, -params.by))


@operator("reset-late", params=ByParams)
def reset_late(solution: Solution, params: ByParams) -> Iterator[Site]:
    """Goes back to the beginning too late.

    Fits every counter with a limit that is written as a number.
    """
    yield from _sites(solution, lambda script, counter: _add(script, counter.limits, params.by))


@operator("reset-to-one")
def reset_to_one(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Goes back to 1.

    Fits every counter that is set back, or taken modulo a number.
    """
    yield from _sites(solution, lambda script, counter: _back_to(script, counter, 1))


@operator("wrap-to-minus-128")
def wrap_to_minus_128(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Goes on at -128, as an 8-bit integer of C does.

    Fits every counter that is set back, or taken modulo a number.
    """
    yield from _sites(solution, lambda script, counter: _back_to(script, counter, -128))


def _back_to(script: Script, counter: Counter, number: int) -> list[Edit]:
    edits = _set(script, counter.resets, number)
    for modulo in counter.modulos:
        if isinstance(modulo.right, ast.Constant) and isinstance(modulo.right.value, int):
            limit, value = modulo.right.value, script.source(modulo.left)
            edits.append(script.replace(modulo, f"({value} if {value} < {limit} else {number})"))
    return edits


@operator("never-reset")
def never_reset(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Never goes back to the beginning.

    Fits every counter that is set back by an `if`, or taken modulo a number.
    """
    yield from _sites(solution, _without_reset)


def _without_reset(script: Script, counter: Counter) -> list[Edit]:
    edits = [script.replace(modulo, script.source(modulo.left)) for modulo in counter.modulos]
    for test in counter.tests:
        if isinstance(test, ast.If):
            edits += _without_if(script, test)
        else:
            counted = test.orelse if isinstance(test.body, ast.Constant) else test.body
            edits.append(script.replace(test, script.source(counted)))
    return edits


def _without_if(script: Script, test: ast.If) -> list[Edit]:
    """What is left where the branch that sets back is never taken."""
    if not script.has_lines(test):
        return []
    counts = [b for b in (test.body, test.orelse) if b and not _sets_back(b)]
    if not counts:
        return [script.remove(test)]
    lines = [script.source(statement) for statement in counts[0]]
    return [script.replace(test, f"\n{script.indentation(test)}".join(lines))]


def _sets_back(block: list[ast.stmt]) -> bool:
    return any(isinstance(s, ast.Assign) and isinstance(s.value, ast.Constant) for s in block)
