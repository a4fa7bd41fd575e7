"""Finds what compiles in a student's Python and is not meant: `slips` of a syntax tree, for `syntax.py`.

Statements without an effect, loops that never end or never wait, callbacks that do not fit; besides, the rates that a
script asks for. Names and texts are for `script_names.py`, counters and clocks for `script_counters.py`. Nothing is
executed. Python 3.8, standard library only.
"""

import ast
import importlib.util
import os
import sys

# `-I` leaves this folder out
sys.path.append(os.path.dirname(os.path.abspath(__file__)))
from script_counters import (
    PLAIN_MODULES,
    clock_values,
    counter_slips,
    counter_starts,
    counts,
    knows_time,
    resets,
    sends_no_time,
)  # fmt: skip
from script_names import (
    argument,
    assigned_late,
    called_name,
    calls_in,
    dotted,
    functions_in,
    graph_names,
    is_call,
    misspelt,
    said_texts,
    slip,
    text_of,
    turns,
    walk,
)  # fmt: skip
from script_objects import (
    callbacks,
    hidden_names,
    object_slips,
    queue_sizes,
    subscribed_again,
    taken_off,
    unstarted_servers,
)

SLIPS_LIMIT = 100
"""Of a file."""
CALLED_BACK = {"Subscriber": "callback", "Service": "handler"}
"""What calls a function of the script's, and the name of that argument."""


def slips(tree):
    """What compiles and is not meant: names that are not called or not there, questions that wait for a keyboard."""
    functions = {n.name for n in walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
    found = []
    for node in walk(tree):
        name = uncalled(node, functions)
        if name:
            message, fix = "`%s` is named but not called" % name, "write `%s()`" % name
            found.append(slip(node.lineno, "not-called", message, fix=fix, name=name))
        name = asked(node, functions)
        if name:
            message = "`%s()` waits for someone to type, and a graded node gets no input" % name
            found.append(slip(node.lineno, "input", message, name=how_often(node, tree)))
    finders = (
        misspelt, loop_rates, resets, never_run, never_reached, stopped_loops, sleepless_loops, sleeps_twice,
        publishes_twice, callbacks, waiting_callbacks, queue_sizes, graph_names, object_slips, said_texts, deaf_loops,
        clock_values, counter_slips, counter_starts, without_effect, assigned_late, hidden_names, subscribed_again,
        imports, taken_off, unstarted_servers, wrong_values,
    )  # fmt: skip
    for find in finders:
        found += find(tree)
    published = calls_in(tree, "publish")
    if published and counts(tree):
        message = "" if knows_time(tree) else "the script counts, and reads no clock"
        message = message or sends_no_time(tree)
        if message:
            found.append(slip(published[0].lineno, "no-clock", message))
    calls = {called_name(n): n.lineno for n in walk(tree) if isinstance(n, ast.Call)}
    if "init_node" not in calls and ("Publisher" in calls or "Subscriber" in calls or does_something(tree)):
        fix = "make it a node: `rospy.init_node(…)`, then its topics, then `rospy.spin()` or a loop"
        found.append(slip(1, "no-init", "nothing in the script calls `rospy.init_node(…)`", fix=fix))
    return sorted(found, key=lambda one: one["line"])[:SLIPS_LIMIT]


def does_something(tree):
    """Return whether a file does more when it is run than to define names for others."""
    calls = any(isinstance(n, (ast.While, ast.For)) or is_call_alone(n) for n in tree.body)
    return calls or any(getattr(n, "id", "") == "__name__" for n in walk(tree))


def is_call_alone(node):
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)


def loop_rates(tree):
    """Rates of loops and timers: a parameter that is read there, its name as written; or a number, in Hz as text.

    Either may have been given to a name once.
    """
    bound, looped = {}, set()
    for node in walk(tree):
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            bound.setdefault(ast.dump(node.targets[0]).replace("Store()", "Load()"), []).append(node.value)
        elif isinstance(node, (ast.While, ast.For)):
            looped.update(map(id, calls_in(node, "sleep")))

    def given(node):
        values = bound.get(ast.dump(node), [node])
        return values[0] if len(values) == 1 else node

    for node in calls_in(tree, "Rate", "sleep", "Timer"):
        timed = node.func.attr
        if not node.args or (timed == "sleep" and id(node) not in looped):
            continue
        value = given(node.args[0])
        whole = nanoseconds_apart(value) if is_call(value, "Duration") else None
        if is_call(value, "Duration") and value.args and not whole:
            value = given(value.args[0])
        yield from loop_rate(node, timed, value, whole or constant(value, given))


