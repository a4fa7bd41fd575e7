"""Repairs of calls: what is named and not called, values that ROS does not take as they are written, and names that
belong to an object or to the whole file.

The text of a script that parses comes in, and the steps go out that repair it. What is said of them is the part of
`package/repairs/python.py`. It runs in a child process as `examine.py` does: the standard library only, and
nothing is executed.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from itertools import chain, pairwise

from grader.package.python_repairs.members import with_place
from grader.package.python_repairs.names import bound_in, is_kept_by_self, rospy_in
from grader.package.python_repairs.published import (
    NUMBERS,
    Argument,
    behind_commas,
    called,
    data_of_data,
    hidden_types,
    is_text,
    name_of_a_text,
    names_in,
    published_nothing,
    published_together,
    published_type,
    text_of_a_number,
    variables_of,
    with_places,
)
from grader.package.python_repairs.syntax import (
    Step,
    edited,
    last_name,
    nodes_in,
    span_of,
    step_to,
    tree_of,
)

GIVEN_ONE = ("Rate", "sleep", "Duration", "init_node", "loginfo", "logwarn", "logerr")
CALLED = frozenset({"is_shutdown", "sleep", "spin"})
QUOTED = re.compile(r"[\w.]+\.(sleep|spin)\([\w.]*\)")
TAKE_FUNCTIONS = {"Subscriber", "Timer", "Service", "on_shutdown", "signal"}


def with_values_called(text: str) -> Iterator[Step]:
    """`rate = rospy.rate = 10`, for `rate = rospy.Rate(10)`: a value is given to what takes it as an argument."""
    lines, rospy = text.split("\n"), rospy_in(tree_of(text))
    for node in nodes_in(tree_of(text)):
        target = node.targets[-1] if isinstance(node, ast.Assign) else None
        if not isinstance(node, ast.Assign) or not isinstance(target, ast.Attribute):
            continue
        names = {name.lower(): name for name in GIVEN_ONE} if last_name(target.value) == rospy else {}
        meant = names.get(target.attr.lower(), "")
        begin, value = span_of(lines, target), span_of(lines, node.value)
        if meant and begin is not None and value is not None and begin[0] == value[0]:
            line, start, end = value
            after = edited(text, [(line, begin[1], end, f"{rospy}.{meant}({lines[line][start:end]})")])
            yield from step_to("value", line + 1, text, after, f"{rospy}.{meant}")
            return


def with_calls(text: str) -> Iterator[Step]:
    tree, lines = tree_of(text), text.split("\n")
    functions = [n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)]
    # A property is read without brackets, and only its decorator tells.
    own = {n.name for n in functions} - {n.name for n in functions if n.decorator_list}
    attributes = (n for n in nodes_in(tree) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store))
    values = {n.attr for n in attributes} | {n.name for n in functions if n.decorator_list}
    # A parameter or a variable may have the name of a function.
    own -= {n.arg for n in nodes_in(tree) if isinstance(n, ast.arg)} | names_in(tree, ast.Store)
    named = [n for node in nodes_in(tree) for n in _uncalled_expressions(node) if _is_callable(n, own)]
    alone = (n.value for n in nodes_in(tree) if isinstance(n, ast.Expr))
    named += [n for n in alone if isinstance(n, ast.Attribute) and n.attr in own - CALLED]
    named = [n for n in named if last_name(n) not in values]
    spans = [span for n in named if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(line, end, end, "()") for line, _, end in spans])
        words = dict.fromkeys(ast.unparse(n) for n in sorted(named, key=lambda n: n.lineno))
        yield from step_to("call", min(spans)[0] + 1, text, after, ", ".join(words))


def with_quoted_calls(text: str) -> Iterator[Step]:
    """`"rospy.spin()"`: a call that stands alone in quotes."""
    lines = text.split("\n")
    for node in nodes_in(tree_of(text)):
        value = node.value if isinstance(node, ast.Expr) else None
        code = value.value if isinstance(value, ast.Constant) and isinstance(value.value, str) else ""
        span = span_of(lines, value) if value is not None and QUOTED.fullmatch(code) else None
        if span is not None:
            yield from step_to("quoted", span[0] + 1, text, edited(text, [(*span, code)]), code)
            return


COMMENTED = re.compile(r"(\s*)#+(\s*)(([\w.]+)\.publish\(.*\))\s*$")


def with_publish_uncommented(text: str) -> Iterator[Step]:
    """`# pub.publish(text)`, where nothing else publishes by that publisher."""
    tree, lines = tree_of(text), text.split("\n")
    given = [n for n in nodes_in(tree) if isinstance(n, ast.Assign) and called(n.value) == "Publisher"]
    made = {ast.unparse(target) for one in given for target in one.targets}
    calls = [n.func for n in nodes_in(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Attribute)]
    used = {ast.unparse(one.value) for one in calls if one.attr == "publish"}
    found = [
        (at, one) for at, line in enumerate(lines) if (one := COMMENTED.match(line)) and one[4] in made - used
    ]
    if len(found) == 1:
        at, one = found[0]
        after = "\n".join([*lines[:at], f"{one[1] or one[2]}{one[3]}", *lines[at + 1 :]])
        yield from step_to("comment", at + 1, text, after, one[3])


def _uncalled_expressions(node: ast.AST) -> Iterator[ast.expr]:
    """Yield what stands there by itself and says nothing: a statement, or a condition."""
    if isinstance(node, ast.Expr):
        yield node.value
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield node.operand
    elif isinstance(node, ast.While | ast.If):
        yield node.test


def _is_callable(node: ast.expr, own: set[str]) -> bool:
    if isinstance(node, ast.Attribute) and node.attr in CALLED:
        # `self.is_shutdown` may be a value of a base class, and `rospy.sleep` needs one in its brackets
        return ast.unparse(node) != "rospy.sleep" and (ast.unparse(node.value) != "self" or node.attr in own)
    return isinstance(node, ast.Name) and node.id in own


def with_callbacks(text: str) -> Iterator[Step]:
    """`Subscriber('x', String, on_x())` calls the function instead of naming it: one that takes a message, or that
    gives nothing back."""
    tree, lines = tree_of(text), text.split("\n")
    own = {n.name: n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)}
    called = []
    for node in nodes_in(tree):
        if isinstance(node, ast.Call) and last_name(node.func) in TAKE_FUNCTIONS:
            given = [*node.args[:3], *(k.value for k in node.keywords if k.arg in {"callback", "handler"})]
            calls = (n for n in given if isinstance(n, ast.Call) and not n.args and not n.keywords)
            called += [n for n in calls if (one := own.get(last_name(n.func))) and _is_callback(one)]
    spans = [(span, ast.unparse(n.func)) for n in called if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(*span, name) for span, name in spans])
        words = ", ".join(dict.fromkeys(name for _, name in spans))
        yield from step_to("callback", min(span for span, _ in spans)[0] + 1, text, after, words)


def _is_callback(function: ast.FunctionDef) -> bool:
    returns = (n.value for n in nodes_in(function) if isinstance(n, ast.Return | ast.Yield))
    given = [a for a in function.args.args if a.arg != "self"]
    # One that needs nothing and gives something back may make the callback.
    return len(given) > len(function.args.defaults) or not any(returns)


def with_arguments(text: str, kinds: list[str]) -> Iterator[Step]:
    """`kinds` are the message types that the lab uses."""
    tree, lines = tree_of(text), text.split("\n")
    for mistake in chain(_wrong_arguments(tree, kinds), _names_of_objects(tree)):
        spans = [(span, new) for node, new in mistake.edits if (span := span_of(lines, node))]
        if len(spans) == len(mistake.edits):
            after = edited(text, [(*span, new) for span, new in spans])
            for step in step_to("argument", spans[0][0][0] + 1, text, after, mistake.why):
                yield step
                yield from with_arguments(step["text"], kinds)
                return


def with_lines_turned(text: str) -> Iterator[Step]:
    """A line of a function that reads what the line right below it gives its only value."""
    tree, lines = tree_of(text), text.split("\n")
    shared = {name for one in tree.body for name in _bound_in(one)} | set(dir(builtins))
    for function in (n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)):
        names = [n for n in nodes_in(function) if isinstance(n, ast.Name)]
        stored = [n.id for n in names if not isinstance(n.ctx, ast.Load)]
        known = shared | {n.arg for n in nodes_in(function) if isinstance(n, ast.arg)}
        blocks = [n.body for n in nodes_in(function) if isinstance(n, ast.FunctionDef | ast.While | ast.For)]
        for first, second in chain.from_iterable(map(pairwise, blocks)):
            given, read = names_in(second, ast.Store), names_in(first, ast.Load)
            # With a second value from elsewhere, the line above may rightly read that one.
            late = {name for name in given & read - known if stored.count(name) == 1}
            ends = (first.lineno, first.end_lineno, second.end_lineno)
            alone = ends == (first.lineno, second.lineno - 1, second.lineno)
            is_later = any(isinstance(n, ast.Lambda) for n in nodes_in(first))
            if late and alone and not is_later and isinstance(second, ast.Assign):
                at = first.lineno - 1
                after = "\n".join([*lines[:at], lines[at + 1], lines[at], *lines[at + 2 :]])
                yield from step_to("turned", first.lineno, text, after)
                return


def with_definitions_first(text: str) -> Iterator[Step]:
    """Functions or classes that a line of the file needs above them: they move up; the line moves down if it is the
    only one that does anything."""
    tree, lines = tree_of(text), text.split("\n")
    known = set(dir(builtins))
    for place, first in enumerate(tree.body):
        if isinstance(first, DEFINITIONS):
            continue
        known |= bound_in(ast.Module(tree.body[:place], []))
        below = tree.body[place + 1 :]
        needed = _needed_now(first, tree.body[:place]) - known
        late = [i for i, one in enumerate(below) if isinstance(one, DEFINITIONS) and one.name in needed]
        between = below[late[0] : late[-1] + 1] if late else []
        if not late or not all(isinstance(one, DEFINITIONS) for one in between):
            continue
        at, end = first.lineno - 1, first.end_lineno or 0
        if all(isinstance(one, DEFINITIONS) for one in below):
            moved, until = lines[at:end], below[-1].end_lineno or 0
            after = [*lines[:at], *lines[end:until], "", "", *moved, *lines[until:]]
            moving = f"{first.lineno} {end} below {until}"
        else:
            begin, until = _first_line(between[0]) - 1, between[-1].end_lineno or 0
            after = [*lines[:at], *lines[begin:until], *lines[at:begin], *lines[until:]]
            moving = f"{begin + 1} {until} above {first.lineno}"
        names = " ".join(
            one.name for i, one in enumerate(below) if i in late and isinstance(one, DEFINITIONS)
        )
        yield from step_to("defined", first.lineno, text, "\n".join(after), f"{moving} {names}")
        return


DEFINITIONS = (ast.FunctionDef, ast.ClassDef)


def _first_line(node: ast.stmt) -> int:
    """Return the line on which a definition begins, with what decorates it."""
    decorators = node.decorator_list if isinstance(node, DEFINITIONS) else []
    return min([node.lineno, *(one.lineno for one in decorators)])


def _needed_now(statement: ast.stmt, above: Sequence[ast.stmt]) -> set[str]:
    """Return the names that a statement reads, and the functions above it that it names; not what a lambda will."""
    functions = {one.name: one for one in above if isinstance(one, ast.FunctionDef)}
    later = {inner for n in nodes_in(statement) if isinstance(n, ast.Lambda) for inner in nodes_in(n.body)}
    names = [n for n in nodes_in(statement) if isinstance(n, ast.Name) and n not in later]
    found, new = set[str](), {n.id for n in names if isinstance(n.ctx, ast.Load)}
    while new:
        found |= new
        called = [names_in(functions[name], ast.Load) for name in new if name in functions]
        new = set[str]().union(*called) - found
    return found


LOGS = re.compile(r"log(debug|info|warn|err|fatal)")


def _wrong_arguments(tree: ast.Module, kinds: list[str]) -> Iterator[Argument]:
    """Yield what calls of rospy's are given in another form than they take it."""
    known = bound_in(tree) | set(dir(builtins))
    types, of_rospy, rospy = _imported(tree, "msg"), _imported(tree, "rospy"), rospy_in(tree)
    functions = {one.name for one in tree.body if isinstance(one, ast.FunctionDef)}
    methods = {f"self.{n.name}" for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)}
    values = [(t, n.value) for n in nodes_in(tree) if isinstance(n, ast.Assign) for t in n.targets]
    rates = {ast.unparse(target) for target, value in values if called(value) == "Rate"}
    published = {ast.unparse(target): kind for target, value in values if (kind := published_type(value))}
    yield from published_nothing(tree)
    yield from behind_commas(tree)
    yield from hidden_types(tree, types)
    yield from data_of_data(tree)
    for call in (n for n in nodes_in(tree) if isinstance(n, ast.Call)):
        name = called(call)
        owner = ast.unparse(call.func.value) if isinstance(call.func, ast.Attribute) else ""
        if (owner, name) == (f"{rospy}.Rate", "sleep") and call.args and _is_number(call.args[0]):
            why = "`Rate.sleep` needs a Rate that was made, as in `rate.sleep()`"
            yield Argument([(call.func, f"{rospy}.sleep")], why)
        elif name == "sleep" and owner in rates:
            if call.args:
                yield Argument([(call, f"{owner}.sleep()")], "a Rate already knows how long to sleep")
        elif name == "publish" and owner:
            kind = published.get(owner, "")
            yield from text_of_a_number(call, variables_of(tree)) if NUMBERS.fullmatch(kind) else ()
            yield from name_of_a_text(call, tree) if kind == "String" else ()
            yield from published_together(call, kind)
        elif _is_rospys(call.func, of_rospy, rospy):
            yield from _logged(call) if LOGS.fullmatch(name) else ()
            yield from _in_quotes(call, name, known)
            yield from _of_topic(call, types, kinds) if name in {"Publisher", "Subscriber"} else ()
            yield from _type_of_topic(call, types, functions) if name in {"Publisher", "Subscriber"} else ()
            yield from _without_value(call, name, known)
            yield from _numbers(call, name)
            yield from _numbers_by_name(call, name, values)
            yield from _callback(call, name, functions)
            yield from _without_callback(call, tree) if name == "Subscriber" else ()
            yield from _subscribed(call, name, functions | methods)
            yield from _without_quotes(call, name, functions)
            yield from _given_too_much(call, name)
            yield from _value_first(call, name)


