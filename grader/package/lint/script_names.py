"""Finds the names in a student's Python that are not there when they are read, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins
import difflib
from collections import Counter

from script_tree import (
    FUNCTIONS,
    LOOPS,
    TEXT_LIMIT,
    all_of,
    called_name,
    calls_in,
    dotted,
    lines_from,
    names_in,
    of_roscpp,
    parents_of,
    published_type,
    slip,
    statements_of,
    text_of,
    walk,
)

NAMES_LIMIT = 500
USES_LIMIT = 40
"""So many uses of unknown names are explained in a file: each takes a look at all of it."""
MODULE_NAMES = {"__file__", "__builtins__", "__annotations__", "WindowsError", "exit", "quit"}
OLD_NAMES = {
    "xrange", "raw_input", "unicode", "basestring", "unichr", "long", "reduce", "reload", "execfile", "cmp",
}  # fmt: skip
"""Of Python 2: the traceback is explained by what Python 3 has in their place."""
EXCEPTIONS = {name for name in dir(builtins) if name.endswith(("Error", "Exception", "Interrupt"))}
OF_VARIABLES = ("name", "topic")
"""So ends the name of a variable that has a name for its value."""
EXCEPTIONS_OF_ROSPY = (
    "ROSException", "ROSInitException", "ROSInternalException", "ROSInterruptException", "ROSSerializationException",
    "ROSTimeMovedBackwardsException", "ServiceException", "TransportException", "TransportInitError",
    "TransportTerminated",
)  # fmt: skip
FITTING = {ast.ExceptHandler: EXCEPTIONS, ast.Expr: {"pass", "break", "continue", "return"}}
"""What a name is meant for by where it stands, besides names."""
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


# ---- names that are not there


def unfit_for_methods(tree):
    """Return what a script has from rospy by name, by the identity of names of which it calls a method that only the
    objects of such classes have."""
    imports = [n for n in all_of(tree, ast.ImportFrom) if n.module == "rospy"]
    names = {a.asname or a.name for n in imports for a in n.names}
    return {id(n.value): names for n in all_of(tree, ast.Attribute) if n.attr in ("publish", "sleep")}


def misspelt(tree):
    """Names that are read where nothing has given them a value: `misspelt` where one that is bound is spelt alike, or
    `self` has one of that name, else `undefined`."""
    names, imported = all_of(tree, ast.Name), {a.name for n in all_of(tree, ast.Import) for a in n.names}
    own = given_names(tree, names)
    if "*" in own or len(own) > NAMES_LIMIT:
        return
    attributes = {dotted(n) for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Store)}
    known = own | set(dir(builtins)) | MODULE_NAMES | imported_otherwise(tree, {n.id for n in names})
    outside = {id(n) for n in outside_methods(tree)}
    unbound = unbound_names(tree, known)
    keys, texts, unfit = without_quotes(tree, known), where_texts_stand(tree), unfit_for_methods(tree)
    stored = {n.id for n in names if isinstance(n.ctx, ast.Store)}
    functions = {n.name for n in all_of(tree, *FUNCTIONS[:2])} - stored
    odd = {*keys, *unbound, *outside}
    made = {dotted(n.targets[0]): dotted(getattr(n.value, "func", None)) for n in all_of(tree, ast.Assign)}
    unknown = [n for n in names if n.id not in known or id(n) in odd][:USES_LIMIT]
    strays = sorted({n.lineno for n in unknown if id(n) in outside and (n.id == "self" or n.id not in known)})
    yield from slips_outside(strays)
    told = {id(n.func.value) for n in of_roscpp(tree)}
    unknown = [n for n in unknown if (id(n) not in outside or n.lineno not in strays) and id(n) not in told]
    of_classes = {id(n) for one in tree.body if isinstance(one, ast.ClassDef) for n in ast.walk(one)}
    for node in unknown:
        kind, line, message = "undefined", node.lineno, ""
        fitting = stored if id(node) in texts else own - functions if is_value(node, tree) else own
        fitting = fitting - unfit.get(id(node), set())
        others = attributes if id(node) in of_classes else set()
        near = meant_for(node, tree, known, fitting, others)
        near = "" if made.get(near) == node.id else near  # `twist = Twist()` lacks an import
        if id(node) in keys:
            message = "the key `%s` is written here without quotes" % node.id
            fix = "on line %d, write `%s`" % (line, keys[id(node)])
        elif near and not (node.id in MODULES and near in imported):  # there the import has it wrong
            guards = near == "__name__" and is_guard(node, tree)
            kind, message = "misspelt", "did you mean %s?" % near
            near = "if __name__ == '__main__':" if guards else of_module(near, node, tree, imported)
            message = message if guards else "did you mean %s?" % near
            fix = "write `%s`" % near if guards else "write %s instead of %s" % (near, node.id)
        elif node.id not in known and (argument := unread_argument(node, tree)):
            kind, message = "misspelt", "the argument of `%s` is called `%s`" % argument
            fix = "write %s instead of %s" % (argument[1], node.id)
        elif id(node) in unbound and id(node) in texts and not node.id.endswith(OF_VARIABLES):
            message = "`%s` is written here without quotes" % node.id
            fix = "on line %d, write `'%s'`" % (line, node.id)
        elif id(node) in unbound:
            message, fix = why_unbound(node, tree, known)
        if message:
            yield slip(line, kind, message, fix, node.id)


def misspelt_exceptions(tree):
    """Exceptions of rospy that an `except` names and that are spelt otherwise: it fails only once something else has
    gone wrong in its `try`, or the node is to end."""
    for handler in all_of(tree, ast.ExceptHandler):
        for node in getattr(handler.type, "elts", [handler.type]):
            owner, _, name = dotted(node).rpartition(".")
            if owner != "rospy" or name in EXCEPTIONS_OF_ROSPY:
                continue
            near = difflib.get_close_matches(name.lower(), map(str.lower, EXCEPTIONS_OF_ROSPY), 1, 0.85)
            for meant in (one for one in EXCEPTIONS_OF_ROSPY if near == [one.lower()]):
                fix = "write rospy.%s instead of rospy.%s" % (meant, name)
                yield slip(node.lineno, "misspelt", "did you mean rospy.%s?" % meant, fix, "rospy." + name)


def meant_for(node, tree, known, fitting, attributes):
    """Return which of the fitting names, or of the attributes with `self.`, a name is spelt like; "" for none."""
    if node.id == "name" and is_guard(node, tree):
        return "__name__"
    if node.id in known | OLD_NAMES:
        return ""
    if node.id in ("ros", "rclpy") and "rospy" in fitting:
        return "rospy"
    around = parents_of(tree).get(node)
    # what an object has is not meant by `name` in `self.name = name`
    others = attributes.difference(map(dotted, getattr(around, "targets", ())))
    return spelt_alike(node.id, fitting | FITTING.get(type(around), set()), others)


def given_names(tree, names):
    """Return what anything in the file gives a value, imports or declares."""
    own = {n.id for n in names if not isinstance(n.ctx, ast.Load)}
    for node in walk(tree):
        if not isinstance(node, ast.keyword):
            bound = [getattr(node, key, None) for key in ("name", "asname", "arg", "rest")]
            own.update(part for text in bound if isinstance(text, str) for part in text.split("."))
        if isinstance(node, (ast.Global, ast.Nonlocal)):
            own.update(node.names)
    return own


def without_quotes(tree, known):
    """Return the names that stand for keys, by their ids, with the value as it is written with quotes:
    `d['name']['first']` for `d[name][first]`.

    Nothing gives such a name a value, or only the line that it stands in does (`phone = d[phone]`). Only where a script
    reads parameters, or has other keys in quotes.
    """
    arguments, lines = {n.arg for n in all_of(tree, ast.arg)}, {}
    for node in walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            lines.setdefault(node.id, []).append(node.lineno)

    def is_key(node):
        own = lines.get(node.id) == [node.lineno] and node.id not in arguments
        return (own or node.id not in known) and len(node.id) > 1

    values = all_of(tree, ast.Subscript)
    keyed = any(text_of(key_of(n)) for n in values)
    reads = any(called_name(n) in ("get_param", "get_param_cached") for n in walk(tree))
    found = {}
    for value in values if keyed or reads else ():
        text, node = "", value
        while isinstance(node, ast.Subscript) and isinstance(key_of(node), (ast.Name, ast.Constant)):
            key = key_of(node)
            name = getattr(key, "id", "")
            text = "[%s]" % (repr(name) if name and is_key(key) else name or repr(key.value)) + text
            node = node.value
        if isinstance(node, (ast.Name, ast.Attribute)):
            for key in map(key_of, [n for n in ast.walk(value) if isinstance(n, ast.Subscript)]):
                if isinstance(key, ast.Name) and is_key(key):
                    found.setdefault(id(key), dotted(node) + text)
    return found


FRAMES = ("frame_id", "child_frame_id")
OF_TWO_FRAMES = ("lookup_transform", "can_transform", "lookupTransform", "canTransform", "waitForTransform")
OF_NAMES = (
    "init_node", "Publisher", "Subscriber", "Service", "ServiceProxy", "get_param", "has_param", "set_param",
    "delete_param", "wait_for_message", "wait_for_service", "SimpleActionServer", "SimpleActionClient",
)  # fmt: skip


def where_texts_stand(tree):
    """Return the identities of what stands where ROS is given a name: of a node, a topic, a parameter or a frame."""
    found = set()
    for node in walk(tree):
        name = called_name(node)
        if name in OF_NAMES or name in OF_TWO_FRAMES:
            found.update(map(id, node.args[: 2 if name in OF_TWO_FRAMES else 1]))
        elif isinstance(node, ast.Assign) and getattr(node.targets[0], "attr", "") in FRAMES:
            found.add(id(node.value))
    return found


def key_of(subscript):
    """Return what stands in the brackets; up to Python 3.8 it is wrapped."""
    return subscript.slice.value if type(subscript.slice).__name__ == "Index" else subscript.slice


def imported_otherwise(tree, names):
    """Return those of the names that are classes of messages or services, and are imported with other capitals: it is
    the import that fails; and those of Python 2, where a script asks for Python's version."""
    froms = all_of(tree, ast.ImportFrom)
    modules = [n for n in froms if (n.module or "").endswith((".msg", ".srv"))]
    imported = {alias.name.lower() for n in modules for alias in n.names}
    versions = ("version_info", "hexversion", "python_version", "PY2", "PY3")
    is_old = any(isinstance(n, ast.Attribute) and n.attr in versions for n in walk(tree))
    return {name for name in names if name.lower() in imported or (is_old and name in OLD_NAMES)}


