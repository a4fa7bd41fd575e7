"""Finds the counters in a student's Python, for `slips.py`: where one begins, counts and goes back. Which values a
script publishes is for `script_clocks.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins
import itertools

from script_tree import (
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    lines_from,
    listed,
    loop_around,
    names_in,
    slip,
    walk,
)


def in_brackets(counter, rest):
    """Return how `counter + 1 % 128` is meant; "" where it is something else that a number behind a `%` is added to."""
    if not isinstance(counter, (ast.Name, ast.Attribute)) or None in (whole(rest.left), whole(rest.right)):
        return ""
    return "write `(%s + %d) %% %d`" % (dotted(counter), whole(rest.left), whole(rest.right))


def resets(tree):
    """Where a counter goes back: the number that it is set to in an `if` that asks for it, and the number in that `if`,
    or behind a `%`, or in the `range(…)` of a loop that publishes.
    """
    added = {id(n.right): n.left for n in all_of(tree, ast.BinOp) if isinstance(n.op, ast.Add)}
    alone = {n.value for n in all_of(tree, ast.Expr)}  # of what is computed there, nothing is kept
    yield from limits_of_ranges(tree)
    for node in walk(tree):
        value, done, asked, fix = None, (), [], ""
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod) and node not in alone:
            asked = [node.right]
            fix = in_brackets(added.get(id(node)), node)
        elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Mod):
            asked = [node.value]
        elif isinstance(node, ast.If):
            done = [(one.targets[0], one.value) for one in node.body if isinstance(one, ast.Assign)]
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.IfExp):
            done = [(node.targets[0], node.value.body), (node.targets[0], node.value.orelse)]
        if done:
            test = list(ast.walk(node.test if isinstance(node, ast.If) else node.value.test))
            names = {ast.dump(part) for part in test if isinstance(part, (ast.Name, ast.Attribute))}
            values = [value for name, value in done if ast.dump(name).replace("Store()", "Load()") in names]
            value = next((value for value in values if signed(value) is not None), None)
            asked = test if value is not None else []
        for part in asked:
            if whole(part) is not None:
                yield slip(part.lineno, "reset-limit", "%d" % whole(part), fix)
        if value is not None:
            yield slip(value.lineno, "reset-value", "%d" % signed(value))


def limits_of_ranges(tree):
    for node in all_of(tree, ast.For):
        sends = calls_in(node, "publish") or any(isinstance(n, ast.Yield) for n in ast.walk(node))
        bounds = node.iter.args[:2] if called_name(node.iter) == "range" and sends else []
        limit = whole((bounds or [None])[-1])
        counted = dotted(node.target)
        remainders = (n for n in ast.walk(node) if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Mod))
        if limit is not None and not any(counted in map(dotted, ast.walk(n.left)) for n in remainders):
            yield slip(node.lineno, "reset-limit", "%d" % limit, name="range")
            yield from starts_of_range(node, bounds)
            yield from step_of_call(node.iter, 2, "third")
    for node in all_of(tree, ast.Call, ast.YieldFrom):  # what `next(…)` goes through, again and again
        around = node.args[:1] if called_name(node) == "cycle" else [getattr(node, "value", None)]
        bounds = around[0].args[:2] if around and called_name(around[0]) == "range" else []
        yield from step_of_call(around[0], 2, "third") if bounds else ()
        if bounds and whole(bounds[-1]) is not None:
            yield slip(node.lineno, "reset-limit", "%d" % whole(bounds[-1]), name="range")
        for one in starts_of_range(node, bounds):
            yield slip(node.lineno, "reset-value", one["message"])
            yield one
        if dotted(getattr(node, "func", None)) in ("itertools.count", "count"):
            yield from step_of_call(node, 1, "second")
            for start in (one for one in map(signed, argument(node, 0, "start")) if one is not None):
                yield slip(node.lineno, "start-value", "%d" % start, name="count")


def step_of_call(call, place, nth):
    """Yield by which number `range(0, 128, 2)` or `count(0, 2)` goes on, where that is not 1."""
    for step in argument(call, place, "step"):
        what = "%s value" % nth if step in call.args else "`step`"
        if signed(step) not in (None, 1):
            fix = "write 1 as the %s of `%s(…)`" % (what, dotted(call.func))
            yield slip(step.lineno, "step-number", "%d" % signed(step), fix, dotted(call.func))


def starts_of_range(node, bounds):
    """Yield with which number a range begins, where one is written."""
    if len(bounds) > 1 and whole(bounds[0]) is not None:
        yield slip(node.lineno, "start-value", "%d" % whole(bounds[0]), name="range")


def whole(node):
    """Return a whole number as it is written, without a sign."""
    number = isinstance(node, ast.Constant) and type(node.value) is int and node.value < 1 << 31
    return node.value if number else None


def signed(node):
    """Return a whole number that may have a minus before it."""
    minus = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
    number = whole(node.operand if minus else node)
    return -number if minus and number is not None else number


def is_increment(node, target, value):
    """Whether a name is given what it was before, and something more: `n += 1`, `n = (n + 1) % 128`."""
    if isinstance(node, ast.AugAssign):
        return isinstance(node.op, ast.Add) and isinstance(value, ast.Constant)
    parts = list(ast.walk(value))
    called = {id(one.func): one.func for one in parts if isinstance(one, ast.Call)}
    # `n = int(n)` and `String = String()` add nothing
    names = [one for one in called.values() if isinstance(one, (ast.Attribute, ast.Name))]
    adds = any(isinstance(one, (ast.BinOp, ast.UnaryOp)) for one in parts)
    adds = adds or any(isinstance(one, ast.Name) and not hasattr(builtins, one.id) for one in names)
    adds = adds or any(isinstance(one, ast.Attribute) and dotted(one).startswith("self.") for one in names)
    own = [one for one in parts if isinstance(one, type(target)) and id(one) not in called]
    return adds and any(dotted(one) == dotted(target) for one in own)


def counter_slips(tree):
    """Counters that a loop sets in each of its turns, those that it resets before it adds one, and those that it does
    not count: `n =+ 1`, or the line below the loop.
    """
    yield from uncounted(tree)
    yield from counted_elsewhere(tree)
    yield from begun_in_each_turn(tree)
    yield from given_twice(tree)
    for loop in all_of(tree, *LOOPS):
        body, inside = loop.body, [n for one in loop.body for n in ast.walk(one)]
        sent = [i for i, one in enumerate(body) if calls_in(one, "publish")]
        added = {dotted(t): n for n in inside for t in increments(n)} if sent else {}
        for name, node in added.items():
            yield from reset_the_wrong_way([one for one in body if isinstance(one, ast.If)], name)
            set_at = [i for i, one in enumerate(body) if name in (dotted(t) for t in constants_in([one]))]
            reset_at = [i for i, one in enumerate(body) if isinstance(one, ast.If) and name in reset_in(one)]
            if set_at and loop_around(node, tree) is not loop:
                continue  # it counts the turns of a loop in this one
            if set_at:
                one = body[set_at[0]]
                message = "this sets `%s` again each time around the loop" % name
                fix = "move line %d above the loop on line %d" % (one.lineno, loop.lineno)
                yield slip(one.lineno, "set-in-loop", message, fix, name)
            elif reset_at and node in body:
                first = next((i for i in sent if name in names_in(body[i])), sent[0])
                turn = [(i - first) % len(body) for i in (reset_at[0], body.index(node))]
                if turn[0] < turn[1]:
                    line = body[reset_at[0]].lineno
                    message = "line %d adds one after the counter was reset, so what follows a reset is one too high"
                    fix = "move line %d above the `if` on line %d" % (node.lineno, line)
                    yield slip(line, "reset-early", message % node.lineno, fix, name)


def begun_in_each_turn(tree):
    """`next(numbers())` in a loop, which makes a generator in each turn and asks it for its first value."""
    own = {
        f.name for f in all_of(tree, ast.FunctionDef) if any(isinstance(n, ast.Yield) for n in ast.walk(f))
    }
    for loop in all_of(tree, ast.While):
        for call in (n for n in ast.walk(loop) if called_name(n) == "next" and len(n.args) == 1):
            name = dotted(getattr(call.args[0], "func", None))
            if name in own or name in ("itertools.count", "itertools.cycle"):
                made = "%s(%s)" % (name, "…" if call.args[0].args else "")
                message = "`next(%s)` begins with the first value again each time around the loop" % made
                fix = "above line %d, write `values = %s`; on line %d, write `next(values)`"
                yield slip(call.lineno, "set-in-loop", message, fix % (loop.lineno, made, call.lineno), name)


def given_twice(tree):
    """`n = n = 1` in a loop that publishes, where the second `=` is on the key of the `+`."""
    loops = [one for one in all_of(tree, *LOOPS) if calls_in(one, "publish")]
    for node in (n for n in all_of(tree, ast.Assign) if len(n.targets) == 2 and signed(n.value) is not None):
        name, other = map(dotted, node.targets)
        if name and name == other and loop_around(node, tree) in loops:
            message = "this sets `%s` to %d" % (name, signed(node.value))
            fix = "on line %d, write `%s = %s + %d`" % (node.lineno, name, name, signed(node.value))
            yield slip(node.lineno, "set-in-loop", message, fix, name)


def reset_the_wrong_way(ifs, name):
    """An `if` that resets a counter while it is below its limit: `if not n > 127: n = 0`, `if n < 127: n = 0`."""
    for one in ifs:
        inverted = isinstance(one.test, ast.UnaryOp) and isinstance(one.test.op, ast.Not)
        test = one.test.operand if inverted else one.test
        below = (ast.Gt, ast.GtE) if inverted else (ast.Lt, ast.LtE)
        compares = isinstance(test, ast.Compare) and isinstance(test.ops[0], below)
        limit = whole(test.comparators[0]) if compares and dotted(test.left) == name else None
        given = [n for n in one.body if isinstance(n, ast.Assign) and dotted(n.targets[0]) == name]
        resets_to = [value for value in (whole(n.value) for n in given) if value is not None]
        if limit is not None and resets_to and min(resets_to) < limit:
            message = "the `if` on line %d resets `%s` while it is below %d" % (one.lineno, name, limit)
            fix = "delete the `not` on line %d" if inverted else "on line %d, write `>` in the condition"
            yield slip(one.lineno, "set-in-loop", message, fix % one.lineno, name)


def counter_starts(tree):
    """Where a counter gets its first number, where another one than 1 is added, and where a loop adds to it before it
    publishes: no slips."""
    loops = all_of(tree, *LOOPS)
    later = {id(n) for loop in loops for n in ast.walk(loop) if n is not loop}
    for node in all_of(tree, ast.If):
        resets = reset_in(node)
        later |= {id(one) for one in node.body if any(dotted(t) in resets for t in constants_in([one]))}
    changed = all_of(tree, ast.Assign, ast.AugAssign)
    counted = {dotted(t) for n in changed for t in increments(n)}
    for node in changed:
        given = given_numbers(node, counted) if id(node) not in later else ()
        for name, value in ((n, v) for n, v in given if v is not None and n in counted):
            yield slip(node.lineno, "start-value", "%d" % value, name=name)
        number = added_number(node)
        if number not in (None, 1):
            name = dotted(getattr(node, "target", None) or node.targets[0])
            yield slip(node.lineno, "step-number", "%d" % number, name=name)
    for owner in all_of(tree, ast.ClassDef):  # `value: int = 1` of a dataclass
        for node in constants_in(owner.body):
            own = [name for name in counted if name.rpartition(".")[2] == dotted(node) != name]
            value = next(signed(n.value) for n in owner.body if node in getattr(n, "targets", ()))
            if len(own) == 1 and value is not None:
                yield slip(node.lineno, "start-value", "%d" % value, name=dotted(node))
    for loop in loops:
        yield from added_first(loop.body)
    made = (n for call in calls_in(tree, "publish") for n in ast.walk(call))
    sent = set(map(called_name, made)) - {""}
    for function in (f for f in all_of(tree, ast.FunctionDef) if f.name in sent):
        yield from added_before_return(function)


def counter_types(tree):
    """Counters that do not count as numbers do: a text that is made longer, `"1" + "1"`, and numpy's `int8`, which
    goes on with -128 after 127."""
    texts, bytes_ = {}, {}
    for node in (n for n in all_of(tree, ast.Assign) if len(n.targets) == 1):
        found = texts if is_digits(node.value) else bytes_ if called_name(node.value) == "int8" else {}
        found.setdefault(dotted(node.targets[0]), []).append(node)
    for node in all_of(tree, ast.Assign, ast.AugAssign):
        name = dotted(getattr(node, "target", None) or node.targets[0])
        begun, added = texts.get(name) or bytes_.get(name), added_value(node, name)
        if not begun or added is None:
            continue
        told = "on %s, write `%s = 0`" % (listed([n.lineno for n in begun]), name)
        told += ", and on line %d, write `%%s`" % node.lineno
        if name in texts and (called_name(added) == "str" or is_digits(added)):
            message = "`%s` is a text, which line %d makes longer: '1' and '1' is '11'" % (name, node.lineno)
            fix = told % ("%s = %s + 1" % (name, name))
            yield slip(node.lineno, "counter-type", message, fix, "text")
        elif name in bytes_:
            message = "`%s` is an int8 of numpy, of which 127 and 1 is -128" % name
            fix = told % ("%s = (%s + 1) %% 128" % (name, name))
            yield slip(begun[0].lineno, "counter-type", message, fix, "int8")


def is_digits(node):
    value = getattr(node, "value", None) if isinstance(node, ast.Constant) else None
    return isinstance(value, str) and value.isdigit()


def added_value(node, name):
    """Return what a statement adds to a variable; None where it does not."""
    if isinstance(node, ast.AugAssign):
        return node.value if isinstance(node.op, ast.Add) else None
    value = node.value
    adds = isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add) and dotted(value.left) == name
    return value.right if adds else None


def given_numbers(node, counted):
    """Yield the names that an assignment gives numbers, and the numbers: `n = 1`, `n, last = 1, 127`, or
    `msg = Int8(data=1)` of a counter that is the message's; None in place of another value."""
    for target in node.targets if isinstance(node, ast.Assign) else ():
        names, values = (getattr(part, "elts", [part]) for part in (target, node.value))
        for one, given in zip(names, values) if len(names) == len(values) else ():  # noqa: B905 - Python 3.8
            name = dotted(one)
            if name + ".data" in counted and called_name(given)[:1].isupper():
                made = argument(given, 0, "data")
                yield name + ".data", signed(made[0]) if made else None
            else:
                yield name, signed(given)


