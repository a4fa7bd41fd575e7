"""Finds the counters in a student's Python, and the clocks that it reads, for `slips.py`.

Where a counter begins, counts and goes back, and whether the values that a script publishes come from counting or from
a clock. Nothing is executed. Python 3.8, standard library only.
"""

import ast
import builtins

from script_loops import turns
from script_tree import (
    LOOPS,
    all_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    lines_from,
    loop_around,
    names_in,
    slip,
    text_of,
    walk,
)

CLOCKS = {
    "get_time", "get_rostime", "now", "time", "time_ns", "monotonic", "monotonic_ns", "perf_counter",
    "perf_counter_ns", "process_time", "clock", "clock_gettime", "utcnow", "today", "localtime", "gmtime",
    "ctime", "asctime", "strftime", "times", "stamp", "header", "eval", "exec", "getattr", "__import__",
    "import_module", "system", "popen", "Popen", "run", "check_output", "current_real",
    "current_expected", "last_real", "last_expected", "last_time", "remaining", "wait_for_message",
    "get_param", "get_param_cached", "Subscriber", "Timer", "vars", "globals", "__dict__", "modules",
}  # fmt: skip
"""Names by which a script may come to know the time, or something that it cannot be seen to be."""
PLAIN_MODULES = {
    "__future__", "itertools", "math", "numpy", "os", "random", "roslib", "rospy", "signal", "string",
    "sys", "threading", "time",
}  # fmt: skip


# ---- counters


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
    yield from limits_of_ranges(tree)
    for node in walk(tree):
        value, done, asked, fix = None, (), [], ""
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
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
            value = next((value for value in values if whole(value) is not None), None)
            asked = test if value is not None else []
        for part in asked:
            if whole(part) is not None:
                yield slip(part.lineno, "reset-limit", "%d" % whole(part), fix)
        if value is not None:
            yield slip(value.lineno, "reset-value", "%d" % whole(value))


def limits_of_ranges(tree):
    for node in all_of(tree, ast.For):
        ranged = called_name(node.iter) == "range" and calls_in(node, "publish")
        limit = whole((node.iter.args[:2] or [None])[-1]) if ranged else None
        counted = dotted(node.target)
        remainders = (n for n in ast.walk(node) if isinstance(n, ast.BinOp) and isinstance(n.op, ast.Mod))
        if limit is not None and not any(counted in map(dotted, ast.walk(n.left)) for n in remainders):
            yield slip(node.lineno, "reset-limit", "%d" % limit, name="range")
    for node in all_of(tree, ast.Call, ast.YieldFrom):  # what `next(…)` goes through, again and again
        around = node.args[:1] if called_name(node) == "cycle" else [getattr(node, "value", None)]
        bounds = around[0].args[:2] if around and called_name(around[0]) == "range" else []
        if bounds and whole(bounds[-1]) is not None:
            yield slip(node.lineno, "reset-limit", "%d" % whole(bounds[-1]), name="range")
        if len(bounds) > 1 and whole(bounds[0]) is not None:
            yield slip(node.lineno, "reset-value", "%d" % whole(bounds[0]))
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
    """Where a counter gets its first number, and where a loop adds one before it publishes: no slips."""
    loops = all_of(tree, *LOOPS)
    later = {id(n) for loop in loops for n in ast.walk(loop) if n is not loop}
    for node in all_of(tree, ast.If):
        resets = reset_in(node)
        later |= {id(one) for one in node.body if any(dotted(t) in resets for t in constants_in([one]))}
    changed = all_of(tree, ast.Assign, ast.AugAssign)
    counted = {dotted(t) for n in changed for t in increments(n)}
    for node in changed:
        value = signed(node.value) if isinstance(node, ast.Assign) else None
        if value is not None and id(node) not in later and dotted(node.targets[0]) in counted:
            yield slip(node.lineno, "start-value", "%d" % value, name=dotted(node.targets[0]))
    for loop in loops:
        yield from added_first(loop.body)


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
    """Return how to publish first and then add one, or, where an `if` below resets the counter, do that instead."""
    lines = lines_from(one.lineno, one.end_lineno)
    reset = next((n for n in after if isinstance(n, ast.If) and name in reset_in(n) and not n.orelse), None)
    to = [signed(n.value) for n in all_of(reset, ast.Assign) if dotted(n.targets[0]) == name] if reset else []
    if len(to) != 1 or to[0] is None or isinstance(one, ast.If):
        return "move %s below line %d" % (lines, publishes.end_lineno)
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