DIGITS = "0123456789"
SERIES = (set("xyz"), set("XYZ"), set("lr"), set("LR"), set(DIGITS))


def is_of_series(name, other):
    """Return whether two names differ only by a digit, or by the letter of an axis or a side at the end of a word."""
    if len(name) != len(other):
        return False
    at = [i for i in range(len(name)) if name[i] != other[i]]
    if len(at) != 1:
        return False
    around = (name[: at[0]][-1:] or "_") + (name[at[0] + 1 :][:1] or "_")
    return ("_" in around or name[at[0]] in DIGITS) and any(
        {name[at[0]], other[at[0]]} <= one for one in SERIES
    )


def meant_at_most(name, own):
    """Return those of the names that another one may be meant for."""
    stem = name.rstrip(DIGITS)
    if name[0].islower() and any(one != stem != name and one.rstrip(DIGITS) == stem for one in own):
        return set()  # the next of a series, `pub3` behind `pub` and `pub2`, means none of them
    if name[:1].isupper():  # a class is not meant by a variable with a name like it
        own = {one for one in own if one[:1].isupper() or one.lower() == name.lower()}
    return {one for one in own if not is_of_series(name, one)}


def of_module(near, node, tree, imported):
    """Return the name that is meant: where a class is meant by the name of its module, behind that one's name."""
    is_module = isinstance(parents_of(tree).get(node), ast.Attribute)
    is_class = near in imported and node.id == near.capitalize() and node.id in CLASSES.get(near, ())
    return "%s.%s" % (near, node.id) if is_class and not is_module else near


