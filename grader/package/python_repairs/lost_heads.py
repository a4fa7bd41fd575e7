"""First lines of functions, methods and classes that a script has lost: what they were, by what uses them.

It runs in a child process as `examine.py` does: the standard library only.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator, Sequence

from grader.package.lint.script_names import bound_names, given_names
from grader.package.lint.script_tree import CALLBACKS, all_of, argument, called_name, dotted, parents_of
from grader.wording import is_one_edit

DEFINED = re.compile(r"\b(?:def|class)\s+(\w+)")
"""In a comment, too: there the line is not lost."""
OF_LISTS = frozenset(dir(list) + dir(dict) + dir(str))
BLOCKS = (ast.If, ast.Try, ast.With, ast.For, ast.While)
"""What they give a value may be passed on."""
LOST = "_lost_head"
REFUSED_MAX = 5


def lost_head_at(lines: list[str], at: int, blanks: str) -> str:
    """Return the first line that is lost above the line at index `at` of a script that need not parse: of a function or
    a class, or behind `blanks` of a method; "" where it is not known."""
    tree = _tree_of_the_rest([*lines[:at], f"{blanks}def {LOST}():", *lines[at:]])
    lost = next((n for n in all_of(tree, ast.FunctionDef) if n.name == LOST), None)
    if lost is None:
        return ""
    text, owner = "\n".join(lines), parents_of(tree)[lost]
    if not blanks:
        return lost_head(text, tree, lost.body)
    return lost_method(text, tree, owner, lost.body, at_first=True) if isinstance(owner, ast.ClassDef) else ""


def _tree_of_the_rest(lines: list[str]) -> ast.Module:
    """Return the tree of a script in which lines that do not parse have the sign that they lack at their end, or are
    `pass`; an empty one of too many."""
    for _ in range(REFUSED_MAX):
        at = _refused(lines)
        if at == len(lines):
            return ast.parse("\n".join(lines))
        line = lines[at]
        blank = "" if line.strip() == "pass" else f"{line[: len(line) - len(line.lstrip())]}pass"
        ended = (
            one for one in (f"{line}:", f"{line})") if _refused([*lines[:at], one, *lines[at + 1 :]]) > at
        )
        lines[at] = next(ended, blank)
    return ast.Module([], [])


def _refused(lines: list[str]) -> int:
    """Return the index of the line that Python refuses first; behind the last line of a script that parses."""
    try:
        ast.parse("\n".join(lines))
    except (SyntaxError, ValueError) as error:
        return min(len(lines), max(1, getattr(error, "lineno", None) or 0)) - 1
    return len(lines)


def lost_head(text: str, tree: ast.Module, body: Sequence[ast.stmt]) -> str:
    """Return the first line of the one function that the script names as a callback, or calls, and does not have, or of
    the one class; "" where there is not just one. `body` is what belongs below it."""
    # what a script has from elsewhere by `from … import *` is not known
    if any(alias.name == "*" for alias in all_of(tree, ast.alias)):
        return ""
    names = all_of(tree, ast.Name)
    first = next((n for n in body if not _is_docstring(n)), None)
    of_class = isinstance(first, ast.FunctionDef) and [a.arg for a in first.args.args[:1]] == ["self"]
    raised = {n.exc for n in all_of(tree, ast.Raise)}
    if of_class:
        calls = [n for n in all_of(tree, ast.Call) if isinstance(n.func, ast.Name) and n not in raised]
        named = dict.fromkeys((n.func.id for n in calls if n.func.id[:1].isupper()), "")
    else:
        named = {node.id: "msg" for _, node in _callbacks(tree) if isinstance(node, ast.Name)}
        alone = [n.value for n in all_of(tree, ast.Expr) if isinstance(n.value, ast.Call)]
        named |= {n.func.id: "" for n in alone if isinstance(n.func, ast.Name) and not n.args + n.keywords}
    lost = [name for name in named if name not in given_names(tree, names) | {*DEFINED.findall(text)}]
    if len(lost) != 1 or lost[0] in dir(builtins):
        return ""
    if of_class:
        return f"class {lost[0]}:"
    nodes = [n for one in body for n in ast.walk(one) if isinstance(n, ast.Attribute)]
    given = {*given_names(tree, names), *dir(builtins)}
    values = [n.value.id for n in nodes if isinstance(n.value, ast.Name) and n.value.id not in given]
    value = values[0] if values else ""
    return f"def {lost[0]}({value if value and named[lost[0]] else named[lost[0]]}):"


def lost_method(
    text: str, tree: ast.Module, owner: ast.ClassDef, body: Sequence[ast.stmt], *, at_first: bool = False
) -> str:
    """Return the first line of the one method that the script calls, or names as a callback, and that the class does
    not have; "" where there is none. The body may be that of `__init__` where it comes first in the class
    (`at_first`)."""
    if {*map(dotted, owner.bases)} - {"object"}:
        return ""
    made = [n for n in all_of(tree, ast.Assign) if isinstance(n.value, ast.Call)]
    objects = {"self", *(dotted(n.targets[0]) for n in made if dotted(n.value.func) == owner.name)}
    called = [n.func for n in all_of(tree, ast.Call) if isinstance(n.func, ast.Attribute)]
    used = [n.attr for n in called if dotted(n.value) in objects and n.attr not in OF_LISTS]
    told = [(maker, n) for maker, n in _callbacks(tree) if isinstance(n, ast.Attribute)]
    makers = {n.attr: maker for maker, n in told if dotted(n.value) == "self"}
    stored = [n for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Store)]
    has = {*DEFINED.findall(text), *(n.attr for n in stored if dotted(n.value) == "self")}
    lost = [name for name in dict.fromkeys((*used, *makers)) if name not in has]
    inside = [n for one in body for n in ast.walk(one) if isinstance(n, ast.Name)]
    if at_first and not lost and "__init__" not in has and any(n.id == "self" for n in inside):
        lost = ["__init__"]
    if len(lost) != 1 or any(is_one_edit(lost[0], name) for name in has):
        return ""
    # what the body reads, and neither it nor the module gives a value
    outer = bound_names(ast.Module([n for n in tree.body if not isinstance(n, BLOCKS)], []))
    given = given_names(ast.Module([*body], []), inside) | outer | {*dir(builtins), "self"}
    inside.sort(key=lambda n: (n.lineno, n.col_offset))
    taken = [*dict.fromkeys(n.id for n in inside if n.id not in given)]
    # what nothing defines may be misspelt, or lost as well: who makes an object shows how many values it takes
    making = [n for n in all_of(tree, ast.Call) if dotted(n.func) == owner.name]
    if lost == ["__init__"] and taken and len(taken) not in {len(n.args) + len(n.keywords) for n in making}:
        return ""
    if not taken and lost[0] in makers:
        taken = ["event" if makers[lost[0]] == "Timer" else "msg"]
    return f"def {lost[0]}({', '.join(['self', *taken])}):"


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _callbacks(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Yield what makes each subscriber, service or timer, with its callback."""
    for call in all_of(tree, ast.Call):
        maker = called_name(call)
        yield from ((maker, one) for one in argument(call, *CALLBACKS.get(maker, (99, ""))))