# ---- clocks


def counts(tree):
    return any(
        (isinstance(n, (ast.AugAssign, ast.BinOp)) and isinstance(n.op, ast.Add))
        or (isinstance(n, ast.Call) and getattr(n.func, "id", "") in ("next", "range", "count"))
        or is_call(n, "count")
        for n in walk(tree)
    )


def knows_time(tree):
    """Whether a script may read a clock: by name, or in a module that is not the standard one."""
    for node in walk(tree):
        if isinstance(node, ast.Import):
            plain = [alias for alias in node.names if is_plain(alias.name)]
            if len(plain) < len(node.names) or any(one.asname and one.name != "rospy" for one in plain):
                return True
        elif isinstance(node, ast.ImportFrom):
            names = {alias.name for alias in node.names}
            if node.level or not is_plain(node.module or "") or names & (CLOCKS | {"*"}):
                return True
        elif (isinstance(node, ast.Attribute) and node.attr in CLOCKS) or (
            isinstance(node, ast.Name) and node.id in CLOCKS - {"time"}
        ):
            return True
    return False


PLAIN_CALLS = {
    "str", "int", "float", "repr", "round", "format", "next", "count", "iter", "len", "String", "join",
}  # fmt: skip


RANDOM = {
    "random", "randint", "randrange", "uniform", "choice", "gauss", "rand", "randn", "getrandbits", "urandom",
}  # fmt: skip
TOPICS_LIMIT = 5
"""Of so many topics, each that an `if` publishes on is told."""
IFS_LIMIT = CALLS_LIMIT = 20
"""Of a loop, and of a file."""
CLOCK_METHODS = {"to_sec", "to_nsec"}


def sends_no_time(tree):
    """What is published comes from counting alone, though the script may read a clock for something else, or for the
    value that it counts on from."""
    published = calls_in(tree, "publish")
    if not published or not counts(tree):
        return
    source = Source(tree)
    found = source.reached([arg for n in published for arg in n.args])
    if not knows_time(tree):
        message = "the script counts, and reads no clock"
    elif found.clock or found.unknown or not found.counts:
        return
    elif source.reached(source.starts).clock:
        message = "the script reads the clock once, and counts on from there"
    else:
        message = "the script counts, and reads no clock for what it publishes"
    sent = {name for n in published for arg in n.args for name in names_in(arg)}
    made = [
        n for n in all_of(tree, ast.Assign) if sent.intersection(map(dotted, n.targets)) and is_text(n.value)
    ]
    yield slip(min((n.lineno for n in made), default=published[0].lineno), "no-clock", message)


def is_text(node):
    """Return whether an expression makes a text: one with values in it, `str(…)`, or a sum with a text."""
    if isinstance(node, ast.BinOp):
        return is_text(node.left) or (isinstance(node.op, ast.Add) and is_text(node.right))
    return isinstance(node, ast.JoinedStr) or bool(text_of(node)) or called_name(node) in ("str", "format")


def clock_values(tree):
    """Topics whose values are read from a clock in each turn, or made up at random, and not counted."""
    source = Source(tree)
    for node in calls_in(tree, "publish")[:CALLS_LIMIT]:
        found, topic = source.reached(node.args), source.topic(node)
        if topic and not found.counts and found.random:
            yield slip(node.lineno, "clock-value", topic, name="random")
        elif topic and found.clock and not found.counts and not found.unknown:
            yield slip(node.lineno, "clock-value", topic)