TAKE_NOTHING = frozenset({"spin", "is_shutdown", "get_time", "get_rostime", "get_name", "get_namespace"})
"""Functions of rospy, some of which take the node in ROS 2."""


def _given_too_much(call: ast.Call, name: str) -> Iterator[Argument]:
    """Of `rospy.spin(node)`, as in ROS 2."""
    if name in TAKE_NOTHING and (call.args or call.keywords):
        why = f"`{name}` is given a value, and rospy's takes none"
        yield Argument([(call, f"{ast.unparse(call.func)}()")], why)


def _value_first(call: ast.Call, name: str) -> Iterator[Argument]:
    """Of `set_param(55555, '/phone')`."""
    first, second, *_ = [*call.args, None, None]
    if name == "set_param" and first is not None and _is_number(first) and is_text(second):
        edits: list[tuple[ast.expr, str]] = [(first, repr(second.value)), (second, ast.unparse(first))]
        yield Argument(edits, "the parameter's name comes first, then its value")


def _in_quotes(call: ast.Call, name: str, known: AbstractSet[str]) -> Iterator[Argument]:
    """Of `Publisher('x, String')`, which has its other arguments within the quotes of the first."""
    first = call.args[0] if call.args and name in {"Publisher", "Subscriber", "init_node"} else None
    begin, comma, rest = first.value.partition(",") if is_text(first) else ("", "", "")
    inner = tree_of(f"f({rest.strip()})") if comma else ast.Module([], [])
    names = {n.id for n in nodes_in(inner) if isinstance(n, ast.Name)}
    if first is not None and len(inner.body) == 1 and names - {"f"} and names - {"f"} <= known:
        why = "the quotes end behind the name, before the other arguments"
        yield Argument([(first, f"{begin!r}, {rest.strip()}")], why)


