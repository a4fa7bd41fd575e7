"""Finds the rates that a student's Python asks for, for `slips.py`: numbers and parameters, of loops and of timers,
and loops that need a number.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re

from script_tree import (
    LOOPS,
    all_of,
    argument,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    loop_around,
    names_in,
    parents_of,
    published_type,
    slip,
    text_of,
)

WAYS_LIMIT = 4
STEPS_LIMIT = 3
"""So many names are followed to a value: `self.rate = rate`, and what the class is called with."""
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


def sleeps_within(tree):
    """`for talker in talkers: talker.say(); rate.sleep()` in a loop, which waits once for each of them."""
    for loop in all_of(tree, ast.While):
        for inner in (n for n in loop.body if isinstance(n, ast.For)):
            last = inner.body[-1]
            is_pause = isinstance(last, ast.Expr) and is_call(last.value, "sleep")
            if (
                is_pause
                and calls_in(loop.test, "is_shutdown")
                and called_name(inner.iter) not in ("range", "linspace")
            ):
                message = (
                    "the sleep() on line %d is in the `for` of line %d, and waits once for each of its turns"
                )
                fix = "indent line %d like line %d" % (last.lineno, inner.lineno)
                yield slip(last.lineno, "sleep-twice", message % (last.lineno, inner.lineno), fix)


def timers_once(tree):
    """`rospy.Timer(period, callback, oneshot=True)`, where its callback publishes."""
    functions = functions_in(tree)
    for call in calls_in(tree, "Timer"):
        once = [k.value for k in call.keywords if k.arg == "oneshot"] or call.args[2:3]
        named = dotted(call.args[1]).rpartition(".")[2] if len(call.args) > 1 else ""
        own = functions.get(named)
        is_once = bool(once) and getattr(once[0], "value", None) is True
        if is_once and own is not None and calls_in(own, "publish"):
            message = "the timer of line %d calls `%s` once, by its `oneshot=True`" % (call.lineno, named)
            yield slip(
                call.lineno, "loop-left", message, "on line %d, leave `oneshot=True` out" % call.lineno, named
            )


def rates_made_once(tree):
    """`rate = rospy.Rate(self.hz)` above the loop that sleeps by it, and a timer, which are made once with what another
    function changes later."""
    changed, every = (
        changed_in_functions(tree),
        [dotted(t) for n in all_of(tree, ast.Assign) for t in n.targets],
    )
    for node in (n for n in all_of(tree, ast.Assign) if is_call(n.value, "Rate", "Timer")):
        name, own, line = dotted(node.targets[0]), function_around(node, tree), node.lineno
        what = [
            one
            for one in changed
            if one in names_in(node.value) and any(f is not own for f, _ in changed[one])
        ]
        again = sum(one == name or one.startswith(name + ".") for one in every) > 1
        if again or len(what) != 1 or loop_around(node, tree) or line != node.end_lineno:
            continue
        slept = [n for n in calls_in(tree, "sleep") if dotted(n.func) == name + ".sleep"]
        used = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)} - {"self", "rospy", what[0]}
        # what is a function's own, another one does not know
        stays = own is not None and bool(used)
        fix = ""
        if is_call(node.value, "Timer") and len(changed[what[0]]) == 1 and not stays:
            places = (changed[what[0]][0][1], name, line)
            fix = "below line %d, write `%s.shutdown()`, and copy line %d to below that" % places
        elif len(slept) == 1 and loop_around(slept[0], tree):
            apart = stays and function_around(slept[0], tree) is not own
            fix = "" if apart else "copy line %d into the loop, to above line %d" % (line, slept[0].lineno)
        if fix:
            message = "`%s` is made once, on line %d, and keeps what `%s` is then" % (name, line, what[0])
            yield slip(line, "keeps-rate", message, fix, name)


def changed_in_functions(tree):
    """Return the names that functions change and others know too, with each function and its statement's line:
    attributes, and those that it declares `global`."""
    found = {}
    for function in (n for n in all_of(tree, ast.FunctionDef) if n.name != "__init__"):
        inside = list(ast.walk(function))
        known = {name for n in inside if isinstance(n, ast.Global) for name in n.names}
        for node in (n for n in inside if isinstance(n, (ast.Assign, ast.AugAssign))):
            for target in getattr(node, "targets", None) or [node.target]:
                if isinstance(target, ast.Attribute) or dotted(target) in known:
                    found.setdefault(dotted(target), []).append((function, node.end_lineno))
    return found


def function_around(node, tree):
    """Return the function that a node is in, None outside of all."""
    while node is not None and not isinstance(node, ast.FunctionDef):
        node = parents_of(tree).get(node)
    return node


OF_RATES = re.compile(r"(?i:(?:^|_)(?:hz|rate|freq|frequency|fps))$|[a-z](?:Hz|Rate|Freq|Frequency)$")
OF_PERIODS = re.compile(
    r"(?i:(?:^|_)(?:dt|period|interval|pause|delay|seconds|secs))$|[a-z](?:Period|Interval|Delay)$"
)
SECONDS_TAKEN = ("Duration", "WallDuration", "sleep")


def rates_for_times(tree):
    """`rospy.Duration(self.hz)`, and `rospy.Rate(period)`, by the name of what each is given: a run shows whether it
    is one."""
    values = {}
    for node in all_of(tree, ast.Assign):
        for target in node.targets:
            values.setdefault(dotted(target), []).append(node.value)
    for node in all_of(tree, ast.Call):
        what = dotted(node.func)
        of_seconds, given = called_name(node) in SECONDS_TAKEN, node.args[0] if len(node.args) == 1 else None
        if given is None or not (of_seconds or what == "rospy.Rate"):
            continue
        name = read_parameter(given) or dotted(given)
        names = OF_RATES if of_seconds else OF_PERIODS
        numbers = [getattr(one, "value", None) for one in values.get(name, ())]
        # `rate = 0.1` is no rate, whatever it is called
        if not names.search(re.split(r"[.~/]", name)[-1]) or any(
            type(n) in (int, float) and (n < 1) is of_seconds for n in numbers
        ):
            continue
        given, taken = ("a rate in Hz", "seconds") if of_seconds else ("a time in seconds", "a rate in Hz")
        inside = dotted(node.args[0])
        right = "`%s(1.0 / %s)`" % (what, inside if "..." not in inside else "…")
        message = "`%s(…)` takes %s, and gets %s, `%s`" % (what, taken, given, name)
        yield slip(node.lineno, "rate-as-time", message, "on line %d, write %s" % (node.lineno, right))


def sleeps_of_turns(tree):
    """Yield each `sleep(…)` that a function does whenever a loop calls it."""
    functions = functions_in(tree)
    called = {called_name(n) for loop in all_of(tree, ast.While) for n in all_of(loop, ast.Call)}
    for own in (functions[name] for name in called if name in functions):
        yield from (n.value for n in own.body if isinstance(n, ast.Expr) and is_call(n.value, "sleep"))


def loop_rates(tree):
    """Rates of loops and timers: a parameter that is read there, its name as written; or a number, in Hz as text.

    Either may have been given to a name once.
    """
    bound = values_given(tree)
    looped = {id(one) for loop in all_of(tree, *LOOPS) for one in calls_in(loop, "sleep")}
    looped |= {id(one) for one in sleeps_of_turns(tree)}

    def given(node):
        for _ in range(STEPS_LIMIT):
            values = bound.get(ast.dump(node), ())
            # Which of several values counts, only a run can tell.
            if len(values) != 1:
                break
            node = values[0]
        return node

    yield from vanished_pauses(tree, given) if looped else ()
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
        if timed != "Rate" and loses_all(value, given):
            message = "`%s` gets 0 seconds, since only the whole part of a fraction is left" % dotted(
                node.func
            )
            fix = "on line %d, write the time as a fraction of a second, such as `0.1`" % value.lineno
            kind, name = ("sleep-outside", "sleep") if timed == "sleep" else ("wrong-value", "zero")
            yield slip(node.lineno, kind, message, fix, name)
        for one in ways(value)[:WAYS_LIMIT]:
            yield from loop_rate(node, timed, one, whole or constant(one, given), pause)


def values_given(tree):
    """Return the values that each name is given, by assignments and as an argument of a function that is called once:
    its own, or the default. A name is in the form in which `ast.dump` writes it where it is read."""
    bound, calls = {}, {}
    for node in all_of(tree, ast.Assign):
        if len(node.targets) == 1:
            bound.setdefault(ast.dump(node.targets[0]).replace("Store()", "Load()"), []).append(node.value)
    for node in all_of(tree, ast.Call):
        calls.setdefault(dotted(node.func).rpartition(".")[2], []).append(node)
    own = [(name, one) for name, one in functions_in(tree).items() if name != "__init__"]
    classes = all_of(tree, ast.ClassDef)
    own += [(n.name, one) for n in classes for one in n.body if getattr(one, "name", "") == "__init__"]
    for name, function in own:
        called = calls.get(name, [])
        # of a class of the script: `rospy.Publisher(…)` makes another one
        called = (
            [n for n in called if isinstance(n.func, ast.Name)] if function.name == "__init__" else called
        )
        taken = [one for one in function.args.args if one.arg != "self"]
        first_default = len(taken) - len(function.args.defaults)
        for place, one in enumerate(taken if len(called) == 1 else ()):
            given = argument(called[0], place, one.arg)
            if not given and place >= first_default:
                given = [function.args.defaults[place - first_default]]
            if given and dotted(given[0]) != one.arg:
                bound.setdefault(ast.dump(ast.Name(id=one.arg, ctx=ast.Load())), []).append(given[0])
    for read, value in [*of_classes(classes), *options_read(tree)]:
        bound.setdefault(ast.dump(read), []).append(value)
    return bound


def of_classes(classes):
    """Yield what a class itself gives a value, as its methods read it, with that value."""
    for owner in classes:
        for node in owner.body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                for name in ("self", "cls", owner.name):
                    yield (
                        ast.Attribute(ast.Name(name, ast.Load()), node.targets[0].id, ast.Load()),
                        node.value,
                    )


def options_read(tree):
    """Yield where an option of `argparse` is read, `options.rate`, with the default of its `add_argument(…)`."""
    defaults = {}
    for call in calls_in(tree, "add_argument"):
        given = (
            argument(call, 99, "dest") or [n for n in call.args if text_of(n).startswith("--")] or call.args
        )
        name = text_of(given[0]).lstrip("-").replace("-", "_") if given else ""
        defaults.setdefault(name, []).extend(argument(call, 99, "default"))
    seen = set()
    for node in all_of(tree, ast.Attribute) if defaults else ():
        values = defaults.get(node.attr, ())
        name = dotted(node)
        if len(values) == 1 and isinstance(node.value, ast.Name) and name not in seen:
            seen.add(name)
            yield node, values[0]


def ways(node):
    """Return the values of `a if … else b`, or the only one of another expression."""
    return [*ways(node.body), *ways(node.orelse)] if isinstance(node, ast.IfExp) else [node]


def vanished_pauses(tree, given):
    """Names of durations of which nothing is left."""
    for node in all_of(tree, ast.Assign):  # `period = rospy.Duration(1 // HZ)`
        call = node.value if is_call(node.value, "Duration") and len(node.value.args) == 1 else None
        if call is not None and loses_all(given(call.args[0]), given):
            message = "`%s` is 0 seconds, since only the whole part of a fraction is left" % dotted(
                node.targets[0]
            )
            fix = "on line %d, write `/` in place of `//`, or the time as `0.1`" % node.lineno
            yield slip(node.lineno, "sleep-outside", message, fix, "sleep")
        elif OF_PERIODS.search(dotted(node.targets[0])) and loses_all(
            node.value, given
        ):  # `PERIOD = 1 // 10`
            message = "`%s` is 0 on line %d, since `//` leaves only the whole part"
            message %= (dotted(node.targets[0]), node.lineno)
            fix = "on line %d, write `/` in place of `//`" % node.lineno
            yield slip(node.lineno, "sleep-outside", message, fix, "sleep")


def loop_rate(call, timed, value, number, pause):
    """Yield the rate that a `Rate(…)`, `sleep(…)` or `Timer(…)` asks for: of the last two, `number` is in seconds, and
    `pause` is what takes it."""
    name = read_parameter(value) if timed == "Rate" else None
    if name:
        yield slip(value.lineno, "rate-parameter", name)
    elif drawn(value):
        yield slip(call.lineno, "rate-random", drawn(value), "", pause)
    elif number:
        hz = "%.12g" % (number if timed == "Rate" else 1.0 / number)
        fix = ""
        if is_call(value, "Duration"):
            pause, fix = dotted(value.func), "its second number counts nanoseconds, so it is %.9g s" % number
        yield slip(call.lineno, "rate-number", hz, fix, pause)


def drawn(node):
    """Return the call that draws a value at random, alone or in a sum: `random.randint`, or numpy's; "" of no such."""
    names = [dotted(one.func) for one in ast.walk(node) if isinstance(one, ast.Call)]
    return next((n for n in names if "random" in n.split(".") or n.rpartition(".")[2] in DRAWN), "")