def values_left_out(tree):
    """Loops that publish only in some of their turns: an `if` asks for what they count, or they count nothing."""
    source = Source(tree)
    for loop in all_of(tree, *LOOPS):
        deciding = [one for one in loop.body if isinstance(one, ast.If) and calls_in(one, "publish")]
        for one in deciding[:IFS_LIMIT]:
            chain = [n for part in [*one.body, *one.orelse] for n in calls_in(part, "publish")]
            if not chain:  # its condition publishes
                continue
            inside = set(ast.walk(one))
            counted = {dotted(t) for n in ast.walk(loop) if n not in inside for t in increments(n)}
            outside = {ast.dump(n.func) for n in calls_in(loop, "publish") if n not in chain}
            if not (names_in(one.test) & counted if counted else not calls_in(one.test, "is_shutdown")):
                continue
            sent = {}
            for call in chain:
                sent.setdefault(ast.dump(call.func), []).append(call)
            for calls in [sent[func] for func in sent if func not in outside][:TOPICS_LIMIT]:
                if not publishes_always([one], calls[0]) and not waits_for_it(one.test, calls, source):
                    topic = source.topic(calls[0])
                    yield from left_out(one, calls, topic, alone=len(chain) == 1)


def waits_for_it(test, calls, source):
    """Whether a condition asks if anything listens, or if there is anything to publish."""
    values = [value for name in names_in(test) for value in source.bound.get(name, ())[:TOPICS_LIMIT]]
    there = test.left if isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.IsNot) else test
    sent = {name for call in calls for one in call.args for name in names_in(one)}
    return dotted(there) in sent or any(calls_in(one, "get_num_connections") for one in (test, *values))


def left_out(one, calls, topic, *, alone):
    """Yield that an `if` publishes on a topic in some turns; `alone` says whether that is all that it publishes."""
    first, last, asking = min(n.lineno for n in calls), max(n.lineno for n in calls), one.lineno
    if len(calls) > 1:
        message = "lines %d to %d publish only under the conditions of the `if`" % (first, last)
    elif alone:
        message = "line %d publishes only under the condition" % first
    else:
        message = "line %d publishes only under a condition of the `if`" % first
    fix = "publish outside the `if` on line %d, so that it happens each time around the loop" % asking
    if alone:
        fix = "move line %d out of the `if` on line %d, so that it runs each time around the loop"
        fix %= (first, asking)
    yield slip(first, "published-in-part", "%s on line %d" % (message, asking), fix, topic)


def publishes_always(block, call):
    """Return whether a block calls the same `publish(…)` whichever way its `if`s go."""
    for one in block:
        if isinstance(one, ast.If):
            if publishes_always(one.body, call) and publishes_always(one.orelse, call):
                return True
        elif any(ast.dump(n.func) == ast.dump(call.func) for n in calls_in(one, "publish")):
            return True
    return False


TELLS = ("publish", "print")


def published_unchanged(tree):
    """Loops that publish in each turn what a line above them made, and do nothing else with it than to print it."""
    set_at, made = {}, {}
    for n in walk(tree):
        if isinstance(getattr(n, "ctx", None), ast.Store):
            set_at.setdefault(dotted(n).partition(".")[0], []).append(n.lineno)
        if isinstance(n, ast.Assign):
            made.update((dotted(t), n) for t in n.targets)
    plain = {dotted(t) for t in constants_in(walk(tree))}
    for loop in all_of(tree, ast.While):
        inside = [n for one in loop.body for n in ast.walk(one)]
        told = [n for n in inside if called_name(n) in TELLS or called_name(n).startswith("log")]
        told_of = {id(n) for call in told for n in ast.walk(call)}
        names = [n for n in inside if isinstance(n, ast.Name)]
        used = {n.id for n in names if id(n) not in told_of}
        read = {n.id for n in names if id(n) not in told_of and isinstance(n.ctx, ast.Load)}
        read |= {name for n in told if called_name(n) == "publish" for name in names_in(n)}
        fresh = {n.id for n in names if isinstance(n.ctx, ast.Store)} - read
        for call in (n for n in told if called_name(n) == "publish" and len(n.args) == 1):
            name = dotted(call.args[0])
            lines = set_at.get(name, [])
            is_once = name in made and len(lines) == 1 and lines[0] < loop.lineno
            if name in plain or name in used or not is_once:
                continue
            line, moved = lines[0], lines_from(lines[0], made[name].end_lineno)
            fix = "move %s into that loop, above line %d" % (moved, loop.body[0].lineno)
            # another number that the loop works out, such as the time alone, is no text to be published
            alike = [one for one in fresh if one in made and alike_made(made[one].value, made[name].value)]
            if len(fresh) == len(alike) == 1:
                fix = "on line %d, publish `%s`" % (call.lineno, alike[0])
            message = "each pass through the loop on line %d publishes `%s`" % (loop.lineno, name)
            message += ", which only line %d makes, above it" % line
            yield slip(call.lineno, "no-effect", message, fix, name)


