"""Finds what compiles in a student's Python and is not meant: `slips` of a syntax tree, for `syntax.py`.

What nothing calls, statements without an effect, values that are none, imports. Names are for `script_names.py`, texts
for `script_texts.py`, objects for `script_objects.py`, callbacks for `script_callbacks.py`, loops for
`script_loops.py`, their rates for `script_rates.py`, indexes for `script_indexes.py`, counters and clocks for
`script_counters.py`. Nothing is executed. A file has to be parsed by ROS's own Python, which is to run it: Python 3.8,
standard library only.
"""

import ast
import importlib.util
import os
import sys

# `-I` leaves this folder out
sys.path.append(os.path.dirname(os.path.abspath(__file__)))
import script_callbacks as callbacks
import script_counters as counters
import script_indexes
import script_loops as loops
import script_names as names
import script_objects as objects
import script_rates as rates
from script_names import (
    LOOPS,
    all_of,
    called_name,
    calls_in,
    dotted,
    is_call,
    names_in,
    parents_of,
    slip,
    statements_of,
    targets_of,
    text_of,
    walk,
    walk_own,
)
from script_texts import said_texts

SLIPS_LIMIT = 100
"""Of a file."""


def slips(tree):
    """What compiles and is not meant: names that are not called or not there, questions that wait for a keyboard."""
    finders = (
        uncalled_and_asked, objects.names_of_objects, names.misspelt, rates.loop_rates, rates.nanoseconds,
        counters.resets, never_run, loops.never_reached, loops.stopped_loops, loops.published_before,
        loops.sleepless_loops, loops.sleeps_twice, loops.publishes_twice, callbacks.callbacks,
        loops.waiting_callbacks, objects.queue_sizes, objects.graph_names,
        objects.object_slips, said_texts, loops.deaf_loops, counters.clock_values, counters.counter_slips,
        counters.counter_starts, without_effect, names.assigned_late, objects.hidden_names, objects.subscribed_again,
        imports, objects.taken_off, objects.unstarted_servers, wrong_values, decided_conditions,
        times_added_again, params_read_unset, overwritten_values, script_indexes.indexes, published_in_turn,
        objects.kept_velocities,
        callbacks.unprinted_messages, counters.values_left_out, counters.published_unchanged,
        objects.unused_publishers, objects.unsent_messages, loops.loops_of_numbers, finished_goals,
        finished_in_loops, counters.sends_no_time, without_node,
    )  # fmt: skip
    found = [one for find in finders for one in find(tree)]
    # of two that say why a name is not there, the first is about the class that it belongs to
    # reversed: of several with the same key the last one stays in a dict, and the first is wanted
    first = {(one["line"], one["name"]): one for one in reversed(found) if one["kind"] == "undefined"}
    found = [one for one in found if one["kind"] != "undefined" or first[one["line"], one["name"]] is one]
    return sorted(found, key=lambda one: one["line"])[:SLIPS_LIMIT]


def uncalled_and_asked(tree):
    """Functions that are named but not called, and questions that wait for a keyboard."""
    functions, kept = {n.name for n in all_of(tree, ast.FunctionDef, ast.ClassDef)}, targets_of(tree)
    count = 0
    for node in walk(tree):
        name = uncalled(node, functions)
        if name:
            count += 1
            message, fix = "`%s` is named but not called" % name, "write `%s()`" % name
            yield slip(node.lineno, "not-called", message, fix, name)
        name = asked(node, functions)
        if name and count < SLIPS_LIMIT:  # each looks through the whole script
            count += 1
            message = "`%s()` waits for someone to type, and a graded node gets no input" % name
            line = numbered(node, tree)
            fix = "delete line %d, which makes a number of it" % line if line else ""
            fix = decided_by(node, tree) or fix
            yield slip(node.lineno, "input", message, fix, how_often(node, tree))
            if name == "input" and not line and kept.get(id(node), "...") != "...":
                yield slip(node.lineno, "typed-text", name, name=kept[id(node)])