VALUED = {"init_node": ("anonymous", "True"), "Publisher": ("queue_size", "10")}


def _without_value(call: ast.Call, name: str, known: AbstractSet[str]) -> Iterator[Argument]:
    """Of `init_node('x', anonymous)` and `Publisher('x', String, queue_size)`, whose last argument lacks its value."""
    word, value = VALUED.get(name, ("", ""))
    found = [one for one in call.args if isinstance(one, ast.Name) and one.id == word and word not in known]
    if found:
        yield Argument([(found[0], f"{word}={value}")], f"`{word}` is named here without its value")


def _of_topic(call: ast.Call, types: set[str], kinds: list[str]) -> Iterator[Argument]:
    """Of `Publisher` and `Subscriber`, which take a topic's name and a class."""
    first, second, *_ = [*call.args, None, None]
    if isinstance(first, ast.Name) and _is_type(first.id, types) and is_text(second):
        edits: list[tuple[ast.expr, str]] = [(first, repr(second.value)), (second, first.id)]
        yield Argument(edits, "the topic's name comes first, then its type")
        return
    given = next((k.value for k in call.keywords if k.arg == "data_class"), second)
    module = ast.unparse(given) if isinstance(given, ast.Attribute) and given.attr == "msg" else ""
    of_module = [kind.rpartition("/")[2] for kind in kinds if module == f"{kind.partition('/')[0]}.msg"]
    if given is not None and len(of_module) == 1:
        why = f"`{module}` is a module, and no type of messages"
        yield Argument([(given, f"{module}.{of_module[0]}")], why)
    name = ast.unparse(given.func) if isinstance(given, ast.Call) and not given.args else ""
    if is_text(given) and _is_type(given.value, types):
        yield Argument([(given, given.value)], "the type is given as a string")
    elif given is not None and _is_type(name, types):
        yield Argument([(given, name)], f"`{name}()` is a message, not a type")


