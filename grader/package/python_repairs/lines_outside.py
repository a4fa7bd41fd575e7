"""Lines of a function that are not indented, and so are outside of it.

It runs in a child process as `examine.py` does: the standard library only.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from itertools import takewhile

from grader.package.python_repairs.names import bound_in
from grader.package.python_repairs.syntax import Step, last_name, nodes_in, step_to, tree_of

LOOPED = frozenset({"is_shutdown", "sleep", "spin"})


def with_lines_inside(text: str) -> Iterator[Step]:
    """`rospy.spin()`, or a loop with the lines above it, below the function that they belong to, and outside of it."""
    tree, lines = tree_of(text), text.split("\n")
    shared = {name for one in tree.body for name in bound_in(one) if _is_plain(one)}
    for place, function in enumerate(tree.body):
        below = [*takewhile(_is_run, tree.body[place + 1 :])]
        if not isinstance(function, ast.FunctionDef) or not below:
            continue
        calls = {last_name(n.func) for n in nodes_in(function) if isinstance(n, ast.Call)}
        last = below[0] if "init_node" in calls and _is_spin(below[0], function) else None
        loop = next((one for one in below if isinstance(one, ast.While)), None)
        if loop is not None and _needs(loop, function, bound_in(function) - shared):
            last = loop
        if last is not None and not calls & LOOPED:
            first, end = below[0].lineno - 1, last.end_lineno or last.lineno
            above = lines[function.body[-1].lineno - 1]
            blanks = above[: function.body[-1].col_offset]  # tabs, or spaces
            moved = [blanks + line if line.strip() else line for line in lines[first:end]]
            after = "\n".join([*lines[:first], *moved, *lines[end:]])
            yield from step_to("inside", below[0].lineno, text, after, function.name)
            return


def _is_spin(statement: ast.stmt, function: ast.FunctionDef) -> bool:
    """Return whether a statement right below a function is `rospy.spin()`."""
    call = statement.value if isinstance(statement, ast.Expr) else None
    spins = isinstance(call, ast.Call) and last_name(call.func) == "spin"
    return spins and statement.lineno == (function.end_lineno or 0) + 1


def _needs(loop: ast.While, function: ast.FunctionDef, own: AbstractSet[str]) -> bool:
    """Return whether a loop reads what only a function has that needs no arguments, and so is no callback."""
    used = {n.id for n in nodes_in(loop) if isinstance(n, ast.Name)}
    return bool(own & used) and len(function.args.args) == len(function.args.defaults)


def _is_plain(statement: ast.stmt) -> bool:
    return not isinstance(statement, ast.FunctionDef | ast.ClassDef)


def _is_run(statement: ast.stmt) -> bool:
    """Return whether a statement does something whatever the script is run as."""
    guard = isinstance(statement, ast.If) and "__name__" in ast.unparse(statement.test)
    return _is_plain(statement) and not guard and not isinstance(statement, ast.Import | ast.ImportFrom)