CLASSES = {"queue": ("Queue",), "decimal": ("Decimal",), "threading": ("Thread", "Lock", "Event", "Timer")}
"""Of modules of Python, classes that beginners write in lower case, or without their module."""


def spelt_alike(name, own, attributes):
    """Return the name that is meant, "" where none is alike."""
    if "self." + name in attributes:
        return "self." + name
    if name.strip("_") == "name" != name or difflib.get_close_matches(name.lower(), ["__name__"], 1, 0.8):
        return "__name__"
    own = meant_at_most(name, own)
    near = difflib.get_close_matches(name[:TEXT_LIMIT], sorted(own | {"None", "True", "False"}), 1, 0.8)
    near = near or [n for n in sorted(own) if sorted(n) == sorted(name) or n.lower() == name.lower()]
    return near[0] if near else ""


def is_value(node, tree):
    """Whether a name stands where a function makes no sense: in a calculation, or in what is answered."""
    around = parents_of(tree).get(node)
    if isinstance(around, ast.Call):
        return node in around.args and called_name(around).endswith(("Response", "Result", "Feedback"))
    return isinstance(around, (ast.BinOp, ast.Compare))


def is_guard(node, tree):
    """Whether it is compared where the script's own part begins."""
    tests = [n.test for n in tree.body if isinstance(n, ast.If)]
    return any(isinstance(test, ast.Compare) and test.left is node for test in tests)