def without_node(tree):
    """A script with topics, or one that does more than define names, that makes no node."""
    calls = {called_name(n) for n in all_of(tree, ast.Call)}
    # A file that only defines names is there to be imported, and needs no node of its own
    if "init_node" not in calls and (calls & {"Publisher", "Subscriber"} or does_something(tree)):
        fix = "make it a node: `rospy.init_node(…)`, then its topics, then `rospy.spin()` or a loop"
        yield slip(1, "no-init", "nothing in the script calls `rospy.init_node(…)`", fix)


def does_something(tree):
    """Return whether a file does more when it is run than to define names for others."""
    calls = any(isinstance(n, LOOPS) or is_call_alone(n) for n in tree.body)
    return calls or any(getattr(n, "id", "") == "__name__" for n in walk(tree))


def is_call_alone(node):
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)


WORKS = ("init_node", "publish", "spin", "sendTransform", "send_goal", "set_param")
"""What a function is there for: one that calls none of these may be a spare one."""


def never_run(tree):
    """Functions that make a node, publish or wait, and that nothing names; and `__name__` beside another word than
    `__main__`.
    """
    named = {n.id for n in all_of(tree, ast.Name) if isinstance(n.ctx, ast.Load)}
    named |= {n.attr for n in all_of(tree, ast.Attribute)}
    made = [n for n in all_of(tree, ast.Assign) if isinstance(n.value, ast.Call)]
    made_of = {dotted(n.value.func): dotted(n.targets[0]) for n in made}
    classes = all_of(tree, ast.ClassDef)
    of_class = {id(f): c.name for c in classes for f in c.body}
    plain = {c.name for c in classes} | {"object"}
    for one in classes:  # what a class of another module is the base of, that module may call
        if {dotted(base) for base in one.bases} - plain:
            plain.discard(one.name)
            named |= {f.name for f in one.body if isinstance(f, ast.FunctionDef)}
    for node in walk(tree):
        # A decorator may hand the function on to what calls it
        if isinstance(node, ast.FunctionDef) and node.name not in named and not node.decorator_list:
            # Python itself calls `__init__` and its like
            if calls_in(node, *WORKS) and not node.name.startswith("__"):
                message, owner = "nothing calls `%s()`" % node.name, of_class.get(id(node), "")
                owner = owner and (made_of.get(owner) or owner + "()") + "."
                fix = handed_over(node, tree, owner)
                yield slip(node.lineno, "never-called", message, fix, owner + node.name)
        elif isinstance(node, ast.Compare) and getattr(node.left, "id", "") == "__name__":
            word = getattr(node.comparators[0], "value", "__main__")
            if word != "__main__" and isinstance(node.ops[0], (ast.Eq, ast.Is)):
                yield slip(node.lineno, "main-guard", "`__name__` is never %r" % (word,))


def handed_over(function, tree, owner):
    """Return who has to be told of a callback, which takes one value, or how one that takes several is called; "" of
    another function."""
    taken = [one.arg for one in function.args.args if one.arg != "self"]
    if (len(taken) > 1 or (taken and calls_in(function, "set_param"))) and not function.args.defaults:
        return "call `%s%s(…)` with values for %s" % (owner, function.name, ", ".join(taken))
    # A callback is given one message, and a function that makes the node is the program's own beginning
    if len(taken) != 1 or function.args.defaults or calls_in(function, "init_node"):
        return ""
    name = (owner and "self.") + function.name
    if calls_in(tree, "send_goal") and "feedback" in (function.name + taken[0]).lower():
        return "pass it: `send_goal(…, feedback_cb=%s)`" % name
    return "pass it to what calls it: `rospy.Subscriber(…, %s)`" % name


OF_ANGLES = ("sin", "cos", "tan")
TO_RADIANS = ("radians", "deg2rad")
IN_DEGREES = ("degrees", "rad2deg")