def loop_rate(call, timed, value, number):
    """Yield the rate that a `Rate(…)`, `sleep(…)` or `Timer(…)` asks for: of the last two, `number` is in seconds."""
    name = read_parameter(value) if timed == "Rate" else None
    if name:
        yield slip(value.lineno, "rate-parameter", name)
    elif number:
        hz = "%.12g" % (number if timed == "Rate" else 1.0 / number)
        pause, fix = dotted(call.func) if timed == "sleep" else "", ""
        if is_call(value, "Duration"):
            pause, fix = dotted(value.func), "its second number counts nanoseconds, so it is %.9g s" % number
        yield slip(value.lineno, "rate-number", hz, fix=fix, name=pause)


def nanoseconds_apart(call):
    """Return how many seconds `Duration(0, 100)` is, of whole seconds and of nanoseconds; None of any other call."""
    parts = [getattr(one, "value", None) for one in call.args]
    if len(parts) != 2 or not all(type(one) is int and 0 <= one < 1 << 31 for one in parts) or not parts[1]:
        return None
    return parts[0] + parts[1] * 1e-9


WORKS = ("init_node", "publish", "spin", "sendTransform", "send_goal")
"""What a function is there for: one that calls none of these may be a spare one."""


def never_run(tree):
    """Functions that make a node, publish or wait, and that nothing names; and `__name__` beside another word than
    `__main__`.
    """
    named = {n.id for n in walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    named |= {n.attr for n in walk(tree) if isinstance(n, ast.Attribute)}
    made = [n for n in walk(tree) if isinstance(n, ast.Assign) and isinstance(n.value, ast.Call)]
    objects = {dotted(n.value.func): dotted(n.targets[0]) for n in made}
    of_class = {id(f): c.name for c in walk(tree) if isinstance(c, ast.ClassDef) for f in c.body}
    for node in walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name not in named and not node.decorator_list:
            if calls_in(node, *WORKS) and not node.name.startswith("__"):
                message, owner = "nothing calls `%s()`" % node.name, of_class.get(id(node), "")
                owner = owner and (objects.get(owner) or owner + "()") + "."
                yield slip(
                    node.lineno,
                    "never-called",
                    message,
                    handed_over(node, tree, owner),
                    name=owner + node.name,
                )
        elif isinstance(node, ast.Compare) and getattr(node.left, "id", "") == "__name__":
            word = getattr(node.comparators[0], "value", "__main__")
            if word != "__main__" and isinstance(node.ops[0], (ast.Eq, ast.Is)):
                yield slip(node.lineno, "main-guard", "`__name__` is never %r" % (word,))


def handed_over(function, tree, owner):
    """Return who has to be told of a callback, which takes one value; "" of another function."""
    taken = [one.arg for one in function.args.args if one.arg != "self"]
    if len(taken) != 1 or function.args.defaults or calls_in(function, "init_node"):
        return ""
    name = (owner and "self.") + function.name
    if calls_in(tree, "send_goal") and "feedback" in (function.name + taken[0]).lower():
        return "hand it over: `send_goal(…, feedback_cb=%s)`" % name
    return "hand it over to what calls it: `rospy.Subscriber(…, %s)`" % name


MAKES = ("Publisher", "Subscriber", "Service")


def never_reached(tree):
    """Loops without an end before the first `publish(…)`, `Publisher(…)` and the like that comes behind them in the
    same block, in a function or class of this file too.
    """
    parts = [n for n in walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))]
    own = {n.name for n in parts if calls_in(n, *MAKES)}

    def word(node):
        name = called_name(node)
        return name if name in own or is_call(node, "publish", *MAKES) else None

    for node in walk(tree):
        for block in (getattr(node, "body", None), getattr(node, "orelse", None)):
            for index, loop in enumerate(block if isinstance(block, list) else ()):
                spins = isinstance(loop, ast.Expr) and is_call(loop.value, "spin")
                if not spins and not (isinstance(loop, ast.While) and is_endless(loop)):
                    continue
                within = {word(n) for n in ast.walk(loop) if isinstance(n, ast.Call)}
                behind = [
                    n for later in block[index + 1 :] for n in ast.walk(later) if isinstance(n, ast.Call)
                ]
                behind = [n for n in behind if word(n) and word(n) not in within]
                if behind and "publish" not in within:
                    what = "spin()" if spins else "loop"
                    message = "the %s on line %d never ends, so the %s(…) on line %d is never reached"
                    message %= (what, loop.lineno, word(behind[0]), behind[0].lineno)
                    fix = "move line %d above line %d" % (behind[0].lineno, loop.lineno)
                    fix = "" if word(behind[0]) == "publish" else fix
                    yield slip(loop.lineno, "never-reached", message, fix=fix)