def added_before_return(function):
    """Where a function, whose result is published, adds one to a counter, and then returns it."""
    last = function.body[-1]
    name = dotted(last.value) if isinstance(last, ast.Return) else "..."
    for one in function.body[:-1]:
        if name in map(dotted, increments(one)):
            fix = "keep its value in a variable above line %d, and return that one on line %d" % (
                one.lineno,
                last.lineno,
            )
            yield slip(one.lineno, "added-first", "", fix, name)


def added_number(node):
    """Return the number that a statement adds to a variable: `n += 2`, `n = n - 1`, `n = (n + 2) % 128`."""
    if isinstance(node, ast.AugAssign):
        op, number = node.op, signed(node.value)
    else:
        value = node.value
        while isinstance(value, ast.BinOp) and isinstance(value.op, ast.Mod):
            value = value.left
        if not isinstance(value, ast.BinOp) or dotted(value.left) != dotted(node.targets[0]):
            return None
        op, number = value.op, signed(value.right)
    sign = {ast.Add: 1, ast.Sub: -1}.get(type(op))
    return None if sign is None or number is None else sign * number


def added_first(body):
    """Where a loop adds one to a counter above the line that publishes it, or makes a message of it."""
    sent = [i for i, one in enumerate(body) if calls_in(one, "publish")]
    put = [put_in_messages(one) for one in body] if sent else []
    for at, one in enumerate(body):
        nodes = ast.walk(one) if isinstance(one, ast.If) else [one]
        adding = [(dotted(t), node.lineno) for node in nodes for t in increments(node)]
        for name, line in dict(reversed(adding)).items():
            used = [i for i, names in enumerate(put) if i != at and name in names]
            first = (used or sent or [at])[0]
            below = [body[i] for i in sent if i >= first]
            if at < first and below:
                after = body[body.index(below[0]) + 1 :]
                yield slip(line, "added-first", "", added_later(one, name, below[0], after), name)