def wrong_values(tree):
    """Comparisons with NaN, angles in degrees of which a sine is taken, answers of services that are dropped."""
    made = [n for n in all_of(tree, ast.Assign) if called_name(n.value) in IN_DEGREES]
    degrees = {dotted(target) for n in made for target in n.targets}
    own = {dotted(n.targets[0]) for n in all_of(tree, ast.Assign) if getattr(n.value, "attr", "") != "theta"}
    for node in walk(tree):
        line = getattr(node, "lineno", 0)
        if isinstance(node, ast.Compare) and any(map(is_nan, [node.left, *node.comparators])):
            name = dotted(node.comparators[0] if is_nan(node.left) else node.left)
            fix = "write `math.isnan(%s)`" % (name if "..." not in name else "…")
            yield slip(line, "wrong-value", "no number is equal to NaN, not even NaN itself", fix, "nan")
        elif called_name(node) in OF_ANGLES and node.args:
            given = dotted(node.args[0])
            if given in degrees or called_name(node.args[0]) in IN_DEGREES:
                message = "`%s` takes radians, and gets degrees" % called_name(node)
                fix = "leave out `degrees(…)`: the angle is already in radians"
                yield slip(line, "wrong-value", message, fix, "degrees")
        elif called_name(node) in TO_RADIANS and node.args and getattr(node.args[0], "attr", "") == "theta":
            angle = dotted(node.args[0])
            if angle in own:
                continue  # a name of the script's own, which may be in degrees
            fix = "on line %d, write `%s` alone, without `%s(…)`" % (line, angle, called_name(node))
            yield slip(line, "wrong-value", "`%s` is already in radians" % angle, fix, "added")
        elif isinstance(node, ast.Expr) and called_name(node.value).endswith("Response"):
            name = called_name(node.value)
            message, fix = "the `%s` that is made is not returned" % name, "write `return %s(…)`" % name
            yield slip(line, "wrong-value", message, fix, "return")
        elif isinstance(node, ast.FunctionDef) and unfilled_answer(node):
            variable, name, line = unfilled_answer(node)
            message = "no field of the `%s` that is returned is ever set" % name
            fix = "set it above the `return`: `%s.<field> = …`" % variable
            yield slip(line, "wrong-value", message, fix, "empty")


def unfilled_answer(function):
    """Return the variable, the class and the line of an answer that a callback makes without values, sets nothing of,
    and always returns; None where there is none."""
    own = list(walk_own(function))
    made = [n for n in own if isinstance(n, ast.Assign) and called_name(n.value).endswith("Response")]
    # Values that are given in the call need no field to be set below it
    made = [n for n in made if not n.value.args + n.value.keywords and isinstance(n.targets[0], ast.Name)]
    returned = {dotted(n.value) for n in own if isinstance(n, ast.Return) and n.value is not None}
    variable = dotted(made[0].targets[0]) if len(made) == 1 else ""
    # its name stands where it is made and returned, and nowhere else: `answer.sum` would be one more
    uses = [n for n in ast.walk(function) if isinstance(n, ast.Name) and n.id == variable]
    is_alone = returned == {variable} and len(uses) == 1 + sum(isinstance(n, ast.Return) for n in own)
    name = called_name(made[0].value) if made else ""
    # std_srvs/Empty has no field that could be set
    return (variable, name, made[0].lineno) if is_alone and variable and name != "EmptyResponse" else None


BELOW_LIMIT = 50
"""So many statements below the end of a goal are looked at."""


def finished_goals(tree):
    """Where an `if` of an action's callback ends the goal last of all, and the callback goes on below it."""
    parents = parents_of(tree)
    for node in all_of(tree, ast.If):
        # With an `else`, what stands below is meant for both cases
        if node.orelse or not is_call_alone(node.body[-1]):
            continue
        call, around = node.body[-1].value, parents.get(node)
        if called_name(call) not in objects.FINISHING:
            continue
        block = statements_of(around)
        at = block.index(node) + 1 if node in block else len(block)
        below = [one for one in block[at : at + BELOW_LIMIT] if not is_other_case(one, node)]
        more = any(calls_in(one, *objects.FINISHING) or isinstance(one, LOOPS) for one in below)
        in_loop = isinstance(around, LOOPS)
        if more or (in_loop and not is_last_turn(around, node, call)):
            what = "loop" if in_loop else "callback"
            message = "the goal is over with `%s(…)`, and the %s goes on" % (called_name(call), what)
            fix = "below line %d, write `return`" % node.body[-1].end_lineno
            yield slip(call.lineno, "goes-on", message, fix, called_name(call))


