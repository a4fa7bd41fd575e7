"""The counter of a script: where it begins, steps, and goes back to its beginning."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field

from grader.authoring.mutation.data import assignments, source_names
from grader.authoring.mutation.python import Script
from grader.authoring.mutation.ros import Endpoint

INTEGER_TYPES = frozenset(f"{sign}{bits}" for sign in ("Int", "UInt") for bits in ("8", "16", "32", "64")) | {
    "Byte"
}
SMALLEST_LIMIT = 3


@dataclass(kw_only=True)
class Counter:
    """`limits` are the numbers that the counter is compared with or taken modulo; `resets` what it goes back to.

    `tests` are the `if` statements and conditional expressions that decide the reset.
    """

    starts: list[ast.Constant] = field(default_factory=list)
    steps: list[ast.Constant] = field(default_factory=list)
    limits: list[ast.Constant] = field(default_factory=list)
    resets: list[ast.Constant] = field(default_factory=list)
    tests: list[ast.If | ast.IfExp] = field(default_factory=list)
    modulos: list[ast.BinOp] = field(default_factory=list)


def find_counter(script: Script, publisher: Endpoint) -> Counter | None:
    """The counter that feeds an integer topic; None where nothing is counted in a way that can be read."""
    if publisher.type_name not in INTEGER_TYPES:
        return None
    names = counted_names(script, publisher)
    if not names:
        return None
    counter = Counter(steps=[step for name in sorted(names) for step in _steps(script, name)])
    for assignment in assignments(script, names):
        _take(script, counter, assignment, names)
    counter.limits += [c.right for c in counter.modulos if isinstance(c.right, ast.Constant)]
    return counter


def _steps(script: Script, name: str) -> list[ast.Constant]:
    """The numbers that are added to it."""
    found = []
    for assignment in assignments(script, [name]):
        if isinstance(assignment, ast.AugAssign) and isinstance(assignment.op, ast.Add):
            found.append(assignment.value)
        elif assignment.value is not None:
            sums = [
                n
                for n in ast.walk(assignment.value)
                if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Add)
            ]
            found += [n.right for n in sums if ast.unparse(n.left) == name]
    return [step for step in found if _whole_number(step) is not None and isinstance(step, ast.Constant)]


def _take(script: Script, counter: Counter, assignment: ast.AST, names: set[str]) -> None:
    value = assignment.value  # type: ignore[attr-defined]
    test = _test(script, assignment, names)
    choice = value if isinstance(value, ast.IfExp) and _compares(value.test, names) else None
    if (
        isinstance(value, ast.Constant)
        and _whole_number(value) is not None
        and isinstance(assignment, ast.Assign)
    ):
        (counter.starts if test is None else counter.resets).append(value)
    if choice is not None:
        counter.resets += [v for v in (choice.body, choice.orelse) if isinstance(v, ast.Constant)]
    for found in (test, choice):
        if found is not None and found not in counter.tests and _resets(found, names):
            counter.tests.append(found)
            counter.limits += _limits(found.test)
    counter.modulos += [
        n
        for n in (ast.walk(value) if value is not None else ())
        if isinstance(n, ast.BinOp)
        and isinstance(n.op, ast.Mod)
        and (_whole_number(n.right) or 0) >= SMALLEST_LIMIT
    ]


def _test(script: Script, assignment: ast.AST, names: set[str]) -> ast.If | None:
    around = (n for n in script.above(assignment) if isinstance(n, ast.If))
    return next((n for n in around if _compares(n.test, names)), None)


def _compares(test: ast.expr, names: set[str]) -> bool:
    return any(isinstance(n, ast.Compare) for n in ast.walk(test)) and any(
        ast.unparse(n) in names for n in ast.walk(test) if isinstance(n, ast.Name | ast.Attribute)
    )


def _resets(test: ast.If | ast.IfExp, names: set[str]) -> bool:
    """Whether one of its branches gives the counter a fixed number."""
    if isinstance(test, ast.IfExp):
        return any(isinstance(v, ast.Constant) for v in (test.body, test.orelse))
    inner = [n for s in (*test.body, *test.orelse) for n in ast.walk(s) if isinstance(n, ast.Assign)]
    return any(isinstance(a.value, ast.Constant) and ast.unparse(a.targets[0]) in names for a in inner)


def _limits(test: ast.expr) -> list[ast.Constant]:
    numbers = [n for n in ast.walk(test) if isinstance(n, ast.Constant)]
    return [n for n in numbers if (_whole_number(n) or 0) >= SMALLEST_LIMIT]


def _whole_number(node: ast.AST) -> int | None:
    value = node.value if isinstance(node, ast.Constant) else None
    return value if isinstance(value, int) and not isinstance(value, bool) else None


def counted_names(script: Script, publisher: Endpoint) -> set[str]:
    """The variables that are published and counted up."""
    return {name for name in source_names(script, publisher) if _steps(script, name)}