DRAWN = ("randint", "uniform", "randrange")


def nanoseconds_apart(call):
    """Return how many seconds `Duration(0, 100)` is, of whole seconds and of nanoseconds; None of any other call."""
    parts = [getattr(one, "value", None) for one in call.args]
    # `type`, as True is an int as well; ROS keeps each of the two in 32 bits.
    if len(parts) != 2 or not all(type(one) is int and 0 <= one < 1 << 31 for one in parts) or not parts[1]:
        return None
    return parts[0] + parts[1] * 1e-9


ENVIRONMENT = ("os.environ.get", "environ.get", "os.getenv", "getenv")
NUMBER = re.compile(r"[0-9]{1,9}(\.[0-9]{0,9})?$", re.ASCII)


def constant(node, given, depth=4):
    """Return the positive number that an expression of numbers comes to, None where it is something else. Of a variable
    of the environment, its default."""
    node = given(node)
    whole = node
    if isinstance(node, ast.Call) and dotted(node.func) in ("int", "float") and len(node.args) == 1:
        node = given(node.args[0])
    if dotted(getattr(node, "func", None)) in ENVIRONMENT and len(node.args) == 2:
        node = given(node.args[1])
    if node is not whole and NUMBER.match(text_of(node)):
        node = ast.Constant(float(text_of(node)))
    if isinstance(node, ast.Constant) and type(node.value) in (int, float) and 0 < node.value < 1e9:
        return float(node.value)
    if depth and isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Div, ast.Mult)):
        left, right = constant(node.left, given, depth - 1), constant(node.right, given, depth - 1)
        if left and right:
            return left / right if isinstance(node.op, ast.Div) else left * right
    return None


