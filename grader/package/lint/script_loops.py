"""Finds what is wrong with the loops of a student's Python, for `slips.py`: those that never end, never wait or stop
too soon, also in callbacks, and those that do not end on Ctrl-C.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins
import math
from collections import Counter

from script_names import (
    caught_by,
    set_in,
)
from script_rates import constant
from script_tree import (
    FUNCTIONS,
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    lines_from,
    listed,
    names_in,
    parents_of,
    slip,
    statements_of,
    walk,
)
from script_values import CLOCKS

CALLED_BACK = {"Subscriber": "callback", "Service": "handler"}
"""What calls a function of the script's, and the name of that argument."""

ENDING = ("signal_shutdown", "exit", "quit", "_exit")
"""Calls that end the node."""
MAKES = ("init_node", "Publisher", "Subscriber", "Service")
LEAVES = (ast.Return, ast.Raise, ast.Yield, ast.YieldFrom)
"""A function with one of these may go on, or is a generator, whose call runs nothing."""
WAITS = ("sleep", "spin", "spin_once", "wait_for_message", "wait_for_service", "wait", "join", "input")


def never_reached(tree):
    """Loops without an end before the first `init_node(…)`, `publish(…)` and the like that comes behind them in the
    same block, in a function or class of this file too; so is a `spin()`, in what a statement calls as well.
    """
    parts = all_of(tree, ast.FunctionDef, ast.ClassDef)
    own = {n.name for n in parts if calls_in(n, *MAKES) or publishes_on(n)}
    functions, classes = functions_in(tree), {n.name: n for n in all_of(tree, ast.ClassDef)}
    made = {dotted(n.targets[0]): n.value for n in all_of(tree, ast.Assign)} if classes else {}

    def run_by(node):
        return method_run_by(node, classes, made) or called_own(node, functions)

    def word(node):
        name = called_name(node)
        return name if name and (name in own or is_call(node, "publish", *MAKES)) else None

    known = {None: (None, ())}  # a function that is called again is looked at once

    def held(function):
        if function not in known:
            nodes = list(ast.walk(function))
            inner = {n for one in nodes[1:] if isinstance(one, FUNCTIONS) for n in ast.walk(one)}
            left = any(isinstance(n, LEAVES) and n not in inner for n in nodes)
            known[function] = None if left else holding(function.body), set(map(word, nodes))
        return known[function]

    for block in (statements_of(node, part) for node in walk(tree) for part in ("body", "orelse")):
        for index, one in enumerate(block):
            called = run_by(getattr(one, "value", None))
            loop, within = held(called) if called else (holding([one]), None)
            if loop is None:
                continue
            within = set(map(word, ast.walk(loop))) if within is None else within
            yield from read_late(block[index + 1 :], loop)
            rest = [n for later in block[index + 1 :] for n in ast.walk(later)]
            behind = [n for n in rest if word(n) and word(n) not in within]
            if behind and ("publish" not in within or word(behind[0]) in own.union(MAKES)):
                message = "the %s on line %d never ends, so the %s(…) on line %d is never reached"
                what = "loop" if isinstance(loop, ast.While) else "spin()"
                message %= (what, loop.lineno, word(behind[0]), behind[0].lineno)
                runs = (held(run_by(n))[0] for n in rest if isinstance(n, ast.Call))
                later = next(filter(None, runs), None)
                fix = unreached_fix(one, loop, behind[0], later, called)
                yield slip(loop.lineno, "never-reached", message, fix)
            break  # nothing behind it in the block runs


def publishes_on(part):
    """Return whether a function stays in a loop that publishes."""
    loop = holding(part.body) if isinstance(part, ast.FunctionDef) else None
    return loop is not None and bool(calls_in(loop, "publish"))


def read_late(rest, loop):
    """Lines behind a loop without an end, or `spin()`, that read a parameter: nothing needs it any more."""
    if any(calls_in(one, "get_param") for one in rest):
        first, last = rest[0].lineno, rest[-1].end_lineno
        message = "line %d runs only once the node ends, below line %d" % (first, loop.lineno)
        yield slip(first, "read-late", message, "delete " + lines_from(first, last), str(last))