def alike_made(one, other):
    """Return whether two values are worked out the same way: by one function, by the same `%`, or both as a text."""
    kinds = [(type(n), type(getattr(n, "op", None)), called_name(n)) for n in (one, other)]
    return kinds[0] == kinds[1]


class Source:
    """Where values come from. `bound` has what names are given; what a counter starts with is in `starts` instead."""

    def __init__(self, tree):
        self.bound, self.starts = {}, []
        self.functions = functions_in(tree)
        places = dict(turns(tree))
        given = []
        for node in walk(tree):
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            value = getattr(node, "iter", None) or getattr(node, "value", None)
            given += [(node, t, value) for t in targets if value is not None and t is not None]
        self.counted = {dotted(t) for n, t, value in given if is_increment(n, t, value)}
        added = {dotted(t): places[n] for n, t, value in given if is_increment(n, t, value)}
        for node, target, value in given:
            function, again = places[node]
            name, begins = dotted(target), not again and isinstance(node, ast.Assign)
            where = added.get(name)
            once = getattr(function, "name", "__init__") == "__init__" or where == (function, True)
            if begins and where and once:
                self.starts.append(value)
            elif begins and called_name(value) == "count":
                self.starts += value.args
                self.bound.setdefault(name, []).append(value.func)
            else:
                part = target
                while part is not None and dotted(part) != "self":
                    self.bound.setdefault(dotted(part), []).append(value)
                    part = getattr(part, "value", None)  # `msg.data = …` is a part of `msg`

    def topic(self, publish):
        """Return the topic of a `pub.publish(…)`, as it is written in the only `Publisher(…)` that `pub` is given."""
        makers = self.bound.get(dotted(publish.func.value), [])
        named = [m.args[0] for m in makers if called_name(m) == "Publisher" and m.args]
        return text_of(named[0]) if len(named) == 1 else ""

    def reached(self, values):
        """Return what the values are made of."""
        found, left, seen = Reached(), list(values), set()
        while left:
            for node in ast.walk(left.pop()):
                name = dotted(node.func if isinstance(node, ast.Call) else node)
                last = called_name(node) or name
                if name.rpartition(".")[2] in CLOCKS and name != "time":
                    found.clock = True
                elif isinstance(node, ast.Call) and last in RANDOM:
                    found.random = True
                elif isinstance(node, ast.Call) and last not in CLOCK_METHODS and not last[:1].isupper():
                    found.unknown = found.unknown or (last not in PLAIN_CALLS and name not in self.functions)
                counting = isinstance(node, ast.Call) and last in ("next", "count", "len", "range")
                found.counts = found.counts or counting or name in self.counted
                if name and name not in seen:
                    seen.add(name)
                    left += self.bound.get(name, [])
                    left += [self.functions[name]] if name in self.functions else []
        return found


class Reached:
    """Whether a clock, chance, something that counts, or a call of unknown doings is among what a value is made of."""

    clock = random = counts = unknown = False


def is_plain(module):
    return module in PLAIN_MODULES or module.endswith((".msg", ".srv", "_msgs"))