def stopped_loops(tree):
    """`spin()` in a loop that publishes: the loop does not come round. `break` or `return` in each of its turns, or so
    many turns and no more. And `if` in place of `while`.
    """
    turned = dict(turns(tree))
    for loop in walk(tree):
        once = isinstance(loop, ast.If) and is_call(getattr(loop.test, "operand", None), "is_shutdown")
        if once and not turned[loop][1] and calls_in(loop, "publish"):
            message = "the `if` on line %d runs what follows it once" % loop.lineno
            fix = "write `while` instead of `if` on line %d" % loop.lineno
            yield slip(loop.lineno, "loop-left", message, fix=fix)
        if isinstance(loop, ast.While) and is_call(loop.test, "is_shutdown"):
            message = (
                "the loop on line %d runs only when the node should end: a `not` is missing" % loop.lineno
            )
            fix = "on line %d, write `while not %s():`" % (loop.lineno, dotted(loop.test.func))
            yield slip(loop.lineno, "loop-left", message, fix=fix)
        if not isinstance(loop, (ast.While, ast.For)) or not calls_in(loop, "publish"):
            continue
        for spin in calls_in(loop, "spin")[:1]:
            message = "the loop stops at the spin() on line %d, which waits until the node ends" % spin.lineno
            fix = "remove spin(): the loop keeps the node alive"
            yield slip(spin.lineno, "spin-in-loop", message, fix=fix)
        if is_counted(loop) and not turned[loop][1]:
            message = "the loop on line %d ends after a fixed number of rounds" % loop.lineno
            used = {n.id for one in loop.body for n in ast.walk(one) if isinstance(n, ast.Name)}
            fix = "write `while not rospy.is_shutdown():` on line %d" % loop.lineno
            if isinstance(loop, ast.For) and dotted(loop.target) in used:
                fix = "put it inside a `while not rospy.is_shutdown():`"
            yield slip(loop.lineno, "loop-left", message, fix=fix)
        left = next((n for n in loop.body if isinstance(n, (ast.Break, ast.Return))), None)
        if left is not None:
            word = "break" if isinstance(left, ast.Break) else "return"
            message = "the loop ends the first time around, at the %s on line %d" % (word, left.lineno)
            fix = "remove it from line %d, or put it inside an `if`" % left.lineno
            yield slip(left.lineno, "loop-left", message, fix=fix)


def is_counted(loop):
    """Whether it is `for … in range(…)`, or `while … and count < 10:`."""
    if isinstance(loop, ast.For):
        return called_name(loop.iter) == "range"
    asked = loop.test if isinstance(loop, ast.While) else None
    parts = asked.values if isinstance(asked, ast.BoolOp) and isinstance(asked.op, ast.And) else [asked]
    orders = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.NotEq)
    return any(isinstance(one, ast.Compare) and isinstance(one.ops[0], orders) for one in parts)


PAUSES = ("rospy.sleep", "time.sleep")
WAITS = ("sleep", "spin", "spin_once", "wait_for_message", "wait_for_service", "wait", "join", "input")