def finished_in_loops(tree):
    """Where the first turn of a loop that reports on its way ends an action's goal, and the loop goes on."""
    for loop in all_of(tree, *LOOPS):
        alone = [one.value for one in loop.body if is_call_alone(one)]
        ending = [one for one in alone if called_name(one) in objects.FINISHING]
        left = any(isinstance(one, (ast.Break, ast.Return)) for one in loop.body)
        takes = calls_in(loop, "accept_new_goal", "is_active")
        takes = takes or {dotted(getattr(loop, "target", None))} & {dotted(one.func.value) for one in ending}
        if ending and not left and not takes and calls_in(loop, "publish_feedback"):
            call, end = ending[-1], loop.end_lineno
            message = "`%s(…)` is inside of the loop on line %d, whose first turn ends the goal"
            fix = "move line %d out of the loop, below its last line, %d, with the same spaces or tabs before it "
            fix += "as line %d has"
            fix %= (call.lineno, end, loop.lineno)
            yield slip(
                call.lineno, "goes-on", message % (called_name(call), loop.lineno), fix, called_name(call)
            )


def is_other_case(node, before):
    """Whether an `if` asks for the opposite of one above it, or whether the goal is still active."""
    if not isinstance(node, ast.If):
        return False
    # `if not done:` below `if done:` does not run in the same turn
    opposite = isinstance(node.test, ast.UnaryOp) != isinstance(before.test, ast.UnaryOp)
    asked = [ast.dump(getattr(one.test, "operand", one.test)) for one in (node, before) if opposite]
    return bool(calls_in(node.test, "is_active")) or (opposite and asked[0] == asked[1])


def is_last_turn(loop, node, call):
    """Whether an `if` that ends a goal also ends the loop around it by what it sets, or the loop has one goal after the
    other."""
    if isinstance(loop, ast.For):
        # Each turn ends another goal, so that none is ended twice
        return dotted(loop.target) == dotted(call.func.value)
    stored = {dotted(target) for n in node.body if isinstance(n, ast.Assign) for target in n.targets}
    takes = any(calls_in(one, "accept_new_goal") for one in loop.body[:BELOW_LIMIT])
    return bool(takes or calls_in(loop.test, "is_active") or stored & names_in(loop.test))


BELOW = (ast.Lt, ast.LtE)
NUMBERS_BELOW, TEXT_SHOWN = 1e9, 40
SIGNS = {ast.Gt: ">", ast.GtE: ">=", ast.Lt: "<", ast.LtE: "<="}
TURNED = {ast.Gt: ast.Lt, ast.GtE: ast.LtE, ast.Lt: ast.Gt, ast.LtE: ast.GtE}


def decided_conditions(tree):
    """`x > 265 or x < 275`, which every number fulfils, and `x < 10 and x > 350`, which none does."""
    for node in all_of(tree, ast.BoolOp):
        any_of, bounds = isinstance(node.op, ast.Or), {}
        yield from decided_by_values(node, ast.NotEq if any_of else ast.Eq)
        for name, kind, number in filter(None, map(bound_of, node.values)):
            lowest, highest = bounds.setdefault(name, [None, None])
            side = kind in BELOW
            before = (lowest, highest)[side]
            # of several bounds on one side, the widest one counts for `or`, and the narrowest for `and`
            if before is None or (number < before[1]) == (any_of != side):
                bounds[name][side] = (kind, number)
        for name, (low, high) in bounds.items():
            if low is None or high is None or not (low[1] < high[1] if any_of else low[1] > high[1]):
                continue
            word, other, holds = ("or", "and", "every number") if any_of else ("and", "or", "no number")
            pair = "%s %s %g %s %s %s %g" % (name, SIGNS[low[0]], low[1], word, name, SIGNS[high[0]], high[1])
            fix = "on line %d, write `%s` in place of `%s`, or compare with other numbers"
            fix %= (node.lineno, other, word)
            yield slip(node.lineno, "wrong-value", "`%s` is true for %s" % (pair, holds), fix, "bounds")