def never_main(node, tree):
    """Return why `if __name__ == '__main__':`, or what stands in its place, never holds, behind what stands there for
    the one or the other; two empty texts where it may hold."""
    sides = [node.test.left, node.test.comparators[0]]
    words = [one.value if isinstance(one, ast.Constant) else None for one in sides]
    named = [getattr(one, "id", "") for one in sides]
    if isinstance(node.test.ops[0], NEVER):
        plain = [one for one in tree.body if not isinstance(one, (ast.FunctionDef, ast.ClassDef))]
        running = [one for one in plain if any(isinstance(n, ast.Call) for n in ast.walk(one))]
        hides = "__name__" in named and "__main__" in words and running == [node] and not node.orelse
        return "", "`__name__` is '__main__' whenever the script is run" if hides else ""
    if not isinstance(node.test.ops[0], (ast.Eq, ast.Is)):
        return "", ""
    if "__name__" in named:
        word = words[1 - named.index("__name__")]
        return ("", "") if word in ("__main__", None) else (repr(word), "`__name__` is never %r" % (word,))
    at = 1 - words.index("__main__") if "__main__" in words else 0
    given = {n.id for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Store)}
    given |= {n.arg for n in all_of(tree, ast.arg)}
    name = repr(words[at]) if isinstance(words[at], str) and words[at] != "__main__" else named[at]
    is_odd = "__main__" in words and name and name not in given
    return (name, "`%s` is never '__main__'" % name) if is_odd else ("", "")


NEVER = (ast.NotEq, ast.Lt, ast.Gt)
"""Comparisons that do not hold between equal values."""


def unread_argument(node, tree):
    """Return a function and its only argument, which it never reads, where it takes a field of `node` instead."""
    parents, functions = parents_of(tree), []
    one = parents.get(node)
    while isinstance(parents.get(node), ast.Attribute) and one is not None:
        functions += [one] if isinstance(one, ast.FunctionDef) else []
        one = parents.get(one)
    for function in reversed(functions):
        given = [one.arg for one in function.args.args if one.arg != "self"]
        if len(given) == 1 and given[0] not in names_in(function):
            return function.name, given[0]
    return None


def walk_own(function):
    """Yield the nodes that are run when the function is: not those of functions that it defines."""
    left = list(function.body)
    while left:
        node = left.pop()
        if not isinstance(node, (ast.FunctionDef, ast.Lambda)):
            yield node
            left += ast.iter_child_nodes(node)


def of_the_function_around(tree):
    """`global n` in a function of a function that has `n`, where the module has none."""
    module, named = bound_names(tree), Counter(n for one in all_of(tree, ast.Global) for n in one.names)
    for outer in all_of(tree, ast.FunctionDef):
        inner = [n for n in outer.body if isinstance(n, ast.FunctionDef)]
        own = bound_names(outer) if inner else ()
        for node, function in ((n, one) for one in inner for n in one.body if isinstance(n, ast.Global)):
            for name in (n for n in node.names if n in own and n not in module and named[n] == 1):
                read = (n for n in ast.walk(function) if isinstance(n, ast.Name) and n.id == name)
                line = min((n.lineno for n in read), default=node.lineno)
                message = "`global %s` on line %d is not the `%s` of `%s`" % (
                    name,
                    node.lineno,
                    name,
                    outer.name,
                )
                fix = "on line %d, write `nonlocal` instead of `global`" % node.lineno
                yield slip(line, "undefined", message, fix, name)


