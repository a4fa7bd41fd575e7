"""Finds the rates that a student's Python asks for, for `slips.py`: numbers and parameters, of loops and of timers.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_tree import (
    LOOPS,
    all_of,
    argument,
    calls_in,
    dotted,
    is_call,
    slip,
    text_of,
    walk,
)

VALUES = {"Rate": "hz", "sleep": "duration", "Timer": "period"}
"""What says how often, by its name."""


def nanoseconds(tree):
    """Times that are given nanoseconds in place of seconds."""
    for node in all_of(tree, ast.Call):
        first = node.args[0] if len(node.args) == 1 and not node.keywords else None
        what = dotted(node.func)
        if what in ("rospy.Time", "rospy.Duration") and is_call(first, "to_nsec"):
            message = "`%s(…)` takes seconds, and gets nanoseconds" % what
            fix = "on line %d, write `%s(0, ` in place of `%s(`" % (node.lineno, what, what)
            yield slip(node.lineno, "wrong-value", message, fix, "nanoseconds")


def loop_rates(tree):
    """Rates of loops and timers: a parameter that is read there, its name as written; or a number, in Hz as text.

    Either may have been given to a name once.
    """
    bound, looped = {}, set()
    for node in walk(tree):
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            # A name is written down here in the form in which it is read later.
            bound.setdefault(ast.dump(node.targets[0]).replace("Store()", "Load()"), []).append(node.value)
        elif isinstance(node, LOOPS):
            looped.update(map(id, calls_in(node, "sleep")))

    def given(node):
        values = bound.get(ast.dump(node), [node])
        # Which of several values counts, only a run can tell.
        return values[0] if len(values) == 1 else node

    for node in calls_in(tree, *VALUES):
        timed = node.func.attr
        values = argument(node, 0, VALUES[timed])
        # A pause outside of a loop, such as one at the start, makes no rate.
        if not values or (timed == "sleep" and id(node) not in looped):
            continue
        value = given(values[0])
        whole = nanoseconds_apart(value) if is_call(value, "Duration") else None
        pause = dotted(node.func) if timed == "sleep" else ""
        if is_call(value, "Duration") and value.args and not whole:
            pause, value = dotted(value.func) if timed == "Timer" else pause, given(value.args[0])
        yield from loop_rate(node, timed, value, whole or constant(value, given), pause)


def loop_rate(call, timed, value, number, pause):
    """Yield the rate that a `Rate(…)`, `sleep(…)` or `Timer(…)` asks for: of the last two, `number` is in seconds, and
    `pause` is what takes it."""
    name = read_parameter(value) if timed == "Rate" else None
    if name:
        yield slip(value.lineno, "rate-parameter", name)
    elif number:
        hz = "%.12g" % (number if timed == "Rate" else 1.0 / number)
        fix = ""
        if is_call(value, "Duration"):
            pause, fix = dotted(value.func), "its second number counts nanoseconds, so it is %.9g s" % number
        yield slip(call.lineno, "rate-number", hz, fix, pause)


def nanoseconds_apart(call):
    """Return how many seconds `Duration(0, 100)` is, of whole seconds and of nanoseconds; None of any other call."""
    parts = [getattr(one, "value", None) for one in call.args]
    # `type`, as True is an int as well; ROS keeps each of the two in 32 bits.
    if len(parts) != 2 or not all(type(one) is int and 0 <= one < 1 << 31 for one in parts) or not parts[1]:
        return None
    return parts[0] + parts[1] * 1e-9


def constant(node, given, depth=4):
    """Return the positive number that an expression of numbers comes to, None where it is something else."""
    node = given(node)
    if isinstance(node, ast.Constant) and type(node.value) in (int, float) and 0 < node.value < 1e9:
        return float(node.value)
    if depth and isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Div, ast.Mult)):
        left, right = constant(node.left, given, depth - 1), constant(node.right, given, depth - 1)
        if left and right:
            return left / right if isinstance(node.op, ast.Div) else left * right
    return None


def read_parameter(node):
    """Return the name in `get_param('name')`, also within `float(…)`."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
        node = node.args[0] if node.func.id in ("float", "int") else node
    return text_of(node.args[0]) if is_call(node, "get_param") and node.args else ""
