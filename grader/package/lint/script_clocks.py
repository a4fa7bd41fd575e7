"""Finds the clocks that a student's Python reads, for `slips.py`: whether what it publishes comes from counting, from a
clock or by chance, in some turns of a loop only, or without ever changing.

Nothing is executed. Python 3.8, standard library only.
"""

import ast

from script_counters import constants_in, increments, is_increment
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
READINGS = ("get_time", "get_rostime", "now", "time")
"""Calls that read a clock."""
PLAIN_MODULES = {
    "__future__", "itertools", "math", "numpy", "os", "random", "roslib", "rospy", "signal", "string",
    "sys", "threading", "time",
}  # fmt: skip


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


def is_plain(module):
    return module in PLAIN_MODULES or module.endswith((".msg", ".srv", "_msgs"))


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
            by_clock = any(called_name(n) in READINGS for n in ast.walk(one.test))
            asks = by_clock or (
                names_in(one.test) & counted if counted else not calls_in(one.test, "is_shutdown")
            )
            if not asks:
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
    none = isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)
    none = none or (isinstance(test, ast.Compare) and isinstance(test.ops[0], (ast.Eq, ast.Lt, ast.LtE)))
    asks = any(calls_in(one, "get_num_connections") for one in (test, *values))
    return dotted(there) in sent or (asks and not none)


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
            set_at.setdefault(dotted(n).partition(".")[0], []).append(dotted(n))
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
            stored = set_at.get(name, [])
            # of a message that is made above, its fields are what changes
            fields = [one for one in stored if one != name]
            parts = [one for one in fields or stored if one not in plain]
            above = all(one in made and made[one].lineno < loop.lineno for one in stored)
            if not parts or name in used or not above or len(set(stored)) < len(stored):
                continue
            line, last = made[parts[0]].lineno, made[parts[-1]].end_lineno
            moved = lines_from(line, last)
            fix = "move %s into that loop, above line %d" % (moved, loop.body[0].lineno)
            # another number that the loop works out, such as the time alone, is no text to be published
            alike = [one for one in fresh if one in made and alike_made(made[one].value, made[name].value)]
            if len(fresh) == len(alike) == 1:
                fix = "on line %d, publish `%s`" % (call.lineno, alike[0])
            message = "each pass through the loop on line %d publishes `%s`" % (loop.lineno, name)
            message += ", which only line %d makes, above it" % line
            yield slip(call.lineno, "no-effect", message, fix, name)


def times_of_above(tree):
    """Loops that publish, in each turn, a text with a time in it which only a line above them read."""
    changed = {}
    for n in all_of(tree, ast.Assign, ast.AugAssign, ast.For):
        for target in getattr(n, "targets", None) or [n.target]:
            changed.setdefault(dotted(target), []).append(n)
    readings = {name: of[0].value for name, of in changed.items() if len(of) == 1 and reads_clock(of[0])}
    for loop in (n for n in all_of(tree, ast.While) if calls_in(n, "publish")):
        inside = set(ast.walk(loop))
        texts = [
            n for n in inside if isinstance(n, (ast.expr)) and is_text(n) and not isinstance(n, ast.Constant)
        ]
        told = {
            id(n) for call in inside if called_name(call).startswith(("log", "print")) for n in ast.walk(call)
        }
        sent = [n for one in texts if id(one) not in told for n in ast.walk(one)]
        names = [n for n in sent if dotted(n) in readings and readings[dotted(n)].lineno < loop.lineno]
        differences = {id(n) for b in inside if isinstance(b, ast.BinOp) and is_sum(b) for n in ast.walk(b)}
        # a time since then grows, too
        names = [n for n in names if id(n) not in differences and n.lineno >= loop.lineno]
        again = any(called_name(n) in READINGS for n in sent)
        if not names or again:
            continue
        first = min(names, key=lambda n: n.lineno)
        name = dotted(first)
        fresh = [
            one
            for one in readings
            if readings[one] in inside and ast.dump(readings[one]) == ast.dump(readings[name])
        ]
        right = fresh[0] if len(fresh) == 1 else "%s()" % dotted(readings[name].func)
        message = "each pass through the loop on line %d publishes `%s`, which only line %d reads, above it"
        message %= (loop.lineno, name, readings[name].lineno)
        yield slip(
            first.lineno,
            "no-effect",
            message,
            "on line %d, write `%s` in place of `%s`" % (first.lineno, right, name),
            name,
        )


def is_sum(node):
    return isinstance(node.op, (ast.Add, ast.Sub)) and not is_text(node)


def reads_clock(node):
    """Whether a statement gives a name what a clock reads then, and nothing else."""
    value = getattr(node, "value", None) if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
    return (
        isinstance(value, ast.Call)
        and called_name(value) in READINGS
        and not value.args
        and "..." not in dotted(value.func)
    )


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