def outside_methods(tree):
    """Yield the nodes of statements that stand in a class and call something, in none of its methods."""
    for node in walk(tree):
        for statement in node.body if isinstance(node, ast.ClassDef) else ():
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
                yield from ast.walk(statement)


def slips_outside(lines):
    """Yield these lines of a class that are in none of its methods, with those next to each other in one fix."""
    for at, line in enumerate(lines):
        message = "line %d is in the class, but in none of its methods, so it runs before them" % line
        together = [one for i, one in enumerate(lines) if i - one == at - line]
        where, them = lines_from(together[0], together[-1]), "them" if together[1:] else "it"
        fix = "indent %s like the lines of the method above %s, or delete %s" % (where, them, them)
        yield slip(line, "outside-method", message, fix)


def unbound_names(tree, known):
    """Return the identities of the names that are read where no scope around them binds them.

    A script that binds names as it runs has none, and neither has a `try:` that catches what such a name raises.
    """
    if any(called_name(n) in ("exec", "globals", "locals", "setattr") for n in walk(tree)):
        return set()
    shared = {name for n in all_of(tree, ast.Global) for name in n.names}
    builtin = (set(dir(builtins)) | MODULE_NAMES | OLD_NAMES) & known
    found, left = set(), [(tree, bound_names(tree) | shared | builtin)]
    while left:
        node, visible = left.pop()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in visible:
            found.add(id(node))
        if isinstance(node, ast.Try) and any(catches_names(h) for h in node.handlers):
            left += [(child, visible) for child in [*node.handlers, *node.orelse, *node.finalbody]]
            continue
        if isinstance(node, FUNCTIONS):
            inner = visible | bound_names(node)
            body = node.body if isinstance(node.body, list) else [node.body]
            outer = [c for c in ast.iter_child_nodes(node) if c not in body]
            left += [(c, visible) for c in outer] + [(c, inner) for c in body]
        elif isinstance(node, ast.ClassDef):
            own = visible | bound_names(node)
            for child in ast.iter_child_nodes(node):
                body = set(statements_of(child)) if isinstance(child, FUNCTIONS) else ()
                # a method's decorators and default values can read what its class has, its body cannot
                inner = visible | bound_names(child) if body else own
                parts = ast.iter_child_nodes(child) if body else [child]
                left += [(one, inner if one in body else own) for one in parts]
        else:
            inner = visible | set_in(node) if isinstance(node, COMPREHENSIONS) else visible
            left += [(child, inner) for child in ast.iter_child_nodes(node)]
    return found


def set_in(node):
    """Return the names that are set somewhere in a node."""
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}


def catches_names(handler):
    return not caught_by(handler).isdisjoint(["", "NameError", "Exception", "BaseException"])


def caught_by(handler):
    """Return the names of what an `except` catches, "" for all."""
    kinds = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    return {dotted(kind) if kind is not None else "" for kind in kinds}


def bound_names(scope):
    """Return what a module, class or function binds itself, none of what functions and classes in it do."""
    names, foreign = set(), set()
    given = getattr(scope, "args", None)
    left = [*ast.iter_child_nodes(given)] if isinstance(scope, FUNCTIONS) else []
    left += statements_of(scope)
    while left:
        node = left.pop()
        if isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.alias):
            names.add((node.asname or node.name).partition(".")[0])
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, ast.Global):
            foreign.update(node.names)
        elif isinstance(node, ast.Nonlocal):
            names.update(node.names)
        elif isinstance(getattr(node, "name", None), str):
            names.add(node.name)
        if isinstance(getattr(node, "rest", None), str):
            names.add(node.rest)
        if not isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            left += ast.iter_child_nodes(node)
    return names - foreign