def added_later(one, name, publishes, after):
    """Return how to publish first, and log, and then add one, or, where an `if` below resets the counter, do that
    instead."""
    lines = lines_from(one.lineno, one.end_lineno)
    reset = next((n for n in after if isinstance(n, ast.If) and name in reset_in(n) and not n.orelse), None)
    to = [signed(n.value) for n in all_of(reset, ast.Assign) if dotted(n.targets[0]) == name] if reset else []
    if len(to) != 1 or to[0] is None or isinstance(one, ast.If):
        calls = itertools.takewhile(lambda n: isinstance(n, ast.Expr), after)
        reads = [n for n in calls if any(dotted(part) == name for part in ast.walk(n))]
        return "move %s below line %d" % (lines, (reads or [publishes])[-1].end_lineno)
    if to[0] < 0:
        return "set `%s` to %d before the loop, as line %d does" % (name, to[0], reset.lineno)
    return "below line %d write `else:`, and move %s into it" % (reset.end_lineno, lines)


def put_in_messages(node):
    """Return the names of which a statement publishes what they stand at, or keeps it elsewhere: `msg.data = n`."""
    found = {name for call in calls_in(node, "publish") for name in names_in(call)}
    if isinstance(node, ast.Assign):
        found |= names_in(node.value) - {dotted(t) for t in node.targets}
    return found