def loses_all(node, given):
    """Return whether a value is a fraction of which 0 is left: `1 // 10`, `int(0.1)`."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
        left, right = constant(node.left, given), constant(node.right, given)
        return bool(left and right and left < right)
    whole = isinstance(node, ast.Call) and dotted(node.func) == "int" and len(node.args) == 1
    part = constant(node.args[0], given) if whole else None
    return part is not None and part < 1


def read_parameter(node):
    """Return the name in `get_param('name')`, also within `float(…)`."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
        node = node.args[0] if node.func.id in ("float", "int") else node
    return text_of(node.args[0]) if is_call(node, "get_param") and node.args else ""


def loops_of_numbers(tree):
    """Loops outside the callbacks that compute with what a topic's callback keeps of its message, or publish it as a
    number: neither is possible with a text."""
    functions = functions_in(tree)
    given = [one for call in calls_in(tree, "Subscriber") for one in argument(call, 2, "callback")]
    called = [functions[name] for name in {dotted(n).rpartition(".")[2] for n in given} if name in functions]
    inside = {n for function in called for n in ast.walk(function)}
    kept = {arg.arg + ".data" for function in called for arg in function.args.args if arg.arg != "self"}
    assigned = all_of(tree, ast.Assign)
    for _ in range(KEPT_STEPS):
        kept |= {dotted(t) for n in assigned if names_in(n.value) & kept for t in n.targets}
    types = {dotted(n.targets[0]): published_type(n.value) for n in assigned if is_call(n.value, "Publisher")}
    for loop in (n for n in all_of(tree, ast.While) if n not in inside):
        of_number = (n for n in ast.walk(loop) if needs_number(n, kept, types))
        for node in sorted(of_number, key=lambda n: n.lineno)[:1]:
            lines = (loop.lineno, loop.end_lineno)
            fix = "write `rospy.spin()` in place of the loop on lines %d to %d" % lines
            inside.update(ast.walk(loop))
            yield slip(loop.lineno, "takes-number", "line %d needs a number" % node.lineno, fix)