def sleepless_loops(tree):
    """Loops that publish and wait nowhere, where `rate.sleep()` stands outside of them."""
    loops = [n for n in walk(tree) if isinstance(n, (ast.While, ast.For))]
    sleeps = calls_in(tree, "sleep")
    for loop in loops:
        inner = [n for n in ast.walk(loop) if n is not loop and n in loops and calls_in(n, "publish")]
        before = [n for n in sleeps if n.lineno < loop.lineno and dotted(n.func) not in PAUSES]
        outside = [n for n in sleeps if n.lineno > loop.lineno] or before
        yield from sleeps_in_if(loop)
        if calls_in(loop, *WAITS) or inner or not outside or not calls_in(loop, "publish"):
            continue
        name = dotted(outside[0].func) or "sleep"
        message = "`%s()` is outside the loop on line %d" % (name, loop.lineno)
        last = loop.body[-1]
        fix = "move it into that loop, below line %d, with the same spaces or tabs before it as line %d has"
        fix %= (last.end_lineno, last.lineno)
        yield slip(outside[0].lineno, "sleep-outside", message, fix=fix, name=name)


def sleeps_in_if(loop):
    """Yield the only `sleep()` of a loop that publishes in each of its turns, where it stands in an `if`."""
    plain = [one for one in loop.body if isinstance(one, ast.Expr) and is_call(one.value, "publish")]
    sleeps = [n for one in loop.body for n in calls_in(one, *WAITS)]
    for one in loop.body:
        within = one.body if isinstance(one, ast.If) and not one.orelse else []
        own = [n for n in within if isinstance(n, ast.Expr) and is_call(n.value, "sleep")]
        if plain and len(sleeps) == len(own) == 1 and own[0] is within[-1] and one is loop.body[-1]:
            name, line = dotted(own[0].value.func), own[0].lineno
            message = "`%s()` is inside the `if` on line %d" % (name, one.lineno)
            fix = "write line %d with the same spaces or tabs before it as line %d has" % (line, one.lineno)
            yield slip(line, "sleep-outside", message, fix=fix, name=name)


def sleeps_twice(tree):
    """Loops that wait twice in each of their turns, and publish once."""
    for loop in walk(tree):
        body = loop.body if isinstance(loop, (ast.While, ast.For)) else []
        at = [i for i, n in enumerate(body) if isinstance(n, ast.Expr) and called_name(n.value) == "sleep"]
        if len(at) != 2:
            continue
        between, around = body[at[0] + 1 : at[1]], body[: at[0]] + body[at[1] + 1 :]
        publish = [any(calls_in(one, "publish") for one in part) for part in (between, around)]
        if sorted(publish) == [False, True]:
            lines = (body[at[0]].lineno, body[at[1]].lineno)
            message = "the loop sleeps on line %d and again on line %d" % lines
            yield slip(lines[1], "sleep-twice", message, fix="delete line %d" % lines[1])


def publishes_twice(tree):
    """Loops that publish on one topic more than once in each of their turns, and sleep once at most."""
    for loop in walk(tree):
        body = loop.body if isinstance(loop, (ast.While, ast.For)) else []
        plain = [one for one in body if isinstance(one, ast.Expr) and called_name(one.value) == "publish"]
        by_publisher = {}
        for one in plain:
            by_publisher.setdefault(ast.dump(one.value.func), []).append(one)
        many = [same for same in by_publisher.values() if len(same) > 1]
        if not many or any(
            calls_in(n, *WAITS) for n in body[body.index(many[0][0]) : body.index(many[0][-1])]
        ):
            continue
        first, second = many[0][:2]
        lines = [one.lineno for one in many[0]]
        if ast.dump(first) == ast.dump(second) and body.index(second) == body.index(first) + 1:
            message, fix = "the loop publishes on line %d and the same again on line %d", "delete line %d"
            message, fix = message % (lines[0], lines[1]), fix % lines[1]
        else:
            listed = "lines %s and %d" % (", ".join(map(str, lines[:-1])), lines[-1])
            message, fix = "each turn of the loop publishes on %s", "delete all but one of %s"
            message, fix = message % listed, fix % listed
        yield slip(lines[1], "publish-twice", message, fix=fix)