ALIASES = {"np": "numpy as np", "plt": "matplotlib.pyplot as plt", "pd": "pandas as pd"}
MODULES = {
    "copy", "cv2", "datetime", "json", "math", "numpy", "os", "queue", "random", "re", "rosbag", "roslib", "rospy",
    "signal", "socket", "string", "struct", "subprocess", "sys", "tf", "threading", "time", "traceback", "yaml",
}  # fmt: skip
GIVEN_BY_NAME = {"queue_size": "10", "anonymous": "True", "latch": "True"}
"""Arguments of rospy's functions that are written with their name, and a value that most labs give them."""
CALL_BACK = ("Subscriber", "Service", "Timer")
"""What is given a function that rospy calls."""
EXCEPTION_NAMES = {"e", "err", "error", "ex", "exc", "exception"}
MADE = {"publish": "rospy.Publisher('…', …, queue_size=10)", "sleep": "rospy.Rate(…)"}
"""What a variable has to be given by the method that is called of it."""


def undefined(node, tree):
    """Return why a name is not there that the file gives no value anywhere, and what to do."""
    name = node.id
    why = "nothing in the file gives `%s` a value" % name
    around = parents_of(tree).get(node)
    used = around if node in (getattr(around, "value", None), getattr(around, "func", None)) else None
    calls = [around] if isinstance(around, ast.Call) and node in around.args else []
    if name in GIVEN_BY_NAME and calls:
        return "`%s` is named here without its value" % name, "write `%s=%s`" % (name, GIVEN_BY_NAME[name])
    if any(called_name(n) == "Publisher" and node in n.args[2:] for n in calls):
        return why, "on line %d, delete `%s` from the call of `Publisher`" % (node.lineno, name)
    meant = unread_alike(node, tree) if any(called_name(n) == "publish" for n in calls) else []
    if len(meant) == 1:
        unread = ", and nothing reads `%s`" % meant[0]
        return why + unread, "on line %d, write %s instead of %s" % (node.lineno, meant[0], name)
    inner = used.attr if isinstance(used, ast.Attribute) else ""
    module = "%s.%s" % (name, inner) if inner in ("msg", "srv") else ALIASES.get(name, name)
    if module != name or (name in MODULES and inner):
        return "`%s` is not imported" % name, "write `import %s` at the top" % module
    idle = idle_functions(node, tree) if isinstance(used, ast.Call) and not used.keywords else []
    fitting = [one.name for one in idle if len(one.args.args) == len(used.args)]
    if len(fitting) == 1:
        fix = "on line %d, write `%s` instead of `%s`" % (node.lineno, fitting[0], name)
        return "%s, and nothing calls `%s`" % (why, fitting[0]), fix
    return why, "above line %d, %s" % what_to_write(node, used, tree)


def why_unbound(node, tree, known):
    """Return why nothing around a name gives it a value, and what to do."""
    return unnamed_exception(node, tree) or (known_elsewhere if node.id in known else undefined)(node, tree)


def unnamed_exception(node, tree):
    """Return why a name is not there that is called like an exception, in an `except …:` that does not name its own or
    names it in another way (`except X(e):`, `except X.e:`), and what to do; None for any other name."""
    parents, one = parents_of(tree), node
    while one is not None and not isinstance(one, ast.ExceptHandler):
        one = parents.get(one)
    if one is None or one.name:
        return None
    kinds = getattr(one.type, "elts", [one.type])
    in_clause = isinstance(one.type, ast.Call) and node in one.type.args
    if not in_clause and node.id not in EXCEPTION_NAMES:
        return None
    named = [dotted(getattr(kind, "func", kind)) for kind in kinds if kind is not None]
    named = [kind for kind in named if kind != node.id] or ["Exception"]
    if any("..." in kind for kind in named):
        return None
    caught = "(%s)" % ", ".join(named) if len(named) > 1 else named[0]
    caught = caught[: -len(node.id) - 1] if caught.endswith("." + node.id) else caught
    message = "`%s` would be the exception, which line %d does not name" % (node.id, one.lineno)
    return message, "on line %d, write `except %s as %s:`" % (one.lineno, caught, node.id)