def method_run_by(node, classes, made):
    """Return the method that `A()`, `A().f()` or `a.f()` runs, `made` being what names stand for; else None."""
    func = getattr(node, "func", None)
    owner = getattr(func, "value", None)
    kind = classes.get(func.id if isinstance(func, ast.Name) else called_name(made.get(dotted(owner), owner)))
    name = getattr(func, "attr", "__init__")
    return next((n for n in kind.body if getattr(n, "name", "") == name), None) if kind else None


def holding(block):
    """Return the statement of a block that never ends: a loop, or `spin()`."""
    for one in block:
        inner = holding(one.body) if isinstance(one, ast.Try) else None
        spins = isinstance(one, ast.Expr) and is_call(one.value, "spin")
        if inner is not None or spins or (isinstance(one, ast.While) and is_endless(one)):
            return inner or one
    return None


def unreached_fix(one, loop, behind, later, called):
    """Return how to get to the call `behind` a statement that stays in its `loop`; `later` holds that call itself,
    `called` is the function that the statement calls."""
    if isinstance(loop, ast.Expr) and getattr(called, "name", "") == "__init__":
        # What is behind needs the object, so it cannot move above
        return "move the spin() of line %d below line %d" % (loop.lineno, behind.lineno)
    if "publish" in (called_name(behind), called_name(later)) and isinstance(loop, ast.While):
        return (
            into_loop(behind.lineno, loop)
            if not calls_in(loop, "publish") and calls_in(loop, "sleep")
            else ""
        )
    above = "move line %d above line %d" % (behind.lineno, one.lineno)
    if isinstance(later, ast.While) and isinstance(loop, ast.While):
        both = "one loop has to do both: make above line %d what the loop on line %d uses, and do its work"
        return both % (loop.lineno, later.lineno)
    if later is not None:
        spins = later if isinstance(loop, ast.While) else loop
        kept = "delete the spin() on line %d" % spins.lineno
        return "%s, and %s" % (above, kept) if spins is later else kept + ": one at the end is enough"
    return above if called_name(behind) != "publish" else ""


def loop_ends(test):
    """Return the call in a condition that holds only when the node should end: `is_shutdown()`, or `is_shutdown() != 0`
    and the like."""
    if isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.comparators[0], ast.Constant):
        wanted = isinstance(test.ops[0], (ast.Eq, ast.Is))
        unwanted = isinstance(test.ops[0], (ast.NotEq, ast.IsNot))
        if (wanted or unwanted) and test.comparators[0].value == wanted:
            test = test.left
    return test if is_call(test, "is_shutdown") else None


def loops_that_never_go_round(tree):
    """`if` in place of `while`, and `while` without its `not`."""
    turned, called = dict(turns(tree)), calls_made(tree)
    for block in all_of(tree, ast.If, ast.While):
        asks = isinstance(block, ast.If) and is_call(getattr(block.test, "operand", None), "is_shutdown")
        # what others call, or several lines, may run again
        is_run_once = not turned[block][1] and called[getattr(turned[block][0], "name", None)] == 1
        if asks and is_run_once and calls_in(block, "publish"):
            message = "the `if` on line %d runs what follows it once" % block.lineno
            fix = "write `while` instead of `if` on line %d" % block.lineno
            yield slip(block.lineno, "loop-left", message, fix)
        ending = loop_ends(block.test) if isinstance(block, ast.While) else None
        if ending is not None:
            message = "the loop on line %d runs only when the node should end: a `not` is missing"
            message, asks = message % block.lineno, dotted(ending.func)
            fix = "on line %d, write `while not %s():`" % (block.lineno, asks)
            yield slip(block.lineno, "never-begun", message, fix, asks)