def waiting_callbacks(tree):
    """Callbacks of topics and services that do not come to their end, or late: nothing further is read before."""
    functions = functions_in(tree)
    for node in walk(tree):
        kind = called_name(node)
        given = argument(node, 2, CALLED_BACK[kind]) if kind in CALLED_BACK else []
        own = functions.get(dotted(given[0]).rpartition(".")[2]) if given else None
        inside = list(ast.walk(own)) if own is not None else []
        for inner in inside if node not in inside else ():
            if isinstance(inner, ast.While) and is_endless(inner, own):
                message, fix = "the loop in the callback `%s`, line %d, never ends", "take the loop out of it"
            elif is_call(inner, "spin"):
                message, fix = "the callback `%s` calls spin() on line %d", "move line %d out of it"
            elif called_name(inner) == "sleep" and not is_short(inner):
                message, fix = "the callback `%s` sleeps on line %d", "delete line %d"
            else:
                continue
            fix = fix % inner.lineno if "%" in fix else fix
            yield slip(
                inner.lineno, "callback-waits", message % (own.name, inner.lineno), fix=fix, name=own.name
            )
            break


def is_short(sleep):
    return bool(sleep.args) and (constant(sleep.args[0], lambda node: node) or 1.0) < 0.1


def is_endless(loop, function=None):
    """Whether it asks for nothing but the node's end, and nothing in it leaves it; in a function, also for variables of
    the function that nothing in the loop changes."""
    asks = asks_for_ever(loop.test) or (function is not None and is_unchanging(loop, function))
    return asks and not any(isinstance(n, (ast.Break, ast.Return, ast.Raise)) for n in ast.walk(loop))


def asks_for_ever(test):
    inverted = isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)
    return (isinstance(test, ast.Constant) and bool(test.value)) or (
        inverted and is_call(test.operand, "is_shutdown")
    )


def is_unchanging(loop, function):
    """Whether a loop's condition is made of the function's own variables and numbers, and nothing in it sets them."""
    parts = [loop.test]
    if isinstance(loop.test, ast.BoolOp) and isinstance(loop.test.op, ast.And):
        parts = [part for part in loop.test.values if not asks_for_ever(part)]
    inside = [n for part in parts for n in ast.walk(part)]
    names = {n.id for n in inside if isinstance(n, ast.Name)}
    shared = {
        name for n in ast.walk(function) if isinstance(n, (ast.Global, ast.Nonlocal)) for name in n.names
    }
    own, changed = set_in(function) - shared, set_in(loop)
    is_plain_test = not any(isinstance(n, (ast.Call, ast.Attribute, ast.Subscript)) for n in inside)
    return bool(names) and is_plain_test and names <= own - changed


def set_in(tree):
    """Return the names that are set somewhere in a tree."""
    return {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and not isinstance(n.ctx, ast.Load)}


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


SWALLOWS = {"KeyboardInterrupt", "ROSInterruptException", "ROSException", "Exception", "BaseException"}
ENDS = (ast.Break, ast.Return, ast.Raise)


RAISING = ("wait_for_message", "wait_for_service")
"""Calls that end with an exception on Ctrl-C. `rate.sleep()` is none of them: by the real clock it sleeps on."""
ASKS = "check `rospy.is_shutdown()` in it: `while not rospy.is_shutdown():`"


def deaf_loops(tree):
    """Why a node goes on after Ctrl-C: loops that do not ask for it, an `except` within them, signals put off."""
    endless, others, counted = [], [], []
    for loop in walk(tree):
        is_while = isinstance(loop, ast.While)
        inside = list(ast.walk(loop)) if is_while or isinstance(loop, ast.For) else []
        if (
            not inside
            or any(map(is_shutdown, inside))
            or not (is_while or is_endless_for(loop) or sleeps(loop))
        ):
            continue
        caught = [h for n in inside if isinstance(n, ast.Try) for h in n.handlers if goes_on(h)]
        if calls_in(loop, *RAISING):
            for handler in caught[:1]:
                message = (
                    "the `except` on line %d catches what Ctrl-C raises, and the loop on line %d goes on"
                )
                endless.append(slip(loop.lineno, "deaf", message % (handler.lineno, loop.lineno), fix=ASKS))
        elif is_while or is_endless_for(loop):
            known = not is_while or isinstance(loop.test, ast.Constant)
            (endless if known else others).append(
                deaf(loop, [n for n in inside if n is not loop and sleeps(n)])
            )
        else:
            counted.append(deaf(loop, []))
    for node in walk(tree):
        if is_call(node, "init_node") and any(k.arg == "disable_signals" for k in node.keywords):
            message = "`disable_signals=True` on line %d keeps Ctrl-C from rospy" % node.lineno
            yield slip(node.lineno, "deaf", message, fix="leave it out")
        if is_call(node, "signal") and node.args and dotted(node.args[0]).endswith("SIGINT"):
            message = "line %d gives Ctrl-C another meaning" % node.lineno
            yield slip(node.lineno, "deaf", message, fix="delete it")
    yield from endless or others or counted