def decided_by_values(condition, kind):
    """`key != 'a' or key != 'b'`, which every value fulfils, and `key == 'a' and key == 'b'`, which none does."""
    asked = {}
    for one in condition.values:
        is_plain = isinstance(one, ast.Compare) and len(one.ops) == 1 and isinstance(one.ops[0], kind)
        if is_plain and isinstance(one.comparators[0], ast.Constant) and "..." not in dotted(one.left):
            value = one.comparators[0].value  # 1 and 1.0 are one value
            asked.setdefault(dotted(one.left), {})[value] = repr(value)[:TEXT_SHOWN].replace("`", "'")
    for name, values in asked.items():
        if len(values) > 1:
            is_or = kind is ast.NotEq
            sign, word, other, holds = ("!=", "or", "and", "every") if is_or else ("==", "and", "or", "no")
            first, second = list(values.values())[:2]
            pair = "%s %s %s %s %s %s %s" % (name, sign, first, word, name, sign, second)
            fix = "on line %d, write `%s` in place of `%s`" % (condition.lineno, other, word)
            message = "`%s` is true for %s value" % (pair, holds)
            yield slip(condition.lineno, "wrong-value", message, fix, "bounds")


def params_read_unset(tree):
    """`if not rospy.has_param('~a'): a = rospy.get_param('~a')`, which reads it only where nobody sets it."""
    for node in all_of(tree, ast.If):
        is_not = isinstance(node.test, ast.UnaryOp) and isinstance(node.test.op, ast.Not)
        asked = node.test.operand if is_not else node.test
        name = text_of(asked.args[0]) if called_name(asked) == "has_param" and asked.args else ""
        unset, is_set = (node.body, node.orelse) if is_not else (node.orelse, node.body)
        reads = [
            [c for n in block for c in calls_in(n, "get_param") if c.args and text_of(c.args[0]) == name]
            for block in (unset, is_set)
        ]
        if name and reads[0] and not reads[1] and all(len(c.args) == 1 and not c.keywords for c in reads[0]):
            message = "this reads the parameter %s only where it is not set" % name
            right = "without its `not`" if is_not else "with a `not`"
            fix = "on line %d, write the condition %s" % (node.lineno, right)
            yield slip(node.lineno, "wrong-value", message, fix, "unset")


CLOCKS = ("now", "get_time", "time", "get_rostime", "to_sec", "toSec")


def function_around(node, tree):
    """Return the name of the function that a node is in, "" outside all of them."""
    while node is not tree and not isinstance(node, ast.FunctionDef):
        node = parents_of(tree)[node]
    return getattr(node, "name", "")


def times_added_again(tree):
    """`way += speed * (t1 - t0)` in a loop that leaves t0 as it is."""
    given = [n for n in all_of(tree, ast.Assign) if calls_in(n.value, *CLOCKS)]
    timed, started_in = {id(n.value) for n in given}, {}
    for node, target in ((n, target) for n in given for target in n.targets):
        started_in.setdefault(dotted(target), set()).add(function_around(node, tree))
    shared = {name for n in all_of(tree, ast.Global, ast.Nonlocal) for name in n.names}
    for loop in all_of(tree, ast.While, ast.For):
        inside = list(ast.walk(loop))
        stored = dict.fromkeys(dotted(n) for n in inside if isinstance(getattr(n, "ctx", None), ast.Store))
        here = {function_around(loop, tree), "__init__"}
        stored.update((dotted(t), n.value) for n in inside if isinstance(n, ast.Assign) for t in n.targets)
        for node in loop.body:
            is_sum = isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add)
            spans = [n for n in ast.walk(node.value) if isinstance(n, ast.BinOp)] if is_sum else ()
            for span in spans:
                start, end = dotted(getattr(span, "right", None)), stored.get(dotted(span.left), span.left)
                is_clock = isinstance(span.op, ast.Sub) and (id(end) in timed or is_call(end, *CLOCKS))
                renewed = ("." in start or start in shared) and started_in.get(start, here) - here
                if is_clock and start not in stored and "..." not in start and not renewed:
                    name = dotted(node.target)
                    message = "`%s +=` adds the whole time since `%s` again in each turn" % (name, start)
                    fix = "on line %d, write `%s =` instead of `%s +=`" % (node.lineno, name, name)
                    yield slip(node.lineno, "wrong-value", message, fix, "added")


