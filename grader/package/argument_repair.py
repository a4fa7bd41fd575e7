"""Finds arguments that ROS's calls do not take as they are written, and variables that a function keeps for itself.

A tree comes in. Out go mistakes: the expressions of each with what belongs in their place, and why; for variables, the
lines above which a `global` is missing. What is said of them, and how a text is changed, is `source_repair.py`'s part;
as that, it runs in a child process with the standard library only, and executes nothing.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import NamedTuple, TypeGuard

from grader.package.syntax_repair import is_docstring


class Argument(NamedTuple):
    """`edits` are expressions and what belongs in their place, all on one line."""

    edits: list[tuple[ast.expr, str]]
    why: str


class Unbound(NamedTuple):
    """A variable that is read where the function has not given it its value; `first` is the function's first line."""

    name: str
    first: ast.stmt


def wrong_arguments(tree: ast.Module) -> Iterator[Argument]:
    """Yield what calls of rospy's are given in another form than they take it."""
    types, of_rospy = _imported(tree, "msg"), _imported(tree, "rospy")
    functions = {one.name for one in tree.body if isinstance(one, ast.FunctionDef)}
    values = [(t, n.value) for n in ast.walk(tree) if isinstance(n, ast.Assign) for t in n.targets]
    rates = {ast.unparse(target) for target, value in values if _called(value) == "Rate"}
    for call in (n for n in ast.walk(tree) if isinstance(n, ast.Call)):
        name = _called(call)
        if name == "sleep" and isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value) in rates:
            if call.args:
                yield Argument(
                    [(call, f"{ast.unparse(call.func)}()")], "a Rate already knows how long to sleep"
                )
        elif _is_rospys(call.func, of_rospy):
            yield from _of_topic(call, types) if name in {"Publisher", "Subscriber"} else ()
            yield from _numbers(call, name)
            yield from _callback(call, name, functions)
            yield from _without_quotes(call, name, functions)


def _of_topic(call: ast.Call, types: set[str]) -> Iterator[Argument]:
    """Of `Publisher` and `Subscriber`, which take a topic's name and a class."""
    first, second, *_ = [*call.args, None, None]
    if isinstance(first, ast.Name) and _is_type(first.id, types) and _is_text(second):
        yield Argument(
            [(first, repr(second.value)), (second, first.id)], "the topic's name comes first, then its type"
        )
        return
    given = next((k.value for k in call.keywords if k.arg == "data_class"), second)
    name = ast.unparse(given.func) if isinstance(given, ast.Call) and not given.args else ""
    if _is_text(given) and _is_type(given.value, types):
        yield Argument([(given, given.value)], "the type is given as a string")
    elif given is not None and _is_type(name, types):
        yield Argument([(given, name)], f"`{name}()` is a message, not a type")


def _numbers(call: ast.Call, name: str) -> Iterator[Argument]:
    size = next((k.value for k in call.keywords if k.arg == "queue_size"), None)
    first = call.args[0] if call.args else None
    if _is_text(size) and size.value.isdigit():
        yield Argument([(size, size.value)], "`queue_size` is a string")
    elif name in {"Rate", "sleep"} and _is_text(first) and first.value.replace(".", "", 1).isdigit():
        yield Argument([(first, first.value)], f"`rospy.{name}` takes a number, not a string")
    elif name == "Timer" and isinstance(call.func, ast.Attribute) and first is not None and _is_number(first):
        owner = ast.unparse(call.func.value)
        edit = (first, f"{owner}.Duration({ast.unparse(first)})")
        yield Argument([edit], "a Timer takes a Duration, not a number")


def _callback(call: ast.Call, name: str, functions: set[str]) -> Iterator[Argument]:
    place = {"Subscriber": 2, "Service": 2, "Timer": 1, "on_shutdown": 0}.get(name)
    if place is not None:
        words = {"callback", "handler", "h"}
        given = [*call.args[place : place + 1], *(k.value for k in call.keywords if k.arg in words)]
        for one in given:
            if _is_text(one) and one.value in functions:
                yield Argument([(one, one.value)], f"'{one.value}' is a string, not a function")


def _without_quotes(call: ast.Call, name: str, functions: set[str]) -> Iterator[Argument]:
    """Of a node's or topic's name that is written without quotes, and is the name of a function."""
    first = call.args[0] if call.args and name in {"init_node", "Publisher", "Subscriber"} else None
    if isinstance(first, ast.Name) and first.id in functions:
        what = "node" if name == "init_node" else "topic"
        yield Argument([(first, repr(first.id))], f"the name of the {what} has no quotes")


def unbound_variables(tree: ast.Module) -> Iterator[Unbound]:
    """Yield variables of the whole file that a function reads, and then gives a value to without a `global`."""
    shared = {
        target.id
        for one in tree.body
        if isinstance(one, ast.Assign | ast.AnnAssign)
        for target in ([one.target] if isinstance(one, ast.AnnAssign) else one.targets)
        if isinstance(target, ast.Name)
    }
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        inner = [
            n for n in ast.walk(function) if isinstance(n, ast.FunctionDef | ast.Lambda) and n is not function
        ]
        nodes = set(ast.walk(function)) - {n for one in inner for n in ast.walk(one)}
        own = {n.arg for n in ast.walk(function.args) if isinstance(n, ast.arg)}
        own |= {name for n in nodes if isinstance(n, ast.Global | ast.Nonlocal) for name in n.names}
        for name in sorted(shared - own):
            uses = sorted(_reads_and_writes(nodes, name))
            if uses and not uses[0][1] and any(written for _, written in uses):
                first = next((s for s in function.body if not is_docstring(s)), None)
                if first is not None and first.lineno > function.lineno:
                    yield Unbound(name, first)


def _reads_and_writes(nodes: set[ast.AST], name: str) -> Iterator[tuple[tuple[int, int], bool]]:
    """Yield line and kind of each use. What is on one line is read before it is written, but for a loop's variable."""
    loops = {n for one in nodes if isinstance(one, ast.For | ast.comprehension) for n in ast.walk(one.target)}
    for node in nodes:
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name) and node.target.id == name:
            yield (node.lineno, 0), False
        if isinstance(node, ast.Name) and node.id == name:
            written = not isinstance(node.ctx, ast.Load)
            yield (node.lineno, -1 if node in loops else int(written)), written


def _imported(tree: ast.Module, ending: str) -> set[str]:
    return {
        a.asname or a.name
        for one in ast.walk(tree)
        if isinstance(one, ast.ImportFrom) and f".{one.module}".endswith(f".{ending}")
        for a in one.names
    }


def _called(node: ast.AST | None) -> str:
    """Return the last name of what is called; "" where nothing is."""
    function = node.func if isinstance(node, ast.Call) else None
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def _is_rospys(function: ast.expr, of_rospy: set[str]) -> bool:
    if isinstance(function, ast.Attribute):
        return isinstance(function.value, ast.Name) and function.value.id == "rospy"
    return isinstance(function, ast.Name) and bool({function.id, "*"} & of_rospy)


def _is_type(name: str, types: set[str]) -> bool:
    return name in types or ("*" in types and name.isidentifier() and name[:1].isupper())


class _Text(ast.Constant):
    value: str


def _is_text(node: ast.expr | None) -> TypeGuard[_Text]:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _is_number(node: ast.expr) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
    )