KEPT_STEPS = 3
NUMERIC = ("int", "float", "abs", "round", "range")


def needs_number(node, kept, types):
    """Return whether an expression raises an error if one of the names has a text."""
    used = []
    if isinstance(node, ast.BinOp):
        used = [node.left] if isinstance(node.op, ast.Mod) else [node.left, node.right]
        joins = {ast.Add: (int, float), ast.Mult: float}.get(type(node.op))
        used = used if joins is None or has_number(used, joins) else []
    elif isinstance(node, ast.UnaryOp) and not isinstance(node.op, ast.Not):
        used = [node.operand]
    elif isinstance(node, ast.Compare) and isinstance(node.ops[0], (ast.Lt, ast.LtE, ast.Gt, ast.GtE)):
        used = [node.left, *node.comparators]
        used = used if has_number(used, (int, float)) else []
    elif is_call(node, "publish"):
        used = node.args if types.get(dotted(node.func.value), "String") != "String" else []
    elif isinstance(node, ast.Call):
        used = node.args if called_name(node) in NUMERIC or dotted(node.func).startswith("math.") else []
    return any(dotted(one) in kept for one in used)


def has_number(nodes, kinds):
    return any(isinstance(getattr(node, "value", None), kinds) for node in nodes)


def turns_taken_off(tree):
    """`angle -= 3 * math.pi` where an angle is brought between -pi and pi, which takes a whole turn."""
    for node in all_of(tree, ast.While, ast.If):
        bounds = [node.test.left, *node.test.comparators] if isinstance(node.test, ast.Compare) else []
        least = max(map(abs, filter(None, map(halves_of_turn, bounds))), default=0)
        for one in node.body if least in (1, 2) and len(bounds) == 2 else ():
            steps = halves_of_turn(one.value) if isinstance(one, ast.AugAssign) else None
            # half a turn may be meant, of a line that has no direction
            if not steps or steps % 2 == 0 or abs(steps) == 1 or not isinstance(one.op, (ast.Add, ast.Sub)):
                continue
            name, sign = dotted(one.target), "-" if isinstance(one.op, ast.Sub) else "+"
            if name in map(dotted, bounds):
                pi = next(
                    word for word in map(dotted, ast.walk(one.value)) if word.rpartition(".")[2] == "pi"
                )
                message = "a whole turn is `2 * %s`: with another angle, it points to another side" % pi
                fix = "on line %d, write `%s %s= 2 * %s`" % (one.lineno, name, sign, pi)
                yield slip(one.lineno, "wrong-value", message, fix, "angle")


def halves_of_turn(node):
    """Return how many times pi an expression is: 3 of `3 * math.pi`; None of any other."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = halves_of_turn(node.operand)
        return None if inner is None else -inner
    if dotted(node).rpartition(".")[2] == "pi":
        return 1
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        sides = (node.left, node.right)
        number = next((n.value for n in sides if isinstance(getattr(n, "value", None), (int, float))), None)
        return number if number is not None and any(halves_of_turn(n) == 1 for n in sides) else None
    return None