def waits_without_not(tree):
    """`while stop.wait(1):` and `while self.stopped:` around what is published: a loop until an event comes, or until
    what a function for `on_shutdown` sets, which lacks its `not`."""
    given, late = all_of(tree, ast.Assign), set(run_at_the_end(tree))
    made = {dotted(t) for n in given if called_name(n.value) == "Event" for t in n.targets}
    begins = {dotted(t): getattr(n.value, "value", None) for n in given if n not in late for t in n.targets}
    flags = {name for name in set_at_the_end(tree) if begins.get(name) is False}
    for loop in all_of(tree, ast.While) if made or flags else ():
        asks = is_call(loop.test, "wait", "is_set")
        name = dotted(loop.test.func.value if asks else loop.test)
        if name in (made if asks else flags) and calls_in(loop, "publish"):
            asked = "%s.%s(…)" % (name, loop.test.func.attr) if asks else name
            message = "the loop on line %d runs only after `%s` is set: a `not` is missing"
            fix = "on line %d, write `while not %s:`" % (loop.lineno, asked)
            yield slip(loop.lineno, "never-begun", message % (loop.lineno, name), fix, asked)


def lacking_loops(tree):
    """What publishes once, or a few times, above the sleep of a rate or a `spin()`, in a script that has no loop and
    nothing else that waits."""
    waits = ("Subscriber", "Timer", "Service", "SimpleActionServer", "run", "start")
    latched = any(one.arg == "latch" for one in all_of(tree, ast.keyword))
    if any(all_of(tree, *LOOPS)) or calls_in(tree, *waits) or latched:
        return
    has_rate, spins = bool(calls_in(tree, "Rate")), bool(calls_in(tree, "spin"))
    for body in [getattr(node, "body", None) for node in ast.walk(tree)]:
        alone = [one for one in body if isinstance(one, ast.Expr)] if isinstance(body, list) else []
        sent, slept, spun = (
            [one.lineno for one in alone if is_call(one.value, name)] for name in ("publish", "sleep", "spin")
        )
        last = (spun or (slept if has_rate and not spins else [0]))[-1:]
        if not sent or [sent[0]] >= last:
            continue
        message = "no loop is around line %d, so it publishes once" % sent[0]
        if len(sent) > 1:
            message = "no loop is around lines %d to %d, so they publish %d messages" % (
                sent[0],
                sent[-1],
                len(sent),
            )
        wait = "the rate's sleep()" if has_rate else "the sleep() of a `rospy.Rate(...)` made above it"
        fix = "publish in a loop `while not rospy.is_shutdown():` that ends with " + wait
        if spun:
            fix += ", in place of spin() on line %d" % spun[-1]
        elif len(sent) == len(slept) == 1:
            fix = "write `while not rospy.is_shutdown():` above line %d, and begin lines %d to %d with four more spaces"
            fix %= (sent[0], sent[0], slept[0])
        yield slip(sent[0], "loop-left", message, fix, "once")


def end_of_rounds(loop):
    """Return when a loop ends whose first line does not wait for the node's end."""
    if isinstance(loop, ast.For):
        return "after a fixed number of rounds"
    asked = {dotted(one) for one in ast.walk(loop.test)}
    calls = {(dotted(one.func) or "").rpartition(".")[2] for one in all_of(loop.test, ast.Call)}
    if calls.intersection(CLOCKS):
        return "after a fixed time"
    is_counted = any(dotted(one.target) in asked for one in all_of(loop, ast.AugAssign))
    return "after a fixed number of rounds" if is_counted else "as soon as its condition is false"


