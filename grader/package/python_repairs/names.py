"""Repairs of names in a script that nothing gives a value, and that are nearly the same as one that has one.

The text of a script that parses comes in, and the steps go out that repair it, as in `examine.py`. It runs in a
child process: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from difflib import get_close_matches
from functools import lru_cache
from string import digits

from grader.package.lint.script_names import is_value, meant_at_most
from grader.package.lint.script_results import misnamed_targets
from grader.package.python_repairs.blocks import with_line
from grader.package.python_repairs.syntax import (
    Step,
    edited,
    last_name,
    nodes_in,
    span_of,
    step_to,
    tree_of,
)
from grader.wording import AT_THE_END, is_one_edit, plural

OF_PYTHON = (
    "abs", "float", "format", "input", "int", "len", "max", "min", "print", "range", "round", "sorted", "str", "sum",
)  # fmt: skip
"""Functions of Python that are called in any script."""
OBVIOUS_NAMES = {
    **dict.fromkeys(("true", "TRUE"), "True"),
    **dict.fromkeys(("false", "FALSE"), "False"),
    **dict.fromkeys(("null", "NULL", "none", "nil", "nullptr"), "None"),
    **dict.fromkeys(("_name_", "__name", "_name", "name__"), "__name__"),
}
NAMES_OF_ROSPY = (
    "AnyMsg DEBUG Duration ERROR FATAL Header INFO MasterProxy Message Publisher ROSException ROSInitException "
    "ROSInternalException ROSInterruptException ROSSerializationException ROSTimeMovedBackwardsException Rate Service "
    "ServiceException ServiceProxy SubscribeListener Subscriber Time Timer TransportException TransportInitError "
    "TransportTerminated WARN client core delete_param exceptions get_caller_id get_master get_name get_namespace "
    "get_node_uri get_param get_param_cached get_param_names get_published_topics get_ros_root get_rostime get_time "
    "get_topic_class has_param impl init_node is_shutdown logdebug logdebug_once logdebug_throttle logerr logerr_once "
    "logerr_throttle logfatal logfatal_once logfatal_throttle loginfo loginfo_once loginfo_throttle logout logwarn "
    "logwarn_once logwarn_throttle msg msproxy myargv names numpy_msg on_shutdown parse_rosrpc_uri remap_name "
    "resolve_name rostime search_param service set_param signal_shutdown sleep spin timer topics wait_for_message "
    "wait_for_service"
)
ROSPY = frozenset(NAMES_OF_ROSPY.split())
MODULES_OF_ROSPY = frozenset(
    [
        "client",
        "core",
        "exceptions",
        "impl",
        "msg",
        "msproxy",
        "names",
        "numpy_msg",
        "rostime",
        "service",
        "timer",
        "topics",
    ]
)
MEMBERS = {
    "Publisher": ("publish", "unregister", "get_num_connections"),
    "Rate": ("sleep", "remaining"),
    "message": ("data",),
}
"""By what makes the object, or a message of std_msgs: what belongs to it."""
ALONE = ("pass", "break", "continue", "return")
"""What a statement of one word says."""
IDLE_MAX = 20
"""So many functions that nothing names are tried for a call."""
NAME_CHARS_MIN = 4
"""Of shorter names, a letter that is not the same is the larger part."""
SHORT_NAME_CHARS_MIN = 2
"""Names of one letter are different names."""


def rospy_in(tree: ast.Module, without: str = "rospy") -> str:
    """Return the name that a script imports rospy under; `without` one, the name that it would have."""
    imported = (a for n in nodes_in(tree) if isinstance(n, ast.Import) for a in n.names)
    return next((a.asname or a.name for a in imported if a.name == "rospy"), without)


@lru_cache(maxsize=256)
def bound_in(tree: ast.AST) -> frozenset[str]:
    """Return the names that anything in a tree that nobody changes, or in a part of one, gives a value."""
    found: set[str] = set()
    for node in nodes_in(tree):
        if not isinstance(node, _BINDING):
            continue
        if isinstance(node, ast.Name):
            found.update(() if isinstance(node.ctx, ast.Load) else (node.id,))
        elif isinstance(node, ast.arg):
            found.add(node.arg)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            every = {"*"} if getattr(node, "module", "") == "rospy" else set()
            found.update({(a.asname or a.name).partition(".")[0] for a in node.names} - every)
            found.update(ROSPY - MODULES_OF_ROSPY if every & {a.name for a in node.names} else ())
        else:
            found.add(node.name or "")
    return frozenset(found)


_NAMED = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.ExceptHandler, ast.MatchAs, ast.MatchStar)
_BINDING = (ast.Name, ast.arg, ast.Import, ast.ImportFrom, *_NAMED)
"""Made once: of `A | B`, Python would make a new type for each node."""


def meant_by_use(name: str, member: str, given: Mapping[str, str], read: Collection[str]) -> str:
    """Return the one of the names that are `given` a value (by what makes it) and that nothing reads, which is meant
    by another name of which a member is read: it has that member, or begins as the name does; "" where there is not
    one."""
    stem = name.rstrip(digits)
    fitting = [
        one
        for one, kind in given.items()
        if one not in read
        and one.rstrip(digits) != stem  # the next of a series
        and (member in MEMBERS[kind] if kind in MEMBERS else len(name) > 1 and one.startswith(name))
    ]
    return fitting[0] if len(fitting) == 1 else ""


def made_by(nodes: Iterable[ast.AST]) -> dict[str, str]:
    """Return what is given a value, as it is written, and the last name of what is called for it."""
    assigned = [n for n in nodes if isinstance(n, ast.Assign)]
    return {ast.unparse(t): last_name(getattr(n.value, "func", None)) for n in assigned for t in n.targets}


def with_self(text: str) -> Iterator[Step]:
    """`def stop(Self):` of a method that uses `self`."""
    tree, lines = tree_of(text), text.split("\n")
    methods = (m for one in nodes_in(tree) if isinstance(one, ast.ClassDef) for m in one.body)
    for method in (m for m in methods if isinstance(m, ast.FunctionDef) and m.args.args):
        first, used = method.args.args[0], {n.id for n in nodes_in(method) if isinstance(n, ast.Name)}
        span = span_of(lines, first)  # type: ignore[arg-type] # an argument has a place too
        is_slip = is_one_edit(first.arg, "self") and "self" in used and first.arg not in used
        if is_slip and span is not None:
            after = edited(text, [(*span, "self")])
            yield from step_to("argument", first.lineno, text, after, OF_SELF % first.arg)
            return


OF_SELF = "a method's own object is called `self`, and not `%s`"


def with_methods(text: str) -> Iterator[Step]:
    """`def _init_(self):` of a class whose objects get their attributes there, and `def run():` of a method that is
    called on an object."""
    tree, lines = tree_of(text), text.split("\n")
    for method, beside, read in _methods_of_objects(tree):
        at = method.lineno - 1
        head = re.match(r"(\s*def\s+)(\w+)(\s*\(\s*)", lines[at])
        if head is None:
            continue
        before, name, bracket = head.groups()
        line, why = lines[at], ""
        if _is_meant_as_init(method, beside) and name not in read:
            line, why = f"{before}__init__{bracket}{line[head.end() :]}", OF_INIT % name
        elif name in {*read, "__init__"} and (_lacks_self(method) or _takes_only_the_message(tree, method)):
            comma = ", " if method.args.args else ""
            line, why = f"{head[0]}self{comma}{line[head.end() :]}", WITHOUT_SELF % name
            calls = (
                n for n in nodes_in(tree) if isinstance(n, ast.Call) and last_name(n.func) == "on_shutdown"
            )
            why += AT_THE_END if name in {last_name(given) for call in calls for given in call.args} else ""
        after = "\n".join([*lines[:at], line, *lines[at + 1 :]])
        for step in step_to("argument", method.lineno, text, after, why):
            yield step
            yield from with_methods(step["text"])
            return


OF_INIT = "Python calls the method `__init__` of a new object, and never `%s`"
WITHOUT_SELF = "`%s` is a method, so its first parameter has to be `self`"


PASSED = {"Subscriber": (2, "msg"), "Timer": (1, "event"), "Service": (2, "request")}
"""Which argument of a call is the function that ROS calls with one value, and what that is called."""


def with_parameters(text: str) -> Iterator[Step]:
    """`def tick():` of a timer, and `def on_text(msg, topic):` of a topic, of which `topic` is not used: ROS passes one
    value to a callback."""
    tree, lines = tree_of(text), text.split("\n")
    froms = [n for n in nodes_in(tree) if isinstance(n, ast.ImportFrom) and n.module != "rospy"]
    of_others = {"threading.Timer", *(a.asname or a.name for n in froms for a in n.names)}
    of_others |= {n.name for n in nodes_in(tree) if isinstance(n, ast.ClassDef)}
    calls = [n for n in nodes_in(tree) if isinstance(n, ast.Call) and last_name(n.func) in PASSED]
    for call in (n for n in calls if ast.unparse(n.func) not in of_others):
        place, usual = PASSED[last_name(call.func)]
        words = {str(k.arg): k.value for k in call.keywords}
        given = call.args[place] if len(call.args) > place else words.get("callback") or words.get("handler")
        function = _only_as_callback(tree, given)
        if function is None or "callback_args" in words or len(call.args) > place + 1:
            continue
        own = [one.arg for one in function.args.args]
        kept = own[: isinstance(given, ast.Attribute)]
        value = _name_of_value(tree, function, own[len(kept) :], usual)
        head = re.fullmatch(r"(\s*def\s+\w+\s*\()[\w\s,]*(\).*)", lines[function.lineno - 1])
        if head is None or len(own) == len(kept) + 1 or (kept and kept != ["self"]):
            continue
        fields = _fields_taken(function, own[len(kept) :]) if usual == "request" and not value else []
        if not (value or fields):
            continue
        line = f"{head[1]}{', '.join([*kept, value or usual])}{head[2]}"
        if fields:  # one for each field of the request
            read = f"{', '.join(fields)} = {', '.join(f'{usual}.{name}' for name in fields)}"
            line += f"\n{' ' * function.body[0].col_offset}{read}"
        after = "\n".join([*lines[: function.lineno - 1], line, *lines[function.lineno :]])
        why = f"`{function.name}` takes {plural(len(own), 'argument')}, but ROS passes it "
        why += f"{'`self` and ' if kept else ''}the {usual.replace('msg', 'message')}"
        for step in step_to("argument", function.lineno, text, after, why):
            yield step
            yield from with_parameters(step["text"])
            return


def _fields_taken(function: ast.FunctionDef, names: list[str]) -> list[str]:
    """Return the arguments of a function that may each be a field of a request; none where one is more than a value."""
    parts = {last_name(n.value) for n in nodes_in(function) if isinstance(n, ast.Attribute)}
    return names if function.body[0].lineno > function.lineno and parts.isdisjoint(names) else []


def _only_as_callback(tree: ast.Module, given: ast.expr | None) -> ast.FunctionDef | None:
    """Return the function that a call is given to call back; None where there is not one, or the script calls it."""
    name, nodes = last_name(given), nodes_in(tree)
    found = [n for n in nodes if isinstance(n, ast.FunctionDef) and n.name == name]
    methods = {m for n in nodes if isinstance(n, ast.ClassDef) for m in n.body}
    if isinstance(given, ast.Name) and methods.intersection(found):
        return None  # without `self.`, it is no method's name
    called = any(isinstance(n, ast.Call) and last_name(n.func) == name for n in nodes)
    if len(found) != 1 or called or found[0].decorator_list:
        return None
    taken = found[0].args
    plain = not (taken.vararg or taken.kwarg or taken.kwonlyargs or taken.defaults or taken.posonlyargs)
    return found[0] if plain else None


def _name_of_value(tree: ast.Module, function: ast.FunctionDef, own: Sequence[str], usual: str) -> str:
    """Return what a callback calls the one value that it is given: of its arguments the one that it uses, else a name
    that it reads a part of and nothing gives a value; "" where that is not plain."""
    names = [n for n in nodes_in(function) if isinstance(n, ast.Name)]
    used = [name for name in own if name in {n.id for n in names}]
    if own:
        return (used or own)[0] if len(used) < 2 else ""  # one of them is the value
    known = bound_in(tree) | set(dir(builtins))
    unknown = {n.id for n in names} - known
    called = {id(n.func) for n in nodes_in(function) if isinstance(n, ast.Call)}
    parts = (n for n in nodes_in(function) if isinstance(n, ast.Attribute) and id(n) not in called)
    read = {n.value.id for n in parts if isinstance(n.value, ast.Name)}
    if unknown:
        return unknown.pop() if len(unknown) == 1 and unknown <= read else ""
    return usual


def _methods_of_objects(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, set[str], set[str]]]:
    """Yield the methods of classes of which the script makes objects, with the names of all of the class's methods, and
    those that are read of its objects."""
    nodes = nodes_in(tree)
    for one in (n for n in tree.body if isinstance(n, ast.ClassDef)):
        made = {id(n) for n in nodes if isinstance(n, ast.Call) and last_name(n.func) == one.name}
        values = ((n.targets[0], n.value) for n in nodes if isinstance(n, ast.Assign))
        objects = {ast.unparse(target) for target, value in values if id(value) in made} | {"self"}
        methods = [m for m in one.body if isinstance(m, ast.FunctionDef) and not m.decorator_list]
        names = {m.name for m in methods}
        parts = (n for n in nodes if isinstance(n, ast.Attribute))
        read = {n.attr for n in parts if id(n.value) in made or ast.unparse(n.value) in objects}
        yield from ((method, names, read) for method in methods if made)


def _is_meant_as_init(method: ast.FunctionDef, beside: Collection[str]) -> bool:
    """Return whether a method has nearly the name `__init__`, which its class lacks, and gives objects attributes."""
    near = method.name.replace("_", "").lower() in ("init", "int", "inti", "ini")
    stores = any(isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store) for n in nodes_in(method))
    return near and stores and "__init__" not in beside


def _lacks_self(method: ast.FunctionDef) -> bool:
    """Return whether a method takes no argument, or uses a `self` that it does not take."""
    taken = {one.arg for one in (*method.args.posonlyargs, *method.args.args)}
    used = {n.id for n in nodes_in(method) if isinstance(n, ast.Name)}
    return method.args.vararg is None and (not taken or ("self" in used and "self" not in taken))


def _takes_only_the_message(tree: ast.Module, method: ast.FunctionDef) -> bool:
    """Return whether ROS calls a method back by `self.…`, and its one argument stands for the value that ROS passes: no
    part of it is one of the object's own."""
    nodes, taken = nodes_in(tree), [one.arg for one in method.args.args]
    calls = [n for n in nodes if isinstance(n, ast.Call) and last_name(n.func) in PASSED]
    given = {ast.unparse(a) for n in calls for a in (*n.args, *(k.value for k in n.keywords))}
    parts = [n for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    own = {n.attr for n in parts if n.value.id == "self"}  # type: ignore[attr-defined]
    read = {
        n.attr for n in nodes_in(method) if isinstance(n, ast.Attribute) and ast.unparse(n.value) in taken
    }
    plain = len(taken) == 1 and not (method.args.vararg or method.args.defaults)
    return (
        plain and f"self.{method.name}" in given and taken != ["self"] and bool(read - own) and not read & own
    )


def _classes_of_rospy(tree: ast.Module, member: str) -> set[str]:
    """Return what a script has from rospy by name, where `member` belongs to the objects of such classes alone."""
    imports = (n for n in tree.body if isinstance(n, ast.ImportFrom) and n.module == "rospy")
    names = {a.asname or a.name for n in imports for a in n.names}
    return names if member in ("publish", "sleep") else set()


def with_names(text: str) -> Iterator[Step]:
    """`true`, `rospu` and `Sting`: a name that nothing in the file has, and one alone is nearly the same."""
    tree, lines = tree_of(text), text.split("\n")
    bound = bound_in(tree)
    if "*" in bound or any(isinstance(n, ast.Try) and _catches_names(n) for n in nodes_in(tree)):
        return
    shared = {name for one in tree.body for name in _bound_by(one)}
    known = bound | set(dir(builtins)) | {"__file__"}
    loaded = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    functions = {n.name for n in nodes_in(tree) if isinstance(n, ast.FunctionDef)}
    kept = made_by(nodes_in(tree))
    unread = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name not in loaded]
    objects = {one: used - bound for one, used in _used_as_objects(tree).items()}
    parts = (one for one in tree.body if not isinstance(one, ast.Import | ast.ImportFrom))
    blocks = (inner for one in parts for inner in (one.body if isinstance(one, ast.ClassDef) else [one]))
    for block in blocks:
        own = shared | (bound_in(block) if isinstance(block, ast.FunctionDef) else set())
        missing = _missing_in(block, shared, known, kept if "self" in bound else ())
        stated = [
            n.value.id for n in nodes_in(block) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Name)
        ]
        parts_of = [n for n in nodes_in(block) if isinstance(n, ast.Attribute)]
        member_of = {n.value.id: n.attr for n in parts_of if isinstance(n.value, ast.Name)}
        given = {one: kind for one, kind in kept.items() if one in own}
        values = {n.id for n in nodes_in(block) if isinstance(n, ast.Name) and is_value(n, block)}
        idle = _meant_calls(unread, block)
        alone = {one: word for one in stated for word in ALONE if is_one_edit(one.lower(), word)}
        called = {getattr(n.func, "id", "") for n in nodes_in(block) if isinstance(n, ast.Call) and n.args}
        for name in dict.fromkeys(n.id for n in missing):
            of_python = next((one for one in OF_PYTHON if name in called and is_slip(name, one)), "")
            use = member_of.get(name, "")
            meant = OBVIOUS_NAMES.get(name) or ("__name__" if name == "name" and _is_guard(block) else "")
            near = own - _classes_of_rospy(tree, use)
            near = {n for n in near if given.get(n) != name and not (name in values and n in functions)}
            # `reading.state = 0` lacks `reading = Reading()`
            lost = [one for one in near if one.lower() == name.lower() and name in objects.get(one, ())]
            if lost and (first := _first_set(block, name)):
                yield from _with_object(text, first, name, lost[0])
                return
            near -= {*lost}
            meant = meant or meant_by(name, near, near - loaded) or idle.get(name, "")
            meant = meant or alone.get(name, of_python) or meant_by_use(name, use, given, loaded)
            meant = meant or (_unread_argument(block, name) if use else "")
            spans = [span for n in missing if n.id == name and (span := span_of(lines, n))]
            if meant and spans:
                after = edited(text, [(*span, meant) for span in spans])
                for step in step_to("name", spans[0][0] + 1, text, after, name):
                    yield step
                    yield from with_names(step["text"])
                    return


