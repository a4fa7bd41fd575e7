"""Looks into the syntax tree of a student's Python, for what finds slips in it.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

TEXT_LIMIT = 300
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
LOOPS = (ast.While, ast.For)
CALLBACKS = {"Subscriber": (2, "callback"), "Service": (2, "handler"), "Timer": (1, "callback")}
"""The place and the name of the argument that is a callback."""


def walk(tree):
    """Return all the nodes of a module, as `ast.walk` yields them: kept, since each finder asks for them."""
    if not hasattr(tree, "all_nodes"):
        tree.all_nodes = list(ast.walk(tree))
    return tree.all_nodes


def all_of(tree, *kinds):
    """Return the nodes of a module that are of these kinds."""
    return [n for n in walk(tree) if isinstance(n, kinds)]


def reads_names_in_texts(tree):
    """Return whether a text of the module may use a name of it, as in `eval('2 * pi')`."""
    return any(called_name(n) in ("locals", "globals", "vars", "eval", "exec", "getattr") for n in walk(tree))


def parents_of(tree):
    """Return the node around each node of a module: kept, as above."""
    if not hasattr(tree, "all_parents"):
        tree.all_parents = {child: node for node in walk(tree) for child in ast.iter_child_nodes(node)}
    return tree.all_parents


def loop_around(node, tree):
    """Return the innermost loop that a node is in, None outside of all."""
    node = parents_of(tree).get(node)
    while node is not None and not isinstance(node, LOOPS):
        node = parents_of(tree).get(node)
    return node


def is_call(node, *names):
    """Return whether it is a call `a.b()`, `b` being one of the names."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in names


def calls_in(node, *names):
    """Return all such calls in a node, itself included."""
    return [n for n in getattr(node, "all_nodes", None) or ast.walk(node) if is_call(n, *names)]


def of_roscpp(node):
    """Return the calls of what roscpp has and rospy has not: `rospy.spinOnce()`, `ros.ok()`."""
    return [
        n for n in calls_in(node, "spinOnce", "spin_once", "ok") if dotted(n.func.value) in ("rospy", "ros")
    ]


def functions_in(tree):
    """Return the functions and methods of a module by their names."""
    return {n.name: n for n in all_of(tree, ast.FunctionDef)}


def gives_function(function):
    """Whether it returns a function that it makes: one within it, a `lambda`, `partial(…)`."""
    inside = list(ast.walk(function))
    made = {n.name for n in inside if isinstance(n, (ast.FunctionDef, ast.ClassDef)) and n is not function}
    given = [n.value for n in inside if isinstance(n, ast.Return)]
    return any(isinstance(n, ast.Lambda) or called_name(n) == "partial" or dotted(n) in made for n in given)


def callback_of(call, functions):
    """Return the script's function that a `Subscriber(…)` is given; None of any other node."""
    given = argument(call, 2, "callback") if called_name(call) == "Subscriber" else []
    return functions.get(dotted(given[0]).rpartition(".")[2]) if given else None


def targets_of(tree):
    """Return the name that each value is given to, by the identity of the value."""
    return {id(n.value): dotted(n.targets[0]) for n in all_of(tree, ast.Assign)}


def argument(call, place, keyword):
    """Return the argument of a call at that place or of that name, as a list of one; an empty one where it has none."""
    if any(isinstance(one, ast.Starred) for one in call.args[: place + 1]):
        return []  # what it stands for, and in which place, is not known
    return call.args[place : place + 1] or [k.value for k in call.keywords if k.arg == keyword]


def text_of(node):
    """Return a text as it is written in the source, "" of all else."""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def is_call_alone(node):
    """Whether a statement is a call whose answer nothing keeps."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)


def called_name(node):
    """Return `b` of the calls `a.b()` and `b()`, "" of all else."""
    if not isinstance(node, ast.Call):
        return ""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def dotted(node):
    """Return `a.b.c` as it is written; what stands before the dots and is not a name becomes an ellipsis."""
    parts = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    parts.append(node.id if isinstance(node, ast.Name) else "...")
    return ".".join(reversed(parts))[:TEXT_LIMIT]


def statements_of(node, part="body"):
    """Return the statements of a node's block; none where its body is an expression, as a lambda's is."""
    block = getattr(node, part, None)
    return block if isinstance(block, list) else []


def names_in(node):
    """Return the names in a node, as `dotted` writes them."""
    return {dotted(n) for n in ast.walk(node) if isinstance(n, (ast.Name, ast.Attribute))}


def listed(lines):
    """Return `line 3`, `lines 3, 5 and 8`."""
    *others, last = map(str, lines)
    return "lines %s and %s" % (", ".join(others), last) if others else "line " + last


def lines_from(first, last):
    """Return `line 3`, `lines 3 to 5`."""
    return "line %d" % first if first == last else "lines %d to %d" % (first, last)


def slip(line, kind, message, fix="", name=""):
    """Return what `PythonSlip` (grader/model/python_slip.py) says of a line of the script."""
    texts = {"message": message, "fix": fix, "name": name}
    return {"line": line, "kind": kind, **{key: text[:TEXT_LIMIT] for key, text in texts.items()}}


def published_type(call):
    """Return the name of the class that a `Publisher(…)` or `Subscriber(…)` is given, "" where it has none."""
    types = argument(call, 1, "data_class")
    if types and called_name(types[0]) == "numpy_msg":
        types = types[0].args
    return dotted(types[0]).rpartition(".")[2] if types else ""