def stopped_loops(tree):
    """`spin()` in a loop that publishes: the loop does not come round. `break` or `return` in each of its turns, or so
    many turns and no more."""
    turned, called, is_robot = dict(turns(tree)), calls_made(tree), is_of_robot(tree)
    for loop in all_of(tree, *LOOPS):
        if not calls_in(loop, "publish"):
            continue
        name = getattr(turned[loop][0], "name", None)
        ending = loop_ends(loop.test) if isinstance(loop, ast.While) else None
        for spin in calls_in(loop, "spin")[:1]:
            message = "the loop stops at the spin() on line %d, which waits until the node ends" % spin.lineno
            slept = [dotted(n.targets[0]) for n in all_of(tree, ast.Assign) if is_call(n.value, "Rate")]
            fix = "remove spin(): the loop keeps the node alive"
            if slept and not calls_in(loop, "sleep"):
                fix = "on line %d, write `%s.sleep()` in place of spin()" % (spin.lineno, slept[-1])
            yield slip(spin.lineno, "spin-in-loop", message, fix)
        # of what the node does; a robot's may stay alive in `spin()` once it has arrived
        spins = is_robot and any(calls_in(one, "spin") for one in run_after(loop, tree))
        is_part = (called[name] > 1 and name != "publish") or spins
        if (
            (is_counted(loop) or runs_out(loop, tree))
            and ending is None
            and not turned[loop][1]
            and not is_part
        ):
            message = "the loop on line %d ends %s" % (loop.lineno, end_of_rounds(loop))
            used = {n.id for one in loop.body for n in ast.walk(one) if isinstance(n, ast.Name)}
            fix = "write `while not rospy.is_shutdown():` on line %d" % loop.lineno
            last = next((one for one in reversed(run_after(loop, tree)) if calls_in(one, "publish")), None)
            last = last or (loop if is_robot else None)  # which has to stay where it is then
            if last is not None:
                fix = "call rospy.spin() below line %d%s: it waits there until Ctrl-C"
                alike = ", with the same spaces or tabs before it as line %d has" % last.lineno
                fix %= (last.end_lineno, "" if last.lineno == last.end_lineno else alike)
            elif isinstance(loop, ast.For) and dotted(loop.target) in used:
                fix = "put it inside a `while not rospy.is_shutdown():`"
            yield slip(loop.lineno, "loop-left", message, fix)
        # what is done again and again, or in several places, ends by no loop in it
        ends = not turned[loop][1] and not is_part
        left = next(filter(way_out, loop.body), None) if ends else None
        if left is not None:
            message = "the loop ends the first time around, at the %s on line %d" % (
                way_out(left),
                left.lineno,
            )
            fix = "remove it from line %d, or put it inside an `if`" % left.lineno
            yield slip(left.lineno, "loop-left", message, fix)


def way_out(statement):
    """Return how a statement leaves a loop: "break", "return", "sys.exit()"; "" where it does not."""
    if isinstance(statement, (ast.Break, ast.Return)):
        return type(statement).__name__.lower()
    call = statement.value if isinstance(statement, ast.Expr) else None
    return "%s()" % dotted(call.func) if called_name(call) in ENDING else ""


def is_of_robot(tree):
    """Whether it sets velocities: `twist.angular.z`, `Twist(angular=…)`."""
    return any(getattr(n, "attr", getattr(n, "arg", "")) == "angular" for n in walk(tree))


def calls_made(tree):
    """Return how often each name is called: what a loop calls, or a topic, a service or a timer, counts twice, since it
    is called again and again."""
    called = Counter(map(called_name, walk(tree)))
    for call in calls_in(tree, *CALLED_BACK, "Timer", "SimpleActionServer", "ActionServer"):
        given = [*call.args, *(keyword.value for keyword in call.keywords)]
        called.update(2 * [dotted(one).rpartition(".")[2] for one in given])
    for loop in walk(tree):
        called.update(map(called_name, ast.walk(loop)) if isinstance(loop, LOOPS) else ())
    called[None] = 1  # what is outside of all functions
    return called


def run_after(loop, tree):
    """Return the statements that are run once a loop is over, up to the end of its function."""
    parents, one, found = parents_of(tree), loop, []
    while one in parents and not isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef)):
        blocks = (statements_of(parents[one], part) for part in ("body", "orelse", "finalbody"))
        block = next((block for block in blocks if one in block), [one])
        found += block[block.index(one) + 1 :]
        one = parents[one]
    return [one for one in found if not isinstance(one, (ast.FunctionDef, ast.ClassDef))]


def into_loop(line, loop):
    """Return how a line gets into a loop: above the pause that ends it, else below its last line."""
    ends = [one.lineno for one in loop.body[-1:] if isinstance(one, ast.Expr) and is_call(one.value, "sleep")]
    last = loop.body[-1]
    where = "above line %d" % ends[0] if ends else "below line %d" % last.end_lineno
    fix = "move line %d into the loop of line %d, %s, with the same spaces or tabs before it as line %d has"
    return fix % (line, loop.lineno, where, last.lineno)