def idle_functions(node, tree):
    """Return the functions of the file itself that nothing in it names. Within a function, only those that have a word
    of the name that stands there."""
    named = {n.id for n in all_of(tree, ast.Name)}
    functions = all_of(tree, ast.FunctionDef)
    inside = [n for n in functions if n.lineno <= node.lineno <= n.end_lineno]
    words = words_of(node.id)
    own = (n for n in tree.body if isinstance(n, ast.FunctionDef))
    idle = [n for n in own if n.name not in named and n not in inside]
    return [n for n in idle if not inside or words & words_of(n.name)]


def words_of(name):
    """Return the words of three letters and more that a name is made of."""
    return {word for word in name.split("_") if len(word) > 2}


def unread_alike(node, tree):
    """Return the variables of its function that get a value above a name, that nothing reads, and whose names have a
    word of it: `hello_str` for `hello`."""
    parents = parents_of(tree)
    scope = parents.get(node)
    while scope is not None and not isinstance(scope, (ast.FunctionDef, ast.Module)):
        scope = parents.get(scope)
    names = [n for n in all_of(tree, ast.Name) if len(n.id) > 1]
    read = {n.id for n in names if isinstance(n.ctx, ast.Load)}
    own = (n for n in ast.walk(scope or tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    above = {n.id for n in own if n.lineno < node.lineno} - read
    return sorted(one for one in above if words_of(node.id) & words_of(one))


def what_to_write(node, used, tree):
    """Return the line above which a name has to get its value, and how that is written. `used` is what the value is
    used in."""
    name, line = node.id, node.lineno
    inner = used.attr if isinstance(used, ast.Attribute) else ""
    around = parents_of(tree).get(node)
    is_constant = name.isupper() and len(name) > 1
    if name[:1].isupper() and not is_constant:
        return line, "define %s or import it (a message: `from <package>.msg import %s`)" % (name, name)
    if isinstance(used, ast.Call):
        return line, "define it with `def %s(…):`, or import it" % name
    if called_name(around) in CALL_BACK and node in around.args[1:]:
        return line, "define it with `def %s(…):`" % name
    if inner in MADE:
        loops = [n.lineno for n in all_of(tree, *LOOPS) if node in ast.walk(n)]
        return min([line, *loops]), "write `%s = %s`" % (name, MADE[inner])
    sent = {one.id for n in calls_in(tree, "publish") for one in n.args if isinstance(one, ast.Name)}
    if name in sent or (isinstance(used, ast.Attribute) and isinstance(used.ctx, ast.Store)):
        types = {published_type(n) for n in walk(tree) if called_name(n) == "Publisher"} - {""}
        return line, "create the message: `%s = %s()`" % (name, types.pop() if len(types) == 1 else "<Type>")
    if is_constant:
        starts = [n.lineno for n in tree.body if isinstance(n, (ast.ClassDef, ast.If, *FUNCTIONS))]
        line = min([line, *starts])
    return line, "write `%s = …`, with the value that it should have" % name


def known_elsewhere(node, tree):
    """Return why a name is not there that only a function or a class has, and what to do; "" where none has it."""
    name = node.id
    if name == "self":  # what calls the method says what it lacks
        return "", ""
    for one in walk(tree):
        if isinstance(one, ast.ClassDef) and name in bound_names(one):
            owner = "self" if any(n is node for n in ast.walk(one)) else "%s()" % one.name
            fix = "on line %d, write `%s.%s` instead of `%s`" % (node.lineno, owner, name, name)
            return "`%s` belongs to the class %s" % (name, one.name), fix
    for one in walk(tree):
        if isinstance(one, ast.FunctionDef) and name in bound_names(one):
            imports = [n for n in ast.walk(one) if isinstance(n, (ast.Import, ast.ImportFrom))]
            where = "`%s` has a value only in `%s(…)`" % (name, one.name)
            if any(name in (a.asname, a.name) for n in imports for a in n.names):
                return where, "move its import to the top of the file"
            if name in {arg.arg for arg in ast.walk(one.args) if isinstance(arg, ast.arg)}:
                return where, "keep it there in another variable, which is `global` or belongs to `self`"
            return where, "below line %d, write `global %s`" % (one.lineno, name)
    return "", ""