def deaf(loop, within):
    """Return the slip of a loop that never asks, with those `within` it that take their time."""
    lines = [one.lineno for one in (loop, *within)]
    named = "loops on lines %s and %d never check" % (", ".join(map(str, lines[:-1])), lines[-1])
    named = named if within else "loop on line %d never checks" % loop.lineno
    ends = ["write `if rospy.is_shutdown(): break` below the `for` on line %d" % one.lineno for one in within]
    fixes = (
        [ASKS, *ends]
        if isinstance(loop, ast.While) or within
        else ["write `if rospy.is_shutdown(): break` below the `for` on line %d" % loop.lineno]
    )
    return slip(loop.lineno, "deaf", "the %s whether the node should end" % named, fix="; then ".join(fixes))


def is_endless_for(loop):
    return isinstance(loop, ast.For) and called_name(loop.iter) == "count"


def sleeps(loop):
    """Whether it is a `for` that sleeps in each of its turns, so that it can take long."""
    return isinstance(loop, ast.For) and bool(calls_in(loop, "sleep"))


def goes_on(handler):
    """Whether an `except` catches what Ctrl-C raises, and leaves neither the loop nor the script."""
    kinds = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type]
    catches = any(kind is None or dotted(kind).rpartition(".")[2] in SWALLOWS for kind in kinds)
    left = (n for n in ast.walk(handler) if isinstance(n, ENDS) or called_name(n) in ("exit", "_exit"))
    return catches and next(left, None) is None


OF_ANGLES = ("sin", "cos", "tan")
IN_DEGREES = ("degrees", "rad2deg")


def wrong_values(tree):
    """Comparisons with NaN, angles in degrees of which a sine is taken, and answers of services that are dropped."""
    made = [n for n in walk(tree) if isinstance(n, ast.Assign) and called_name(n.value) in IN_DEGREES]
    degrees = {dotted(target) for n in made for target in n.targets}
    for node in walk(tree):
        if isinstance(node, ast.Compare) and any(map(is_nan, [node.left, *node.comparators])):
            name = dotted(node.comparators[0] if is_nan(node.left) else node.left)
            fix = "write `math.isnan(%s)`" % (name if "..." not in name else "…")
            yield slip(
                node.lineno,
                "wrong-value",
                "no number is equal to NaN, not even NaN itself",
                fix=fix,
                name="nan",
            )
        elif called_name(node) in OF_ANGLES and node.args:
            given = dotted(node.args[0])
            if given in degrees or called_name(node.args[0]) in IN_DEGREES:
                message = "`%s` takes radians, and gets degrees" % called_name(node)
                fix = "leave out `degrees(…)`: the angle is in radians before"
                yield slip(node.lineno, "wrong-value", message, fix=fix, name="degrees")
        elif isinstance(node, ast.Expr) and called_name(node.value).endswith("Response"):
            name = called_name(node.value)
            fix = "write `return %s(…)`" % name
            yield slip(
                node.lineno,
                "wrong-value",
                "the `%s` that is made is not returned" % name,
                fix=fix,
                name="return",
            )


def is_nan(node):
    """Return whether it is written as `float('nan')`, `math.nan` or `numpy.nan`."""
    if called_name(node) == "float" and node.args:
        return str(getattr(node.args[0], "value", "")).lower() == "nan"
    return isinstance(node, ast.Attribute) and node.attr.lower() == "nan"


def uncalled(node, functions):
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Attribute):
        return dotted(node.value)
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Name) and node.value.id in functions:
        return node.value.id
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return dotted(node.operand) if is_shutdown(node.operand) else None
    if isinstance(node, (ast.While, ast.If)) and is_shutdown(node.test):
        return dotted(node.test)
    return None