def published_before(tree):
    """The only `publish(…)` of a file, or the only call of the function that holds it, where it stands above a loop
    that waits and publishes nothing."""
    published, functions = calls_in(tree, "publish"), functions_in(tree)
    named = Counter(getattr(n, "id", getattr(n, "attr", "")) for n in walk(tree))
    sending = {n for n in functions.values() if calls_in(n, "publish") and named[n.name] == 1}
    for node in walk(tree) if len(published) == 1 else ():
        above = None
        for one in statements_of(node):
            every = [n for n in ast.walk(one) if isinstance(n, ast.Call)]
            called = {called_name(n) for n in every}
            waits = isinstance(one, ast.While) and is_endless(one) and "sleep" in called
            value = getattr(one, "value", None)
            if isinstance(one, ast.Expr) and (
                value is published[0] or called_own(value, functions) in sending
            ):
                above = one.lineno
            elif above and waits and all(map(only_computes, every)):
                message = "line %d publishes above the loop on line %d, and so runs once"
                yield slip(above, "loop-left", message % (above, one.lineno), into_loop(above, one))


COMPUTES = {
    *dir(str), *dir(list), *dir(math), "is_shutdown", "sleep", "now", "get_time", "to_sec", "time", "Time", "random",
    "uniform", "randint", "choice", "loginfo", "logwarn", "logdebug", "logerr", "loginfo_throttle",
}  # fmt: skip
"""Methods and functions of modules that do nothing in ROS but wait and log."""


def only_computes(call):
    """Whether what is called is Python's own, makes a message, or is one that only computes, waits or logs."""
    name = call.func.id if isinstance(call.func, ast.Name) else ""
    return name in dir(builtins) or name[:1].isupper() or (not name and called_name(call) in COMPUTES)


def is_counted(loop):
    """Whether it is `for … in range(…)`, or `while … and count < 10:`."""
    if isinstance(loop, ast.For):
        return called_name(loop.iter) == "range"
    asked = loop.test if isinstance(loop, ast.While) else None
    parts = asked.values if isinstance(asked, ast.BoolOp) and isinstance(asked.op, ast.And) else [asked]
    orders = (ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.NotEq)
    return any(isinstance(one, ast.Compare) and isinstance(one.ops[0], orders) for one in parts)


def runs_out(loop, tree):
    """Whether it goes through an object of a class of the script whose `__next__` comes to its end."""
    name = called_name(loop.iter) if isinstance(loop, ast.For) else ""
    owners = [n for n in all_of(tree, ast.ClassDef) if name and n.name == name]
    inside = [n for owner in owners for n in ast.walk(owner)]
    at_end = {id(part) for n in inside if is_about_the_end(n) for one in n.body for part in ast.walk(one)}
    ends = (n for n in inside if isinstance(n, ast.Raise) and n.exc is not None and id(n) not in at_end)
    return any("StopIteration" in names_in(n.exc) for n in ends)


def is_about_the_end(node):
    """Whether what is in it runs only when the node should end: `if rospy.is_shutdown():`, or an `except` of that."""
    if isinstance(node, ast.If):
        return any(loop_ends(n) is not None for n in ast.walk(node.test))
    return isinstance(node, ast.ExceptHandler) and any("Interrupt" in kind for kind in caught_by(node))


def called_own(node, functions):
    """Return the script's function that `f()` or `self.f()` calls; None of any other expression."""
    owner, _, name = dotted(node.func).rpartition(".") if isinstance(node, ast.Call) else ("", "", "")
    return functions.get(name) if owner in ("", "self") else None


def is_short(sleep):
    return bool(sleep.args) and (constant(sleep.args[0], lambda node: node) or 1.0) < 0.1


def turns(tree):
    """Yield each node with its function, and whether a loop in there does it again and again."""
    left = [(tree, None, False)]
    while left:
        node, function, again = left.pop()
        yield node, (function, again)
        for child in ast.iter_child_nodes(node):
            own = isinstance(child, (ast.FunctionDef, ast.Lambda))
            looped = again or isinstance(node, LOOPS)
            left.append((child, child if own else function, looped and not own))


