"""Repairs of functions that give values to variables of their own, where those of the whole file are meant.

It runs in a child process as `examine.py` does: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Literal, NamedTuple

from grader.package.python_repairs.syntax import Step, is_docstring, nodes_in, step_to, tree_of


class Unbound(NamedTuple):
    """Variables of the file to which a function gives values of its own, in the order in which they stand there: one of
    them is read before it has one (`unbound`), or all only elsewhere, where they keep their old ones (`kept`). `first`
    is the function's first line."""

    function: ast.FunctionDef
    names: list[str]
    first: ast.stmt
    cause: Literal["unbound", "kept"]


def with_globals(text: str) -> Iterator[Step]:
    """The word of a step is the function's name, then those of its variables."""
    lines = text.split("\n")
    for found in _unbound_variables(tree_of(text)):
        at, names, after = found.first.lineno - 1, ", ".join(found.names), [*lines]
        blanks = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
        after.insert(at, f"{blanks}global {names}")
        word = f"{found.function.name}, {names}"
        for step in step_to(found.cause, found.first.lineno, text, "\n".join(after), word):
            yield step
            yield from with_globals(step["text"])
            return


def _unbound_variables(tree: ast.Module) -> Iterator[Unbound]:
    """Yield functions with variables of the whole file to which they give a value without a `global`, and which they
    have read before, or which others read: then they never read it themselves, or nothing else changes it."""
    assigned = [one for one in tree.body if isinstance(one, ast.Assign | ast.AnnAssign)]
    shared = {name for one in assigned for name in _targets(one)}
    plain = {name for one in assigned if isinstance(one.value, ast.Constant) for name in _targets(one)}
    states = plain - {name for n in nodes_in(tree) if isinstance(n, ast.Global) for name in n.names}
    for function in (n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)):
        inner = (n for n in nodes_in(function)[1:] if isinstance(n, ast.FunctionDef | ast.Lambda))
        nodes = set(nodes_in(function)) - {n for one in inner for n in nodes_in(one)}
        own = {n.arg for n in nodes_in(function.args) if isinstance(n, ast.arg)}
        own |= {name for n in nodes if isinstance(n, ast.Global | ast.Nonlocal) for name in n.names}
        first = next((s for s in function.body if not is_docstring(s)), None)
        uses = {name: sorted(_reads_and_writes(nodes, name)) for name in shared - own}
        read_first = {n for n, all_ in uses.items() if all_ and not all_[0][1] and any(w for _, w in all_)}
        given = [n for n, all_ in uses.items() if all_ and all_[0][1] and _is_read_outside(tree, n, function)]
        kept = {name for name in given if name in states or all(at[1] == 1 for at, _ in uses[name])}
        if first is not None and first.lineno > function.lineno and read_first | kept:
            # beside one that is meant to be the file's, another that the function reads itself is meant to be, too
            names = sorted(read_first.union(given), key=lambda name: (uses[name][0], name))
            yield Unbound(function, names, first, "unbound" if read_first else "kept")


def _targets(one: ast.Assign | ast.AnnAssign) -> list[str]:
    targets = one.targets if isinstance(one, ast.Assign) else [one.target]
    return [target.id for target in targets if isinstance(target, ast.Name)]


def _is_read_outside(tree: ast.Module, name: str, function: ast.FunctionDef) -> bool:
    """Return whether the file's own variable is read outside of a function that has one of that name."""
    inside = {*nodes_in(function)}
    for one in nodes_in(tree):
        if isinstance(one, ast.FunctionDef) and one not in inside and _has_its_own(one, name):
            inside |= {*nodes_in(one)}
    names = (n for n in nodes_in(tree) if isinstance(n, ast.Name) and n.id == name)
    reads = {n for n in names if isinstance(n.ctx, ast.Load)}
    return bool(reads - inside)


def _has_its_own(function: ast.FunctionDef, name: str) -> bool:
    """Return whether a function takes a variable of that name, or gives it a value without a `global`."""
    nodes = list(nodes_in(function))
    given = any(isinstance(n, ast.Name) and n.id == name and not isinstance(n.ctx, ast.Load) for n in nodes)
    shared = any(isinstance(n, ast.Global) and name in n.names for n in nodes)
    return any(isinstance(n, ast.arg) and n.arg == name for n in nodes) or (given and not shared)


def _reads_and_writes(nodes: set[ast.AST], name: str) -> Iterator[tuple[tuple[int, int], bool]]:
    """Yield line and kind of each use. What is on one line is read before it is written, but for a loop's variable."""
    loops = {n for one in nodes if isinstance(one, ast.For | ast.comprehension) for n in nodes_in(one.target)}
    for node in nodes:
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name) and node.target.id == name:
            yield (node.lineno, 0), False
        if isinstance(node, ast.Name) and node.id == name:
            written = not isinstance(node.ctx, ast.Load)
            yield (node.lineno, -1 if node in loops else int(written)), written