def published_in_turn(tree):
    """An `if` with an `else` about each item of a list, and a `publish(…)` of what both set, all in one `for` loop."""
    for loop in all_of(tree, ast.For):
        published = [
            one.value for one in loop.body if is_call_alone(one) and called_name(one.value) == "publish"
        ]
        choices = [one for one in loop.body if isinstance(one, ast.If) and one.orelse]
        seen = {n.id for n in ast.walk(loop.target) if isinstance(n, ast.Name)}
        if not published or not choices or acts(ast.Module(loop.body, []), "publish"):
            continue
        about = [one for one in choices if seen & names_in(one.test) and "ranges" in ast.dump(loop)]
        if about and len(published) == 1:
            line = published[0].lineno
            message = (
                "the loop on line %d publishes once for each range, and the last one decides" % loop.lineno
            )
            fix = "work out the smallest of the ranges first, and write the `if` of line %d and the `publish(…)` of "
            fix += "line %d below the loop, for that one"
            yield slip(line, "wrong-value", message, fix % (about[0].lineno, line), "added")


def overwritten_values(tree):
    """An `if` with an `else`, alone in a `for` loop, both of which give one name a fixed value, so that what the loop
    saw before its last turn is forgotten.
    """
    for loop in all_of(tree, ast.For):
        only = loop.body[0] if len(loop.body) == 1 else None
        if isinstance(only, ast.If) and isinstance(only.test, ast.Compare) and not acts(only):
            yield from overwritten(loop, only)


HARMLESS = {
    "print", "loginfo", "logwarn", "str", "format", "round", "abs", "float", "isnan", "isinf", "append",
}  # fmt: skip
"""Calls that change nothing outside the loop that a student may see."""


def acts(node, *spared):
    """Whether something leaves a loop, or happens in its turns beyond what is computed and printed."""
    calls = {called_name(n) or "" for n in ast.walk(node) if isinstance(n, ast.Call)}
    leaving = (ast.Break, ast.Return, ast.Raise, ast.Yield)
    return not calls <= HARMLESS.union(spared) or any(isinstance(n, leaving) for n in ast.walk(node))


def overwritten(loop, choice):
    """Yield the `if` of a loop's body that gives a name one fixed value, and its `else` another one."""
    one, other = (
        {
            dotted(n.targets[0]): n.value
            for n in block
            if isinstance(n, ast.Assign) and isinstance(getattr(n.value, "operand", n.value), ast.Constant)
        }
        for block in (choice.body, choice.orelse)
    )
    read = {dotted(n) for n in ast.walk(choice) if isinstance(getattr(n, "ctx", None), ast.Load)}
    names = [name for name in one if name in other and ast.dump(one[name]) != ast.dump(other[name])]
    names = [name for name in names if name not in read]
    if names and type(choice.test.ops[0]) in SIGNS:
        near = type(choice.test.ops[0]) in BELOW
        value = (other if near else one)[names[0]]
        sign = {ast.USub: "-", ast.Not: "not ", ast.Invert: "~"}.get(type(getattr(value, "op", None)), "")
        usual = sign + repr(getattr(value, "operand", value).value)
        message = "each turn of this loop sets `%s`, so that only the last one counts" % names[0]
        fix = "set `%s` to %s above the loop on line %d, and not in the `%s`"
        fix %= (names[0], usual, loop.lineno, "else" if near else "if")
        yield slip(choice.lineno, "wrong-value", message, fix, "added")