def _type_of_topic(call: ast.Call, types: set[str], functions: set[str]) -> Iterator[Argument]:
    """Of `Subscriber('x', on_x, String)`, whose type comes too late, and `Subscriber('x', on_x)` and
    `Publisher('x', queue_size=1)`, which have none, where the script imports just one."""
    first, second, third, *_ = [*call.args, None, None, None]
    named, why = {k.arg for k in call.keywords}, "the type of the messages is missing"
    if isinstance(second, ast.Name) and second.id in functions and isinstance(third, ast.Name):
        if _is_type(third.id, types):
            yield Argument([(second, third.id), (third, second.id)], "the type comes before the callback")
    elif (
        len(types - {"*"}) == len(types) == 1
        and "data_class" not in named
        and third is None
        and is_text(first)
    ):
        (kind,) = types
        if isinstance(second, ast.Name) and second.id in functions:
            yield Argument([(second, f"{kind}, {second.id}")], why)
        elif second is None:
            yield Argument([(first, f"{ast.unparse(first)}, {kind}")], why)


def _logged(call: ast.Call) -> Iterator[Argument]:
    """Of `loginfo('a', b)`, whose text has no place for the value."""
    text, values = next(iter(call.args), None), call.args[1:]
    value = values[0] if len(values) == 1 else None
    if text is not None and not is_text(text) and is_text(value) and "%" in value.value:
        edits = [(text, ast.unparse(value)), (value, ast.unparse(text))]
        yield Argument(edits, "the string comes first, then its values")
    elif is_text(text) and values and "%" not in text.value:
        right = with_place(repr(text.value)) if len(values) == 1 else ""
        lacks = "no `%` in it" if right else "fewer `%` than there are values after it"
        yield Argument([(text, with_places(text.value, len(values)))], f"the string has {lacks}")


