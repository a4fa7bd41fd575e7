"""What `publish(…)` is given: a text on a topic of numbers, several values, or nothing.

`calls.py` makes the lines that repair it. It runs in a child process as `examine.py` does: the standard library only,
and nothing is executed.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple, TypeGuard

from grader.package.python_repairs.members import with_place
from grader.package.python_repairs.names import bound_in
from grader.package.python_repairs.syntax import last_name, nodes_in
from grader.wording import PAIR

PLACES = re.compile(r"%[-+#0-9.]*[sridxXfFeEgGc]")
NUMBERS = re.compile(r"U?Int\d+|Float\d+|Byte|Char")
NOTHING_PUBLISHED = "there is nothing to publish in the brackets"


class Argument(NamedTuple):
    """`edits` are expressions and what belongs in their place, all on one line."""

    edits: list[tuple[ast.expr, str]]
    why: str


def published_type(value: ast.expr) -> str:
    """Return the last name of the type of a `Publisher(…)`; "" of all else."""
    given = value.args[1:2] if isinstance(value, ast.Call) and called(value) == "Publisher" else []
    return ast.unparse(given[0]).rpartition(".")[2] if given else ""


def text_of_a_number(call: ast.Call, known: AbstractSet[str]) -> Iterator[Argument]:
    """Of `publish(str(n))`, `publish('n')` and the like on a topic of numbers. `known` are the script's variables."""
    for given in call.args:
        if isinstance(given, ast.Call) and NUMBERS.fullmatch(called(given)) and given.args:
            yield from text_of_a_number(given, known)
        elif isinstance(given, ast.Call) and called(given) in {"str", "chr", "repr"} and len(given.args) == 1:
            why = f"the message takes a number, and `{called(given)}(…)` makes a string of it"
            yield Argument([(given, ast.unparse(given.args[0]))], why)
        elif is_text(given) and given.value in known:
            why = (
                f"the message takes a number, and with quotes, {given.value!r} is a string, not the variable"
            )
            yield Argument([(given, given.value)], why)
        elif (value := _alone_in_text(given)) is not None:
            yield Argument([(given, ast.unparse(value))], "the message takes a number, and this is a string")