def is_endless(loop, function=None):
    """Whether it asks for nothing but the node's end, and nothing in it leaves it; in a function, also for variables of
    the function that nothing in the loop changes."""
    asks = asks_for_ever(loop.test) or (function is not None and is_unchanging(loop, function))
    return asks and not any(isinstance(n, (ast.Break, ast.Return, ast.Raise)) for n in ast.walk(loop))


def asks_for_ever(test):
    if isinstance(test, ast.Constant):
        return bool(test.value)
    inverted = isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)
    return inverted and is_call(test.operand, "is_shutdown")


def is_unchanging(loop, function):
    """Whether a loop's condition is made of the function's own variables and numbers, and nothing in it sets them."""
    parts = [loop.test]
    if isinstance(loop.test, ast.BoolOp) and isinstance(loop.test.op, ast.And):
        parts = [part for part in loop.test.values if not asks_for_ever(part)]
    inside = [n for part in parts for n in ast.walk(part)]
    names = {n.id for n in inside if isinstance(n, ast.Name)}
    outer = (n for n in ast.walk(function) if isinstance(n, (ast.Global, ast.Nonlocal)))
    own, changed = set_in(function) - {name for n in outer for name in n.names}, set_in(loop)
    is_plain_test = not any(isinstance(n, (ast.Call, ast.Attribute, ast.Subscript)) for n in inside)
    return bool(names) and is_plain_test and names <= own - changed


SWALLOWS = {"", "KeyboardInterrupt", "ROSInterruptException", "ROSException", "Exception", "BaseException"}
ENDS = (ast.Break, ast.Return, ast.Raise)
RAISING = ("wait_for_message", "wait_for_service")
"""Calls that end with an exception on Ctrl-C. `rate.sleep()` is none of them: by the real clock it sleeps on."""
ASKS = "check `rospy.is_shutdown()` in it: `while not rospy.is_shutdown():`"
ENDS_FOR = "write `if rospy.is_shutdown(): break` below the `for` on line %d"
ASKS_TOO = "on line %d, write `and not rospy.is_shutdown()` before the colon"
ASKS_AS_WELL = "on line %d, put the condition in brackets, and write `and not rospy.is_shutdown()` behind it"


def deaf_loops(tree):
    """Why a node goes on after Ctrl-C: loops that do not ask for it, an `except` within them, signals put off."""
    endless, others, counted = [], [], []
    asking = {name for name, one in functions_in(tree).items() if any(map(is_shutdown, ast.walk(one)))}
    ending = set_at_the_end(tree)
    for loop in all_of(tree, *LOOPS):
        is_while, inside = isinstance(loop, ast.While), list(ast.walk(loop))
        is_ended = is_while and ending & names_in(loop.test)
        may_last = is_while or is_endless_for(loop) or calls_in(loop, "sleep")
        if is_ended or not may_last or any(map(is_shutdown, inside)) or counts_down(loop):
            continue
        # what calls a generator, or a function that asks, leaves the loop to it
        if any(isinstance(n, (ast.Yield, ast.YieldFrom)) or called_name(n) in asking for n in inside):
            continue
        caught = [h for n in inside if isinstance(n, ast.Try) for h in n.handlers if goes_on(h)]
        if calls_in(loop, *RAISING):
            for handler in caught[:1]:
                message = "the `except` on line %d catches what Ctrl-C raises, " % handler.lineno
                message += "and the loop on line %d goes on" % loop.lineno
                endless.append(slip(loop.lineno, "deaf", message, ASKS))
        elif is_while or is_endless_for(loop):
            known = endless if not is_while or isinstance(loop.test, ast.Constant) else others
            known.append(deaf(loop, sleeping(inside, loop, tree)))
        else:
            counted.append(deaf(loop, []))
    for node in () if calls_in(tree, "signal_shutdown") else walk(tree):
        off = [k for k in getattr(node, "keywords", ()) if k.arg == "disable_signals"]
        if is_call(node, "init_node") and any(getattr(k.value, "value", True) for k in off):
            message = "`disable_signals=True` on line %d keeps Ctrl-C from rospy" % node.lineno
            yield slip(node.lineno, "deaf", message, "leave it out")
        if is_call(node, "signal") and node.args and dotted(node.args[0]).endswith("SIGINT"):
            message = "line %d replaces what rospy does on Ctrl-C" % node.lineno
            yield slip(node.lineno, "deaf", message, "delete it")
    yield from endless or others or counted