def _names_of_objects(tree: ast.Module) -> Iterator[Argument]:
    """Yield names in methods that are there only with `self.` before them, and classes that stand in place of an object
    whose attributes are used."""
    shared = {name for one in tree.body for name in _bound_in(one)} | set(dir(builtins))
    shared |= {name for n in nodes_in(tree) if isinstance(n, ast.Global) for name in n.names}
    classes = [n for n in tree.body if isinstance(n, ast.ClassDef)]
    for one in classes if "*" not in shared else ():
        methods = [n for n in one.body if isinstance(n, ast.FunctionDef) and not n.decorator_list]
        stored = (n for n in nodes_in(one) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store))
        attributes = {n.attr for n in stored if _is_self(n.value)} | {n.name for n in methods}
        attributes |= {name for part in one.body if isinstance(part, ast.Assign) for name in _bound_in(part)}
        for method in (n for n in methods if n.args.args and n.args.args[0].arg == "self"):
            known = shared | {name for part in method.body for name in _bound_in(part)}
            known |= {n.arg for n in nodes_in(method) if isinstance(n, ast.arg)}
            known |= {n.value.id for n in nodes_in(method) if is_kept_by_self(n)}  # type: ignore[attr-defined]
            names = (n for n in nodes_in(method) if isinstance(n, ast.Name))
            for name in (n for n in names if n.id in attributes - known):
                yield Argument([(name, f"self.{name.id}")], f"`{name.id}` belongs to the class {one.name}")
    read = [n for n in nodes_in(tree) if isinstance(n, ast.Attribute)]
    used = [(ast.unparse(n.value), n.attr) for n in read]
    owners = [ast.unparse(n.value).split(".") for n in read if isinstance(n.ctx, ast.Store)]
    given = {".".join(names[:end]) for names in owners for end in range(1, len(names) + 1)}
    # what a class itself has, and a method that a decorator may make its own, is read without an object
    made = {
        one.name: {name for part in one.body for name in _bound_in(part)}
        - {m.name for m in one.body if isinstance(m, ast.FunctionDef) and not m.decorator_list}
        for one in classes
        if not one.bases
    }
    of_messages = {
        alias.asname or alias.name
        for n in tree.body
        if isinstance(n, ast.ImportFrom) and re.search(r"\.(msg|srv)$", n.module or "")
        for alias in n.names
    }
    assigned = [n for n in nodes_in(tree) if isinstance(n, ast.Assign) and len(n.targets) == 1]
    # a name that is given something else, too, may be another one, of another function
    given -= {ast.unparse(n.targets[0]) for n in assigned if last_name(n.value) not in of_messages}
    for node in assigned:
        target, value = ast.unparse(node.targets[0]), node.value
        class_ = value.id if isinstance(value, ast.Name) else ""
        of_objects = {name for owner, name in used if owner == target and class_ in made} - made.get(
            class_, set()
        )
        if of_objects or (class_ in of_messages and target in given):
            yield Argument([(value, f"{class_}()")], f"`{target}` is the class itself, not an object of it")