def bound_of(node):
    """Return the name, the kind and the number of a comparison with a number; None of all else."""
    if not isinstance(node, ast.Compare) or len(node.ops) != 1 or type(node.ops[0]) not in SIGNS:
        return None
    name, kind, number = node.left, type(node.ops[0]), number_of(node.comparators[0])
    if number is None:
        name, kind, number = node.comparators[0], TURNED[kind], number_of(node.left)
    return None if number is None or "..." in dotted(name) else (dotted(name), kind, number)


def number_of(node):
    """Return a number that stands in the script, with its sign; None of all else."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        number = number_of(node.operand)
        return None if number is None else -number
    is_number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
    return node.value if is_number and abs(node.value) < NUMBERS_BELOW else None


def is_nan(node):
    """Return whether it is written as `float('nan')`, `math.nan` or `numpy.nan`."""
    if called_name(node) == "float" and node.args:
        return str(getattr(node.args[0], "value", "")).lower() == "nan"
    return isinstance(node, ast.Attribute) and node.attr.lower() == "nan"


METHODS = {
    "sleep", "spin", "publish", "loginfo", "init_node", "close", "start", "stop", "unregister", "shutdown",
    "signal_shutdown", "wait_for_server", "wait_for_result", "send_goal", "set_accepted", "set_succeeded",
    "set_aborted", "set_preempted", "publish_feedback",
}  # fmt: skip
"""Of rospy and of what it makes: called for what they do."""


def uncalled(node, functions):
    """Return the function or method that a line names without brackets, and that it calls elsewhere or is known."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Attribute):
        owner, method = node.value.value, node.value.attr
        known = method in METHODS or method in functions
        made = "%s(…).%s" % (dotted(owner.func), method) if isinstance(owner, ast.Call) else ""
        return (made or dotted(node.value)) if known else None
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Name) and node.value.id in functions:
        return node.value.id
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return dotted(node.operand) if loops.is_shutdown(node.operand) else None
    if isinstance(node, (ast.While, ast.If)) and loops.is_shutdown(node.test):
        return dotted(node.test)
    return None


def asked(node, functions):
    if not isinstance(node, ast.Call):
        return None
    name = dotted(node.func)
    if name in ("input", "raw_input"):
        return None if name in functions else name
    return name if name in ("sys.stdin.read", "sys.stdin.readline", "sys.stdin.readlines") else None


def how_often(node, tree):
    """Return "once" for what no loop around it does again, "paused" for what a loop does that sleeps, "" else."""
    around = [n for n in all_of(tree, *LOOPS) if node in ast.walk(n)]
    if not around:
        return "once"
    return "paused" if calls_in(around[-1], "sleep") else ""


def numbered(node, tree):
    """Return the line on which the variable that gets what is typed is made a number, `n = int(n)`; 0 for none."""
    assigned = [n for n in all_of(tree, ast.Assign) if n.lineno >= node.lineno]
    given = {dotted(n.targets[0]) for n in assigned if n.value is node}
    made = [n for n in assigned if called_name(n.value) in ("int", "float") and dotted(n.targets[0]) in given]
    own = [n for n in made if [dotted(one) for one in n.value.args] == [dotted(n.targets[0])]]
    return min((n.lineno for n in own), default=0)


def decided_by(node, tree):
    """Return what to write in place of a question and of the `if`s that publish only after some of its answers."""
    parents = parents_of(tree)
    while node in parents and not isinstance(node, ast.stmt):
        node = parents[node]
    given = {dotted(t) for t in getattr(node, "targets", [])}
    block = statements_of(parents.get(node))
    below = block[block.index(node) + 1 :] if node in block else []
    deciding = [one for one in below if isinstance(one, ast.If) and given & names_in(one.test)]
    sent = [n for one in below for n in calls_in(one, "publish")]
    if not deciding or not sent or any(calls_in(one, "publish") for one in below if one not in deciding):
        return ""
    if any(calls_in(one, "sleep") for one in below[: below.index(deciding[-1]) + 1]):
        return ""  # without it, the node would flood its topic
    return "publish … in place of lines %d to %d" % (node.lineno, deciding[-1].end_lineno)


