"""When messages come."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from grader.authoring.mutation.python import Function, Script
from grader.authoring.mutation.registry import NoParams, operator
from grader.authoring.mutation.ros import argument, calls, last_name, literal, loops, rate_sleeps
from grader.authoring.mutation.solution import Site, Solution
from grader.authoring.mutation.spans import Edit
from grader.model.record import Record


class RateParams(Record):
    """`factor`: how many times as fast as it should be."""

    factor: float = Field(default=0.5, gt=0)


class BurstParams(Record):
    """`count`: how many messages at once."""

    count: int = Field(default=10, ge=2)


@dataclass(frozen=True, kw_only=True)
class Pace:
    """A number that sets how often something happens: a rate in Hz, or a period in seconds."""

    node: ast.expr
    value: float
    unit: Literal["hz", "s"]

    def times(self, factor: float) -> str:
        """The number, as source, for `factor` times as often."""
        value = self.value * factor if self.unit == "hz" else self.value / factor
        return f"{value:.6g}"


def paces(script: Script) -> list[Pace]:
    """Rates, timers' periods, and sleeps in a loop."""
    found = [_pace(script, argument(call, 0, "hz"), "hz") for call in calls(script, "Rate")]
    for call in calls(script, "Timer"):
        period = argument(call, 0, "period")
        within = [c.args[0] for c in ast.walk(period or call) if isinstance(c, ast.Call) and _is_duration(c)]
        found += [_pace(script, node, "s") for node in within]
    for call in calls(script, "sleep"):
        if call.args and any(isinstance(n, ast.While | ast.For) for n in script.above(call)):
            found.append(_pace(script, call.args[0], "s"))
    return [pace for pace in found if pace is not None]


def _is_duration(call: ast.Call) -> bool:
    return last_name(call.func) in {"Duration", "from_sec"} and bool(call.args)


def _pace(script: Script, node: ast.expr | None, unit: Literal["hz", "s"]) -> Pace | None:
    """`node` may be a constant, the name of one, or a quotient such as `1.0 / 10`."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        above, below = _number(node.left), _number(node.right)
        return Pace(node=node, value=above / below, unit=unit) if above and below else None
    if isinstance(node, ast.Call) and _is_duration(node):
        return _pace(script, node.args[0], unit)
    constant = literal(script, node)
    value = _number(constant)
    return Pace(node=constant, value=value, unit=unit) if constant and value else None


def _number(node: ast.AST | None) -> float:
    value = node.value if isinstance(node, ast.Constant) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else 0.0


def _site(solution: Solution, script: Script, edits: Sequence[Edit], line: int) -> Site:
    return Site(at={"script": script.path}, tree=solution.edited(script.path, edits), line=line)


@operator("other-rate", params=RateParams)
def other_rate(solution: Solution, params: RateParams) -> Iterator[Site]:
    """Publishes at another rate.

    Fits every script with a rate, a timer, or a sleep in a loop.
    """
    for script in solution.scripts:
        for pace in paces(script):
            edit = script.replace(pace.node, pace.times(params.factor))
            yield _site(solution, script, [edit], pace.node.lineno)


@operator("burst", params=BurstParams)
def burst(solution: Solution, params: BurstParams) -> Iterator[Site]:
    """Sends many messages at once and then none for long, with the right number in the mean.

    Fits every script with a rate, a timer, or a sleep in a loop that publishes.
    """
    for script in solution.scripts:
        for pace in paces(script)[:1]:
            for statements in _turns(script):
                slower = script.replace(pace.node, pace.times(1 / params.count))
                repeated = script.wrap(statements, f"for _ in range({params.count}):")
                yield _site(solution, script, [slower, repeated], statements[0].lineno)


def _turns(script: Script) -> Iterator[list[ast.stmt]]:
    """What a loop or a timer's callback does in each turn, without the sleep."""
    names = {last_name(a) for call in calls(script, "Timer") if (a := argument(call, 1, "callback"))}
    bodies = [loop.body for loop in loops(script)]
    bodies += [f.body for f in script.of(ast.FunctionDef) if f.name in names]
    for body in bodies:
        kept = [s for s in body if not (_sleeps(s) or _declares(s))]
        together = body[body.index(kept[0]) : body.index(kept[-1]) + 1] == kept if kept else False
        publishes = any(last_name(c.func) == "publish" for c in _calls_in(script, kept))
        if together and publishes and script.can_wrap(kept):
            yield kept


def _declares(statement: ast.stmt) -> bool:
    """A docstring, or names of variables from outside."""
    text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return text or isinstance(statement, ast.Global | ast.Nonlocal)


def _sleeps(statement: ast.stmt) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) == "sleep" for n in ast.walk(statement))


def _calls_in(script: Script, statements: Sequence[ast.stmt]) -> Iterator[ast.Call]:
    """The calls in the statements, and in the script's own functions that they call."""
    own = {f.name: f for f in script.of(ast.FunctionDef)}
    waiting: list[ast.AST] = list(statements)
    seen: set[Function] = set()
    while waiting:
        for node in ast.walk(waiting.pop()):
            if isinstance(node, ast.Call):
                yield node
                called = own.get(last_name(node.func))
                if called is not None and called not in seen:
                    seen.add(called)
                    waiting.append(called)


@operator("sleep-without-brackets")
def sleep_without_brackets(solution: Solution, _params: NoParams) -> Iterator[Site]:
    """Names rate.sleep but does not call it, so that the loop floods its topics.

    Fits every script with a statement rate.sleep().
    """
    for script in solution.scripts:
        for statement in rate_sleeps(script):
            if isinstance(statement.value, ast.Call):
                edit = script.replace(statement, script.source(statement.value.func))
                yield _site(solution, script, [edit], statement.lineno)