def _is_self(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "self"


def _bound_in(part: ast.AST) -> set[str]:
    """Return the names that a part of a script gives a meaning to; of a function or class its own name alone."""
    if isinstance(part, ast.FunctionDef | ast.ClassDef):
        return {part.name}
    found = set()
    for node in nodes_in(part):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            found.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {(a.asname or a.name).partition(".")[0] for a in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef | ast.ExceptHandler) and node.name:
            found.add(node.name)
        elif isinstance(node, ast.Global | ast.Nonlocal):
            found |= set(node.names)
    return found


def _numbers(call: ast.Call, name: str) -> Iterator[Argument]:
    size = next((k.value for k in call.keywords if k.arg == "queue_size"), None)
    first, third = call.args[0] if call.args else None, call.args[2] if len(call.args) == 3 else None
    if name == "Publisher" and size is None and third is not None and _is_number(third):
        why = "the third value of `Publisher(…)` is no queue size, which it takes by its name"
        yield Argument([(third, f"queue_size={ast.unparse(third)}")], why)
    elif is_text(size) and size.value.isdigit():
        yield Argument([(size, size.value)], "`queue_size` is a string")
    elif name in {"Rate", "sleep"} and is_text(first) and first.value.replace(".", "", 1).isdigit():
        yield Argument([(first, first.value)], f"`rospy.{name}` takes a number, not a string")
    elif name == "Timer" and isinstance(call.func, ast.Attribute) and first is not None and _is_number(first):
        owner = ast.unparse(call.func.value)
        edit = (first, f"{owner}.Duration({ast.unparse(first)})")
        yield Argument([edit], "a Timer takes a Duration, not a number")


def _numbers_by_name(
    call: ast.Call, name: str, values: Sequence[tuple[ast.expr, ast.expr]]
) -> Iterator[Argument]:
    """Of `Rate(hz)` where `hz` is `"10"`, or a parameter whose default is that."""
    given = call.args[0] if call.args and name in {"Rate", "sleep", "Duration"} else None
    made = [value for target, value in values if given and ast.unparse(target) == ast.unparse(given)]
    text: ast.expr | None = made[0] if len(made) == 1 else None
    if isinstance(text, ast.Call) and called(text) == "get_param" and len(text.args) == 2:
        text = text.args[1]
    if text is not None and is_text(text) and text.value.replace(".", "", 1).isdigit():
        yield Argument([(text, text.value)], f"`rospy.{name}` takes a number, and this is a string")


def _callback(call: ast.Call, name: str, functions: set[str]) -> Iterator[Argument]:
    place = {"Subscriber": 2, "Service": 2, "Timer": 1, "on_shutdown": 0}.get(name)
    if place is not None:
        words = {"callback", "handler", "h"}
        given = [*call.args[place : place + 1], *(k.value for k in call.keywords if k.arg in words)]
        for one in given:
            if is_text(one) and one.value in functions:
                yield Argument([(one, one.value)], f"'{one.value}' is a string, not a function")


def _without_callback(call: ast.Call, tree: ast.Module) -> Iterator[Argument]:
    """Of `Subscriber('x', String)`, where one function that reads a message is used nowhere."""
    if len(call.args) != len(("topic", "type")) or any(k.arg in {None, "callback"} for k in call.keywords):
        return
    used = {last_name(n) for n in nodes_in(tree) if isinstance(n, ast.Name | ast.Attribute)}
    bodies = [tree.body, *(n.body for n in tree.body if isinstance(n, ast.ClassDef))]
    own = (n for body in bodies for n in body if isinstance(n, ast.FunctionDef))
    taking = [n for n in own if n.name not in used and len([a for a in n.args.args if a.arg != "self"]) == 1]
    taking = [n for n in taking if _reads_part(n, n.args.args[-1].arg)]
    if len(taking) == 1:
        name = "self." * (taking[0].args.args[0].arg == "self") + taking[0].name
        edit = (call.args[1], f"{ast.unparse(call.args[1])}, {name}")
        yield Argument([edit], "`Subscriber(…)` gets no callback")


def _reads_part(function: ast.FunctionDef, name: str) -> bool:
    parts = (n.value for n in nodes_in(function) if isinstance(n, ast.Attribute))
    return any(isinstance(n, ast.Name) and n.id == name for n in parts)


def _subscribed(call: ast.Call, name: str, functions: set[str]) -> Iterator[Argument]:
    """Of `Publisher('x', String, on_x)`, which is given a callback."""
    given = ast.unparse(call.args[2]) if name == "Publisher" and len(call.args) > 2 else ""
    if given in functions:
        meant = ast.unparse(call.func).replace("Publisher", "Subscriber")
        why = f"a Publisher takes no callback: `{given}` is called by a Subscriber"
        yield Argument([(call.func, meant)], why)


def _without_quotes(call: ast.Call, name: str, functions: set[str]) -> Iterator[Argument]:
    """Of a node's or topic's name that is written without quotes, and is the name of a function."""
    first = call.args[0] if call.args and name in {"init_node", "Publisher", "Subscriber"} else None
    if isinstance(first, ast.Name) and first.id in functions:
        what = "node" if name == "init_node" else "topic"
        yield Argument([(first, repr(first.id))], f"the name of the {what} has no quotes")


def _imported(tree: ast.Module, ending: str) -> set[str]:
    imports = (one for one in nodes_in(tree) if isinstance(one, ast.ImportFrom))
    named = (one.names for one in imports if f".{one.module}".endswith(f".{ending}"))
    return {a.asname or a.name for names in named for a in names}


def _is_rospys(function: ast.expr, of_rospy: set[str], rospy: str) -> bool:
    if isinstance(function, ast.Attribute):
        return isinstance(function.value, ast.Name) and function.value.id == rospy
    return isinstance(function, ast.Name) and bool({function.id, "*"} & of_rospy)


def _is_type(name: str, types: set[str]) -> bool:
    return name in types or ("*" in types and name.isidentifier() and name[:1].isupper())


def _is_number(node: ast.expr) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)