IMPORTS_LIMIT = 30


def imports(tree):
    """Imports of what nothing in the script uses, and of modules that this Python does not find; the standard library's
    and rospy are there and cost nothing."""
    every = all_of(tree, ast.Name)
    hidden = {n.id for n in every if isinstance(n.ctx, ast.Store)}
    # `String = String()` reads the import, or was meant to
    hidden -= {called_name(n.value) for n in all_of(tree, ast.Assign)}
    used = {n.id for n in every} - hidden
    tried = {id(n) for one in all_of(tree, ast.Try) for n in ast.walk(one)}
    found = [n for n in all_of(tree, ast.Import, ast.ImportFrom) if id(n) not in tried]
    for node in found[:IMPORTS_LIMIT]:
        listed = [alias.name for alias in node.names]
        modules = listed if isinstance(node, ast.Import) else [node.module or ""]
        module = modules[0].partition(".")[0]
        bound = [alias.asname or alias.name.partition(".")[0] for alias in node.names]
        if len(modules) > 1 or getattr(node, "level", 0) or module in counters.PLAIN_MODULES - {"numpy"}:
            continue
        if not used.intersection(bound) and bound != ["*"] and "__all__" not in used:
            why = (
                "the script gives `%s` a value of its own"
                if hidden.issuperset(bound)
                else "nothing in the script uses `%s`"
            )
            fix = "delete line %d: %s" % (node.lineno, why % "`, `".join(bound))
            yield slip(node.lineno, "unused-import", module, fix, bound[0])
        if not is_there(module):
            whole = modules[0] if modules[0] != module else ""
            yield slip(node.lineno, "lacking-import", module, whole, bound[0])


def is_there(module):
    """Return whether Python finds a module, without importing it."""
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError, AttributeError):
        return False


def without_effect(tree):
    """Statements that compute something and keep nothing of it: `++i`, `i + 1`, `i == 0`; and `i = i`."""
    for node in walk(tree):
        name = dotted(getattr(node, "value", None))
        if isinstance(node, ast.Assign) and [dotted(t) for t in node.targets] == [name] != ["..."]:
            message, fix = "`{0} = {0}` changes nothing", "write `{0} = {0} + 1`, or whatever it should be,"
            yield slip(node.lineno, "no-effect", message.format(name), fix.format(name), name)
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.UnaryOp) and isinstance(value.operand, ast.UnaryOp):
            same = type(value.op) is type(value.operand.op) and isinstance(value.op, (ast.UAdd, ast.USub))
            name, sign = dotted(value.operand.operand), "+" if isinstance(value.op, ast.UAdd) else "-"
            if same and "..." not in name:
                message = "`%s%s` changes nothing in Python" % (2 * sign, name)
                yield slip(node.lineno, "no-effect", message, "write `%s %s= 1`" % (name, sign))
        elif isinstance(value, ast.BinOp) and isinstance(value.op, (ast.Add, ast.Sub)):
            name, sign = dotted(value.left), "+" if isinstance(value.op, ast.Add) else "-"
            if "..." not in name and isinstance(value.right, ast.Constant):
                parts = (name, sign, value.right.value)
                message, fix = "`%s %s %r` alone changes nothing" % parts, "write `%s %s= %r`" % parts
                yield slip(node.lineno, "no-effect", message, fix)
        elif isinstance(value, ast.Compare) and isinstance(value.ops[0], ast.Eq):
            name = dotted(value.left)
            if "..." not in name:
                right = value.comparators[0]
                right = repr(right.value) if isinstance(right, ast.Constant) else dotted(right)
                message = "`%s ==` compares and gives no value" % name
                yield slip(node.lineno, "compared", message, "write `%s = %s`" % (name, right))