def uncounted(tree):
    for node in walk(tree):
        value = node.value if isinstance(node, ast.Assign) else None
        if isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.UAdd):
            name = dotted(node.targets[0])
            message, fix = "`%s =+ …` sets it, and adds nothing" % name, "write `%s += …`" % name
            yield slip(node.lineno, "no-effect", message, fix, name)
        body = getattr(node, "body", None)
        for at, loop in enumerate(body[:-1] if isinstance(body, list) else ()):
            after = body[at + 1]
            ends = not isinstance(loop, ast.While) or any(isinstance(n, ast.Break) for n in ast.walk(loop))
            sent = [names_in(n) for n in calls_in(loop, "publish")]
            for name in () if ends else (dotted(t) for t in increments(after)):
                if any(name in names for names in sent):
                    message = "`%s` is counted below the loop on line %d" % (name, loop.lineno)
                    message += ", and is not reached while the node runs"
                    last = [after.lineno, *(n.end_lineno for n in body[at + 2 :] if name in names_in(n))][-1]
                    fix = "indent %s like the lines of that loop" % lines_from(after.lineno, last)
                    yield slip(after.lineno, "no-effect", message, fix, name)


def counted_elsewhere(tree):
    """A value that is published and never changes, beside one of its name that the same function counts: `count`, or
    the `Talker.count` of the class, beside `self.count`.
    """
    changed = {dotted(t) for n in walk(tree) for t in changes(n)}
    fixed = {dotted(t) for t in constants_in(walk(tree))}
    for one in all_of(tree, ast.ClassDef):
        fixed |= {"%s.%s" % (one.name, dotted(t)) for t in constants_in(one.body)}
    for function in all_of(tree, ast.FunctionDef):
        sent = [(call, one) for call in calls_in(function, "publish") for one in values_in(call)]
        added = {dotted(t): n for n in ast.walk(function) for t in increments(n)} if sent else {}
        published = {dotted(one) for _, one in sent}
        for call, one in sent:
            name = dotted(one)
            alike = [other for other in added if other.rpartition(".")[2] == name.rpartition(".")[2]]
            if name not in fixed - changed or len(alike) != 1 or alike[0] in published:
                continue
            line, other = added[alike[0]].lineno, alike[0]
            message = "it publishes `%s`, while line %d counts in `%s`" % (name, line, other)
            yield slip(
                call.lineno, "no-effect", message, "on line %d, publish `%s`" % (call.lineno, other), name
            )


def values_in(call):
    """Return the names whose values a call is given, as they are or in a message: `publish(Int8(n))`."""
    given = [*call.args, *(one.value for one in call.keywords)]
    made = [value for one in given if isinstance(one, ast.Call) for value in values_in(one)]
    return [one for one in given if isinstance(one, (ast.Name, ast.Attribute))] + made


def changes(node):
    """Return what a statement gives another value than a number that is written there."""
    if isinstance(node, ast.Assign) and signed(node.value) is None:
        return node.targets
    return [node.target] if isinstance(node, (ast.AugAssign, ast.For)) else []


def increments(node):
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    value = getattr(node, "value", None)
    return [t for t in targets if value is not None and t is not None and is_increment(node, t, value)]


def constants_in(statements):
    assigned = (n for n in statements if isinstance(n, ast.Assign))
    return [
        n.targets[0] for n in assigned if isinstance(n.value, ast.Constant) or signed(n.value) is not None
    ]


def reset_in(node):
    """Return the names that an `if` asks for and gives a fixed value."""
    return {dotted(t) for t in constants_in(node.body)} & names_in(node.test)