def set_at_the_end(tree):
    """Return the names of what the functions given to `on_shutdown(…)` set: `self.stopped = True`, `stop.set()`."""
    given = [one for call in calls_in(tree, "on_shutdown") for one in argument(call, 0, "h")]
    names = {dotted(one.value) for one in given if isinstance(one, ast.Attribute) and one.attr == "set"}
    for n in run_at_the_end(tree):
        if isinstance(getattr(n, "ctx", None), ast.Store):
            names.add(dotted(n))
        elif is_call(n, "set"):
            names.add(dotted(n.func.value))
    return names


def run_at_the_end(tree):
    """Return what is in the functions given to `on_shutdown(…)`."""
    functions, calls = functions_in(tree), calls_in(tree, "on_shutdown")
    given = [one for call in calls for one in argument(call, 0, "h")]
    run = {functions.get(dotted(one).rpartition(".")[2]) for one in given} - {None}
    run.update(one for one in given if isinstance(one, ast.Lambda))
    return [n for one in run for n in ast.walk(one)]


def counts_down(loop):
    """Whether it calls nothing, and steps what it asks for: `while angle > pi: angle -= 2 * pi`."""
    asked = names_in(getattr(loop, "test", loop)) - {"..."}
    inside = [n for one in loop.body for n in ast.walk(one)]
    stepped = [n.target for n in inside if isinstance(n, ast.AugAssign)]
    steps = any(dotted(n.value if isinstance(n, ast.Subscript) else n) in asked for n in stepped)
    return isinstance(loop, ast.While) and steps and not any(isinstance(n, ast.Call) for n in inside)


def deaf(loop, within):
    """Return the slip of a loop that never asks, with those `within` it that take their time."""
    named = "loops on %s never check" if within else "loop on %s never checks"
    named %= listed(one.lineno for one in (loop, *within))
    asks, ends = ASKS, [ENDS_FOR % one.lineno for one in within]
    test = getattr(loop, "test", ast.Constant(True))
    # binds less than `and` does
    is_loose = isinstance(test, (ast.NamedExpr, ast.IfExp)) or isinstance(getattr(test, "op", None), ast.Or)
    if not isinstance(test, (ast.Constant, ast.Lambda)):  # its own condition ends it, too
        asks = (ASKS_AS_WELL if is_loose else ASKS_TOO) % test.end_lineno
    fixes = [asks, *ends] if isinstance(loop, ast.While) or within else [ENDS_FOR % loop.lineno]
    kind = "deaf" if within else "deaf-loop"
    return slip(loop.lineno, kind, "the %s whether the node should end" % named, "; then ".join(fixes))


def is_endless_for(loop):
    return isinstance(loop, ast.For) and called_name(loop.iter) == "count"


def sleeping(inside, loop, tree):
    """Return the `for`s in a loop that sleep in each of their turns, so that they can take long: also those that will,
    once `sleep()`, which stands below both loops, is moved into them."""
    loops = [n for n in inside if n is not loop and isinstance(n, ast.For)]
    is_below = loops and not calls_in(loop, "sleep")
    is_below = is_below and any(n.lineno > loop.lineno for n in calls_in(tree, "sleep"))
    return [n for n in loops if calls_in(n, *("sleep", "publish")[: 1 + bool(is_below)])]


def goes_on(handler):
    """Whether an `except` catches what Ctrl-C raises, and leaves neither the loop nor the script."""
    catches = any(kind.rpartition(".")[2] in SWALLOWS for kind in caught_by(handler))
    left = (n for n in ast.walk(handler) if isinstance(n, ENDS) or called_name(n) in ("exit", "_exit"))
    return catches and next(left, None) is None


def is_shutdown(node):
    """Whether it is `rospy.is_shutdown`, or `ok` as in roscpp, and no attribute that a base class may have."""
    name = dotted(node)
    return name in ("rospy.ok", "ros.ok") or (
        name.rpartition(".")[2] == "is_shutdown" and name != "self.is_shutdown"
    )