def is_shutdown(node):
    return getattr(node, "attr", getattr(node, "id", "")) == "is_shutdown"


def asked(node, functions):
    if not isinstance(node, ast.Call):
        return None
    name = dotted(node.func)
    if name in ("input", "raw_input"):
        return None if name in functions else name
    return name if name in ("sys.stdin.read", "sys.stdin.readline", "sys.stdin.readlines") else None


def how_often(node, tree):
    """Return "once" for what no loop around it does again, "paused" for what a loop does that sleeps, "" else."""
    loops = [n for n in walk(tree) if isinstance(n, (ast.While, ast.For)) and node in ast.walk(n)]
    if not loops:
        return "once"
    return "paused" if calls_in(loops[-1], "sleep") else ""


IMPORTS_LIMIT = 30


def imports(tree):
    """Imports of what nothing in the script uses, and of modules that this Python does not find; the standard library's
    and rospy are there and cost nothing."""
    names = [n for n in walk(tree) if isinstance(n, ast.Name)]
    used = {n.id for n in names} - {n.id for n in names if isinstance(n.ctx, ast.Store)}
    tried = {id(n) for one in walk(tree) if isinstance(one, ast.Try) for n in ast.walk(one)}
    found = [n for n in walk(tree) if isinstance(n, (ast.Import, ast.ImportFrom)) and id(n) not in tried]
    for node in found[:IMPORTS_LIMIT]:
        modules = (
            [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
        )
        module = modules[0].partition(".")[0]
        bound = [alias.asname or alias.name.partition(".")[0] for alias in node.names]
        if len(modules) > 1 or getattr(node, "level", 0) or module in PLAIN_MODULES - {"numpy"}:
            continue
        if not used.intersection(bound) and bound != ["*"] and "__all__" not in used:
            fix = "delete line %d: nothing in the script uses `%s`" % (node.lineno, "`, `".join(bound))
            yield slip(node.lineno, "unused-import", module, fix=fix, name=bound[0])
        if not is_there(module):
            whole = modules[0] if modules[0] != module else ""
            yield slip(node.lineno, "lacking-import", module, fix=whole, name=bound[0])


def is_there(module):
    """Return whether Python finds a module, without importing it."""
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError, AttributeError):
        return False


def without_effect(tree):
    """Statements that compute something and keep nothing of it: `++i`, `i + 1`, `i == 0`; and `i = i`."""
    for node in walk(tree):
        if isinstance(node, ast.Assign) and [dotted(t) for t in node.targets] == [dotted(node.value)] != [
            "..."
        ]:
            name = dotted(node.value)
            message, fix = "`{0} = {0}` changes nothing", "write `{0} = {0} + 1`, or whatever it should be,"
            yield slip(node.lineno, "no-effect", message.format(name), fix=fix.format(name), name=name)
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.UnaryOp) and isinstance(value.operand, ast.UnaryOp):
            same = type(value.op) is type(value.operand.op) and isinstance(value.op, (ast.UAdd, ast.USub))
            name, sign = dotted(value.operand.operand), "+" if isinstance(value.op, ast.UAdd) else "-"
            if same and "..." not in name:
                message = "`%s%s` changes nothing in Python" % (2 * sign, name)
                yield slip(node.lineno, "no-effect", message, fix="write `%s %s= 1`" % (name, sign))
        elif isinstance(value, ast.BinOp) and isinstance(value.op, (ast.Add, ast.Sub)):
            name, sign = dotted(value.left), "+" if isinstance(value.op, ast.Add) else "-"
            if "..." not in name and isinstance(value.right, ast.Constant):
                parts = (name, sign, value.right.value)
                message, fix = "`%s %s %r` alone changes nothing" % parts, "write `%s %s= %r`" % parts
                yield slip(node.lineno, "no-effect", message, fix=fix)
        elif isinstance(value, ast.Compare) and isinstance(value.ops[0], ast.Eq):
            name = dotted(value.left)
            if "..." not in name:
                message = "`%s ==` compares and gives no value" % name
                yield slip(node.lineno, "compared", message, fix="write `%s =`" % name)