def _alone_in_text(node: ast.expr) -> ast.expr | None:
    """Return the value of `'%d' % n`, `'{}'.format(n)` and `f'{n}'`, which are texts with nothing else in them."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod) and is_text(node.left):
        alone = PLACES.fullmatch(node.left.value) and not isinstance(node.right, ast.Tuple)
        return node.right if alone else None
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and is_text(node.func.value):
        is_bare = (node.func.value.value, node.func.attr, len(node.args)) == ("{}", "format", 1)
        return node.args[0] if is_bare else None
    parts = node.values if isinstance(node, ast.JoinedStr) else []
    first = parts[0] if len(parts) == 1 else None
    return first.value if isinstance(first, ast.FormattedValue) else None


def name_of_a_text(call: ast.Call, tree: ast.Module) -> Iterator[Argument]:
    """Of `publish('text')` on a topic of texts, where a variable of that name gets a text."""
    given = call.args[0] if len(call.args) == 1 else None
    values = [
        n.value for n in nodes_in(tree) if isinstance(n, ast.Assign) for t in n.targets if _is_named(t, given)
    ]
    if is_text(given) and values and all(map(_makes_text, values)):
        why = f"with quotes, {given.value!r} is these letters, and not the variable"
        yield Argument([(given, given.value)], why)


def _is_named(target: ast.expr, given: ast.expr | None) -> bool:
    return is_text(given) and ast.unparse(target) == given.value


def _makes_text(value: ast.expr) -> bool:
    """Return whether it is a text, or made of one."""
    if isinstance(value, ast.BinOp):
        return _makes_text(value.left)
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute):
        return value.func.attr in {"format", "join"} and is_text(value.func.value)
    return is_text(value) or isinstance(value, ast.JoinedStr) or called(value) == "str"


def hidden_types(tree: ast.Module, types: AbstractSet[str]) -> Iterator[Argument]:
    """Of `String = 'a'`, after which `String` is no type of messages any more."""
    targets = [t for n in nodes_in(tree) if isinstance(n, ast.Assign) for t in n.targets]
    hidden = [t.id for t in targets if isinstance(t, ast.Name) and t.id in types]
    calls = [n for n in nodes_in(tree) if isinstance(n, ast.Call)]
    classes: set[ast.expr] = {one.func for one in calls}
    for one in (one for one in calls if called(one) in {"Publisher", "Subscriber", "isinstance"}):
        classes |= {*one.args[1:2], *(k.value for k in one.keywords if k.arg == "data_class")}
    names = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)}
    names |= {n.arg for n in nodes_in(tree) if isinstance(n, ast.arg)}
    other = next((one for one in ("msg", "message", "own_message") if one not in names), "")
    for name in hidden[:1] if other else ():
        meant = [n for n in nodes_in(tree) if isinstance(n, ast.Name) and n.id == name and n not in classes]
        why = f"from here on, `{name}` is a value and no longer the class of the messages"
        yield Argument([(one, other) for one in sorted(meant, key=lambda n: n.lineno)], why)


def data_of_data(tree: ast.Module) -> Iterator[Argument]:
    """Of `msg.data` below `msg = msg.data`, which is the value itself."""
    for function in (n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)):
        for taken in (n for n in function.body if isinstance(n, ast.Assign) and len(n.targets) == 1):
            name, value = taken.targets[0], taken.value
            if isinstance(name, ast.Name) and ast.unparse(value) == f"{name.id}.data":
                later = [
                    n for n in nodes_in(function) if isinstance(n, ast.Attribute) and n.lineno > taken.lineno
                ]
                why = f"line {taken.lineno} makes the value itself of `{name.id}`, so it has no `.data`"
                for node in (n for n in later if ast.unparse(n) == f"{name.id}.data"):
                    yield Argument([(node, name.id)], why)


def variables_of(tree: ast.Module) -> set[str]:
    """Return the names that are given a value, and those of objects (`self.n`)."""
    stored = [n for n in nodes_in(tree) if isinstance(n, ast.Name | ast.Attribute)]
    return {ast.unparse(n) for n in stored if isinstance(n.ctx, ast.Store)}


def published_together(call: ast.Call, kind: str) -> Iterator[Argument]:
    """Of `publish('a %s', b)`: a message of one field takes one value."""
    text, values, why = next(iter(call.args), None), call.args[1:], "`publish(…)` takes one value"
    if NUMBERS.fullmatch(kind) and len(values) == 1 and is_text(text):
        yield Argument([(call, f"{ast.unparse(call.func)}({ast.unparse(values[0])})")], why)
    elif kind == "String" and values and is_text(text) and _has_no_other_places(text.value, len(values)):
        yield Argument([(call, f"{ast.unparse(call.func)}({_formatted(text.value, values)})")], why)
    elif (NUMBERS.fullmatch(kind) or kind == "String") and values and isinstance(text, ast.Name):
        yield Argument([(call, f"{ast.unparse(call.func)}({text.id})")], why)


def behind_commas(tree: ast.Module) -> Iterator[Argument]:
    """Of `text = 'a %s', b`, where the text is published."""
    calls = (n for n in nodes_in(tree) if isinstance(n, ast.Call) and called(n) in {"publish", "String"})
    published = {
        call.args[0].id for call in calls if len(call.args) == 1 and isinstance(call.args[0], ast.Name)
    }
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.Assign) and len(n.targets) == 1):
        target, value = node.targets[0], node.value
        if not isinstance(value, ast.Tuple) or not isinstance(target, ast.Name) or len(value.elts) < PAIR:
            continue
        text, *values = value.elts
        if target.id in published and is_text(text) and _has_no_other_places(text.value, len(values)):
            right = _formatted(text.value, values)
            yield Argument(
                [(value, right)], f"the comma makes several values of `{target.id}`, which is to be text"
            )


def _formatted(text: str, values: Sequence[ast.expr]) -> str:
    """Return how a text is written with these values in it."""
    given = ", ".join(map(ast.unparse, values))
    given = given if isinstance(values[0], ast.Name | ast.Call) and not values[1:] else f"({given})"
    return f"{repr(text) if '%' in text else with_places(text, len(values))} % {given}"


def _has_no_other_places(text: str, count: int) -> bool:
    """Return whether a text has no `%` at all, or places for so many values and no other `%` (`100%`)."""
    return "%" not in text or text.count("%") == len(PLACES.findall(text)) == count


def with_places(text: str, count: int) -> str:
    """Return how a string is written that has places for so many values: those of `.format(…)` become such."""
    if text.count("{}") == count:
        return repr(text.replace("{}", "%s"))
    if count == 1 and (right := with_place(repr(text))):
        return right
    blank = "" if not text or text[-1].isspace() else " "
    return repr(f"{text}{blank}{' '.join(['%s'] * count)}")


def _names_beside(function: ast.FunctionDef, call: ast.Call) -> set[str]:
    """Return the names that the block with a call by itself gives a value."""
    for node in nodes_in(function):
        block = getattr(node, "body", [])
        if isinstance(block, list) and any(isinstance(s, ast.Expr) and s.value is call for s in block):
            given = (target for s in block if isinstance(s, ast.Assign) for target in s.targets)
            return {target.id for target in given if isinstance(target, ast.Name)}
    return set()


def published_nothing(tree: ast.Module) -> Iterator[Argument]:
    """Yield `publish()`, or a `publish(x)` of a name that is given no value anywhere, where its function gives a value
    to one name and does nothing with it, or its block to one that nothing else publishes."""
    known = bound_in(tree) | set(dir(builtins))
    assigned = (n for n in nodes_in(tree) if isinstance(n, ast.Assign))
    made = [(ast.unparse(t), called(n.value)) for n in assigned for t in n.targets]
    of_others = {"", "self", *(name for name, call in made if call not in ("", "Publisher"))}
    tools = {name for name, call in made if call in ("Rate", "Publisher", "Subscriber", "Timer")}
    for function in (n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)):
        unread = names_in(function, ast.Store) - names_in(function, ast.Load) - tools
        published = [n for n in nodes_in(function) if isinstance(n, ast.Call) and called(n) == "publish"]
        published = [n for n in published if ast.unparse(n.func).rpartition(".")[0] not in of_others]
        calls = [n for n in published if not n.keywords and _gives_nothing(n, known)]
        others = {ast.unparse(given) for n in published if n not in calls for given in n.args}
        beside = _names_beside(function, calls[0]) - others - tools if len(calls) == 1 else set()
        meant = unread if len(unread) == 1 else beside
        if len(meant) == len(calls) == 1:
            given = calls[0].args
            why = f"nothing gives `{ast.unparse(given[0])}` a value" if given else NOTHING_PUBLISHED
            yield Argument([(calls[0], f"{ast.unparse(calls[0].func)}({meant.pop()})")], why)


def _gives_nothing(call: ast.Call, known: AbstractSet[str]) -> bool:
    """Return whether a call has no argument, or just one name that is given no value anywhere."""
    first = call.args[0] if len(call.args) == 1 else None
    return not call.args or (isinstance(first, ast.Name) and first.id not in known and "*" not in known)


def names_in(node: ast.AST, kind: type[ast.expr_context]) -> set[str]:
    """Return the names in a node that it reads, or gives a value."""
    return {n.id for n in nodes_in(node) if isinstance(n, ast.Name) and isinstance(n.ctx, kind)}


def called(node: ast.AST | None) -> str:
    """Return the last name of what is called; "" where nothing is."""
    return last_name(node.func) if isinstance(node, ast.Call) else ""


class _Text(ast.Constant):
    value: str


def is_text(node: ast.expr | None) -> TypeGuard[_Text]:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)
