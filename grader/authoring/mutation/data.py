"""Where the values come from that a script publishes."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from grader.authoring.mutation.python import Script
from grader.authoring.mutation.ros import Endpoint, publish_calls

Assignment = ast.Assign | ast.AugAssign | ast.AnnAssign


def assignments(script: Script, names: Iterable[str]) -> list[Assignment]:
    """Those to one of the names or to a field of one (`msg.data` for `msg`)."""
    wanted = set(names)
    return [a for a in script.of(ast.stmt) if isinstance(a, Assignment) and targets(a) & wanted]


def targets(node: Assignment) -> set[str]:
    """What it assigns to, and the object of each field that it sets."""
    found = set()
    for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
        found.add(ast.unparse(target))
        if isinstance(target, ast.Attribute):
            found.add(ast.unparse(target.value))
    return found - {"self"}


def names_in(node: ast.AST | None) -> set[str]:
    """Variables and attributes that an expression reads, as source. What is called is none."""
    if node is None:
        return set()
    called = {n.func for n in ast.walk(node) if isinstance(n, ast.Call)}
    found = {
        ast.unparse(n) for n in ast.walk(node) if isinstance(n, ast.Name | ast.Attribute) and n not in called
    }
    return found - {"self", "rospy", "time", "str", "int", "float"}


def sources(script: Script, publisher: Endpoint) -> list[ast.expr]:
    """The expressions that make up what is published: the arguments, and what is assigned to their names."""
    found: list[ast.expr] = []
    for call in publish_calls(script, publisher):
        found += [*call.args, *(keyword.value for keyword in call.keywords)]
    names: set[str] = set()
    while new := {name for value in found for name in names_in(value)} - names:
        names |= new
        found += [a.value for a in assignments(script, new) if a.value is not None and a.value not in found]
    return found


def source_names(script: Script, publisher: Endpoint) -> set[str]:
    """The variables that what is published depends on."""
    return {name for value in sources(script, publisher) for name in names_in(value)}