def _unread_argument(block: ast.stmt, name: str) -> str:
    """Return the only argument of a function, which it does not read: that is meant by `data.data` where the callback
    takes a `message`; "" where it reads it or has others. `this` is `self`."""
    if name == "this" and "self" in bound_in(block):
        return "self"
    taken = block.args.args if isinstance(block, ast.FunctionDef) else []
    names = [one.arg for one in taken if one.arg != "self"]
    read = {n.id for n in nodes_in(block) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    return names[0] if len(names) == 1 and names[0] not in read else ""


def _missing_in(
    block: ast.stmt, shared: Collection[str], known: Collection[str], kept: Collection[str]
) -> list[ast.Name]:
    """Return the uses of names without a value; what the object has (`kept`) is meant with `self.` before it, but not
    in `self.name = name`."""
    missing = [n for n in nodes_in(block) if isinstance(n, ast.Name) and n.id not in known]
    missing += _read_for_themselves(block, shared)
    taken = {n.value.id for n in nodes_in(block) if is_kept_by_self(n)}  # type: ignore[attr-defined]
    return [n for n in missing if n.id in taken or f"self.{n.id}" not in kept]


def with_targets(text: str) -> Iterator[Step]:
    """`self.cout = self.count + 1` and `couner = 0`: a value is given to a name that nothing reads, and is meant for
    one that is nearly the same; and `count = 0` in `__init__`, which is meant for `self.count`."""
    tree, lines = tree_of(text), text.split("\n")
    for one, (name, meant) in {**misnamed_targets(tree), **_meant_for_self(tree)}.items():
        span = span_of(lines, one.targets[0] if isinstance(one, ast.Assign) else one.target)
        if span is not None:
            why = f"nothing reads `{name}`, to which a value is given here: `{meant}` is meant"
            for step in step_to("argument", span[0] + 1, text, edited(text, [(*span, meant)]), why):
                yield step
                yield from with_targets(step["text"])
                return


def _meant_for_self(tree: ast.Module) -> dict[ast.Assign | ast.AugAssign, tuple[str, str]]:
    """Return the assignments in an `__init__` to a variable that nothing reads, where the object's attribute of that
    name is read and gets no value there, with both."""
    nodes = [n for n in nodes_in(tree) if isinstance(n, ast.Name | ast.Attribute)]
    read = {ast.unparse(n) for n in nodes if isinstance(n.ctx, ast.Load)}
    stored = Counter(ast.unparse(n) for n in nodes if isinstance(n.ctx, ast.Store))
    found = {}
    for init in (n for n in nodes_in(tree) if isinstance(n, ast.FunctionDef) and n.name == "__init__"):
        inside = nodes_in(init)
        own = {n.attr for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
        for one in (n for n in inside if isinstance(n, ast.Assign | ast.AugAssign)):
            target = one.targets[0] if isinstance(one, ast.Assign) else one.target
            name = target.id if isinstance(target, ast.Name) else ""
            if name not in read | own and f"self.{name}" in read and stored[name] == 1:
                found[one] = (name, f"self.{name}")
    return found


def is_kept_by_self(node: ast.AST) -> bool:
    """Return whether it is `self.name = name`."""
    if not isinstance(node, ast.Assign) or not isinstance(node.value, ast.Name):
        return False
    return ast.unparse(node.targets[0]) == f"self.{node.value.id}"


def _first_set(block: ast.stmt, name: str) -> int:
    """Return the line that uses a name first, where it sets a field of it; 0 where it does something else."""
    uses = [n for n in nodes_in(block) if isinstance(n, ast.Attribute) and last_name(n.value) == name]
    first = min(uses, key=lambda n: (n.lineno, isinstance(n.ctx, ast.Load)), default=None)
    alone = {n.lineno for n in nodes_in(block) if isinstance(n, ast.Name) and n.id == name}
    is_set = first is not None and isinstance(first.ctx, ast.Store) and first.lineno == min(alone)
    return first.lineno if first is not None and is_set else 0


def _with_object(text: str, line: int, name: str, kind: str) -> Iterator[Step]:
    """`reading = Reading()` above the line that sets a field of it."""
    lines, at = text.split("\n"), line - 1
    blanks = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
    for step in step_to(
        "name", line, text, with_line(lines, at, f"{blanks}{name} = {kind}()\n{lines[at]}"), name
    ):
        yield step
        yield from with_names(step["text"])


def _used_as_objects(tree: ast.Module) -> dict[str, set[str]]:
    """Return by the classes of messages and services that the script imports which names stand for no class: whose
    fields are set, that are called as a service is, or that are published."""
    froms = [n for n in nodes_in(tree) if isinstance(n, ast.ImportFrom)]
    nodes, used = nodes_in(tree), set[str]()
    used |= {
        last_name(n.value) for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)
    }
    calls = [n for n in nodes if isinstance(n, ast.Call)]
    used |= {last_name(a) for n in calls if last_name(n.func).startswith("publish") for a in n.args}
    called = {n.func.id for n in calls if isinstance(n.func, ast.Name)}
    return {
        one.name: used
        | (called if str(node.module).endswith(".srv") and not MADE.search(one.name) else set())
        for node in froms
        if str(node.module).endswith((".msg", ".srv"))
        for one in node.names
    }


MADE = re.compile("(Request|Response)$")
"""Classes of a service of which a script makes objects."""


def _meant_calls(unread: Sequence[ast.FunctionDef], block: ast.stmt) -> dict[str, str]:
    """Return by what is called in a block the one function of those that nothing names which takes as many arguments.
    Within a function it also has a word of the name: `add_server` for `server`."""
    found: dict[str, str] = {}
    for call in (one for one in nodes_in(block) if unread and isinstance(one, ast.Call) and not one.keywords):
        name = getattr(call.func, "id", "")
        words = {word for word in name.split("_") if len(word) > 2}
        fitting = [
            one.name
            for one in unread[:IDLE_MAX]
            if one is not block
            and len(one.args.args) == len(call.args)
            and (not isinstance(block, ast.FunctionDef) or words.intersection(one.name.split("_")))
        ]
        if len(fitting) == 1:
            found[name] = fitting[0]
    return found


def _read_for_themselves(block: ast.stmt, shared: Collection[str]) -> Iterator[ast.Name]:
    """Yield `talker` of `talker = talker()` where nothing else is called so, and a class `Talker` is there."""
    nodes = nodes_in(block)
    stored = [n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    for one in (n for n in nodes if isinstance(n, ast.Assign) and isinstance(n.value, ast.Call)):
        made, target = one.value.func, one.targets[0]  # type: ignore[attr-defined] # it is a call
        own = isinstance(made, ast.Name) and isinstance(target, ast.Name) and made.id == target.id
        others = {name for name in shared if name != getattr(made, "id", "")}
        if own and stored.count(made.id) == 1 and any(made.id.lower() == name.lower() for name in others):
            yield made


def _is_guard(node: ast.stmt) -> bool:
    """Return whether a statement begins the script's own part, `if name == 'main':` too."""
    test = node.test if isinstance(node, ast.If) else None
    word = test.comparators[0] if isinstance(test, ast.Compare) else None
    return isinstance(word, ast.Constant) and str(word.value).strip("_ ").lower() == "main"


def meant_by(name: str, own: AbstractSet[str], unused: Collection[str] = ()) -> str:
    """Return the one name of the script's own that is meant by one that has no value; "" where there is not one. Of the
    `unused`, one that is nearly the same is meant before all others."""
    own = meant_at_most(name, own)
    always = ("__name__", "True", "False", "None", *({"self", "rospy", "sys"} & own))
    if sure := [one for one in always if is_one_edit(name, one)]:
        return sure[0]
    inner = [one for one in own if is_letter_changed(name, one)]
    slips = [one for one in own & set(unused) if len(one) > SHORT_NAME_CHARS_MIN and is_one_edit(name, one)]
    if len(slips) == 1:
        return slips[0]
    if len(inner) == 1:
        return inner[0]
    longer = [one for one in own if len(one) >= NAME_CHARS_MIN]
    near = get_close_matches(name, longer, 2, 0.8) if len(name) >= NAME_CHARS_MIN else []
    if len(near) == 1 or len(name) < SHORT_NAME_CHARS_MIN:
        return near[0] if near else ""
    slips = [one for one in own if len(one) >= SHORT_NAME_CHARS_MIN and is_slip(name, one)]
    return slips[0] if len(slips) == 1 else ""


def is_letter_changed(name: str, other: str) -> bool:
    """Return whether one letter within two longer names is not the same: `teyt` for `text`. By the first or the last
    one, or by a digit, they are different names."""
    pairs = [(a, b) for a, b in zip(name, other, strict=False) if a != b]
    same_ends = len(name) == len(other) >= NAME_CHARS_MIN and (name[0], name[-1]) == (other[0], other[-1])
    return same_ends and len(pairs) == 1 and "".join(pairs[0]).isalpha()


def is_slip(name: str, other: str) -> bool:
    """Return whether two short names differ by capitals, by a letter that is missing, or by two that are exchanged; by
    another letter they are different names."""
    one, two = name.lower(), other.lower()
    return one == two or (is_one_edit(one, two) and (len(one) != len(two) or sorted(one) == sorted(two)))


def _bound_by(statement: ast.stmt) -> frozenset[str]:
    """Return the names that a statement of the script gives a value to, none of those within functions and classes."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return frozenset({statement.name})
    return bound_in(statement)


def _catches_names(block: ast.Try) -> bool:
    kinds = [ast.unparse(handler.type) if handler.type else "" for handler in block.handlers]
    return any("NameError" in kind for kind in kinds)


OLD_METHODS = {"iteritems": "items", "itervalues": "values", "iterkeys": "keys"}
"""Methods of a dict that have another name now; pandas has the first one of its own."""


def old_methods(tree: ast.AST, text: str) -> Iterator[tuple[str, tuple[int, int, int], str]]:
    """Yield the name, the place and the new text of calls of methods that dicts no longer have."""
    lines, nodes = text.split("\n"), list(nodes_in(tree))
    own = {n.name for n in nodes if isinstance(n, ast.FunctionDef)}
    operands = (ast.Compare, ast.BinOp, ast.Attribute)
    inner = {id(c) for n in nodes if isinstance(n, operands) for c in ast.iter_child_nodes(n)}
    for n in nodes:
        if not (isinstance(n, ast.Call) and isinstance(n.func, ast.Attribute)) or n.func.attr in own:
            continue
        name, span, of_name = n.func.attr, span_of(lines, n), span_of(lines, n.func)
        if name == "has_key" and len(n.args) == 1 and span:
            key, owner = (ast.get_source_segment(text, one) for one in (n.args[0], n.func.value))
            new = f"{key} in {owner}"
            yield name, span, f"({new})" if id(n) in inner else new
        elif name in OLD_METHODS and not n.args and of_name and "pandas" not in text:
            line, _, end = of_name
            yield name, (line, end - len(name), end), OLD_METHODS[name]
