"""Finds values that go wrong in a student's Python, for `slips.py`: comparisons that no value or every value fulfils,
answers that are not returned, flags of loops, and what each turn of a loop adds, keeps or sets again.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re
from collections import Counter

from script_names import (
    USES_LIMIT,
    bound_names,
    set_in,
    walk_own,
)
from script_tree import (
    LOOPS,
    all_of,
    argument,
    callback_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    is_call,
    is_call_alone,
    names_in,
    parents_of,
    slip,
    text_of,
    walk,
)

IN_DEGREES = ("degrees", "rad2deg")
OF_ANGLES = ("sin", "cos", "tan")
TO_RADIANS = ("radians", "deg2rad")


def wrong_values(tree):
    """Comparisons with NaN, angles in degrees of which a sine is taken, answers of services that are dropped."""
    made = [n for n in all_of(tree, ast.Assign) if called_name(n.value) in IN_DEGREES]
    degrees = {dotted(target) for n in made for target in n.targets}
    own = {dotted(n.targets[0]) for n in all_of(tree, ast.Assign) if getattr(n.value, "attr", "") != "theta"}
    of_poses = any(a.name in ("Pose", "Pose2D") for n in all_of(tree, ast.ImportFrom) for a in n.names)
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
            if angle in own or not (of_poses or "pose" in angle.lower()):
                continue  # a name of the script's own, which may be in degrees
            fix = "on line %d, write `%s` alone, without `%s(…)`" % (line, angle, called_name(node))
            yield slip(line, "wrong-value", "`%s` is already in radians" % angle, fix, "added")
        elif isinstance(node, ast.Expr) and is_class_of_answers(called_name(node.value)):
            name = called_name(node.value)
            message, fix = "the `%s` that is made is not returned" % name, "write `return %s(…)`" % name
            yield slip(line, "wrong-value", message, fix, "return")
        elif isinstance(node, ast.FunctionDef) and unfilled_answer(node):
            variable, name, line = unfilled_answer(node)
            message = "no field of the `%s` that is returned is ever set" % name
            fix = "set it above the `return`: `%s.<field> = …`" % variable
            yield slip(line, "wrong-value", message, fix, "empty")


def is_class_of_answers(name):
    return name[:1].isupper() and name.endswith("Response")


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
        sets = any(calls_in(n, "set_param") for n in unset)
        if (
            name
            and not sets
            and reads[0]
            and not reads[1]
            and all(len(c.args) == 1 and not c.keywords for c in reads[0])
        ):
            message = "this reads the parameter %s only where it is not set" % name
            right = "without its `not`" if is_not else "with a `not`"
            fix = "on line %d, write the condition %s" % (node.lineno, right)
            yield slip(node.lineno, "wrong-value", message, fix, "unset")


def defaults_first(tree):
    """`rospy.get_param('white', '~color')`, which has the default in place of the name and the name in its place."""
    for node in walk(tree):
        first, second = node.args if is_call(node, "get_param") and len(node.args) == 2 else (None, None)
        is_name = re.fullmatch(r"~[a-z]\w*", text_of(second), re.ASCII)
        if is_name and isinstance(first, ast.Constant) and not str(first.value).startswith(("~", "/")):
            message = "the default stands before the parameter's name"
            fix = "on line %d, write `get_param('%s', %r)`" % (node.lineno, text_of(second), first.value)
            yield slip(node.lineno, "wrong-value", message, fix, "unset")


CLOCKS = ("now", "get_time", "time", "get_rostime", "to_sec", "toSec")


def function_around(node, tree):
    """Return the name of the function that a node is in, "" outside all of them."""
    while node is not tree and not isinstance(node, ast.FunctionDef):
        node = parents_of(tree)[node]
    return getattr(node, "name", "")


def assigned_late(tree):
    """Names that a function reads above the line that first gives them a value, and that nothing outside of it has."""
    outside = bound_names(tree) | {n for one in all_of(tree, ast.Global, ast.Nonlocal) for n in one.names}
    for function in all_of(tree, ast.FunctionDef):
        taken = {one.arg for one in ast.walk(function.args) if isinstance(one, ast.arg)} | outside
        inside = list(walk_own(function))
        stored = {}
        for n in inside:
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store):
                stored[n.id] = min(n.lineno, stored.get(n.id, n.lineno))
        for block in [function.body, *(n.body for n in inside if isinstance(n, LOOPS))]:
            yield from assigned_late_in(block, {name: stored[name] for name in stored if name not in taken})


def assigned_late_in(block, stored):
    """Names that a block reads above its line that gives them their first value. `stored` are the lines of these."""
    given = {one.lineno: one for one in block if isinstance(one, ast.Assign)}
    late = {name: line for name, line in stored.items() if line in given}
    for statement in block if late else ():
        for n in walk_own(ast.Module([statement], [])):
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load) and late.get(n.id, 0) > n.lineno:
                line = late[n.id]
                message = "line %d, which gives `%s` its value, comes after it" % (line, n.id)
                fix = "move line %d above line %d" % (line, statement.lineno)
                yield slip(n.lineno, "undefined", message, fix, n.id)


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
        # of plain names, as in `text = 'near'`, each turn may publish its own
        choices = [one for one in loop.body if isinstance(one, ast.If) and one.orelse and sets_fields(one)]
        seen = {n.id for n in ast.walk(loop.target) if isinstance(n, ast.Name)}
        if not published or not choices or acts(ast.Module(loop.body, []), "publish"):
            continue
        is_of_scan = any("ranges" in (getattr(n, "attr", ""), getattr(n, "id", "")) for n in ast.walk(loop))
        about = [one for one in choices if is_of_scan and seen & names_in(one.test)]
        if about and len(published) == 1:
            line = published[0].lineno
            message = (
                "the loop on line %d publishes once for each range, and the last one decides" % loop.lineno
            )
            fix = "work out the smallest of the ranges first, and write the `if` of line %d and the `publish(…)` of "
            fix += "line %d below the loop, for that one"
            yield slip(line, "wrong-value", message, fix % (about[0].lineno, line), "added")


def sets_fields(node):
    return any(isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store) for n in ast.walk(node))


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
            if isinstance(n, ast.Assign) and is_fixed(getattr(n.value, "operand", n.value))
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
        plain = getattr(value, "operand", value)
        usual = sign + (repr(plain.value) if isinstance(plain, ast.Constant) else plain.id)
        message = "each turn of this loop sets `%s`, so that only the last one counts" % names[0]
        fix = "set `%s` to %s above the loop on line %d, and not in the `%s`"
        fix %= (names[0], usual, loop.lineno, "else" if near else "if")
        yield slip(choice.lineno, "wrong-value", message, fix, "added")


def is_fixed(node):
    """Whether it is a number, a text or the like, or a name in capitals, as a constant has."""
    return isinstance(node, ast.Constant) or (isinstance(node, ast.Name) and node.id.isupper())


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


def flagged_loops(tree):
    """Loops that ask for a flag which has the wrong value from the start: `while not self.stopped`, and it is given
    nothing but True."""
    given = {}
    # `Flags(running=True)` gives a value, too
    for one in all_of(tree, ast.Name, ast.Attribute, ast.arg, ast.keyword):
        if not isinstance(getattr(one, "ctx", ast.Store()), ast.Load):
            name = getattr(one, "arg", None) or dotted(one).rpartition(".")[2]
            given.setdefault(name, []).append(id(one))
    values = {
        id(n.targets[0]): n.value for n in all_of(tree, ast.Assign) if isinstance(n.value, ast.Constant)
    }
    classes = all_of(tree, ast.ClassDef)
    own = {"object", *(one.name for one in classes)}
    # a class of elsewhere may set what its own has
    flags = (
        ast.Name
        if {dotted(base) for one in classes for base in one.bases} - own
        else (ast.Name, ast.Attribute)
    )
    for loop in all_of(tree, ast.While):
        negated = isinstance(loop.test, ast.UnaryOp) and isinstance(loop.test.op, ast.Not)
        flag = loop.test.operand if negated else loop.test
        name = dotted(flag).rpartition(".")[2] if isinstance(flag, flags) else ""
        found = [values.get(one) for one in given.get(name, ())]
        if found and all(one is not None and one.value is negated for one in found):
            message = "the loop on line %d never runs: `%s` is %s from line %d on"
            message %= (loop.lineno, dotted(flag), negated, found[0].lineno)
            fix = "write %s on line %d" % (not negated, found[0].lineno)
            yield slip(loop.lineno, "never-begun", message, fix, dotted(flag))


def kept_velocities(tree):
    """Yield each `if` of which not all branches set a speed of a Twist that is kept from turn to turn, or from call to
    call, and is published below it."""
    made = {}
    for n in all_of(tree, ast.Assign):
        if called_name(n.value) == "Twist":
            made.setdefault(dotted(n.targets[0]), {})[n] = function_around(n, tree)
    every = Counter(dotted(n) for n in stored_in([tree]))
    for block in all_of(tree, ast.FunctionDef, ast.While)[:USES_LIMIT]:
        inside = set(ast.walk(block))
        here, given = {"", "__init__", function_around(block, tree)}, set_in(block)
        # what another function makes, a call of it may make again
        kept = [
            n
            for n, of in made.items()
            if inside.isdisjoint(of) and here.issuperset(of.values()) and n not in given
        ]
        choices = (
            [n for n in block.body if isinstance(n, ast.If) and not sets_what_it_asks(n)] if kept else []
        )
        for choice in choices[:USES_LIMIT]:
            below = [n for one in block.body if one.lineno > choice.lineno for n in calls_in(one, "publish")]
            sent = {dotted(n.args[0]) for n in below if n.args}
            stored, zeros = Counter(dotted(n) for n in stored_in([choice])), zeros_in(choice)
            sides = [{dotted(n) for n in stored_in(one)} for one in branches_of(choice)]
            fields = [one for name in kept if name in sent for one in moving(choice, name)]
            # where a branch gives it 0, the others may mean to keep it
            for field in dict.fromkeys(one for one in fields if one not in zeros):
                if every[field] == stored[field] and any(field not in one for one in sides):
                    line, (name, part, axis) = choice.lineno, field.rsplit(".", 2)
                    message = "`%s` keeps its last %s.%s where the `if` on line %d does not set it"
                    fix = "above line %d, write `%s = 0`" % (line, field)
                    yield slip(line, "wrong-value", message % (name, part, axis, line), fix, "kept")


def sets_what_it_asks(choice):
    """Tell whether an `if` gives a new value to what it asks for, as one does that is true now and then: what it sets
    lasts until the next time."""
    asked = {dotted(n) for n in ast.walk(choice.test) if isinstance(n, (ast.Name, ast.Attribute))}
    return not asked.isdisjoint([*set_in(choice), *(dotted(n) for n in stored_in([choice]))])


def branches_of(choice):
    """Return the blocks of an `if` with its `elif`s and its `else`, an empty one where it has none."""
    last = choice.orelse[0] if len(choice.orelse) == 1 else None
    return [choice.body, *(branches_of(last) if isinstance(last, ast.If) else [choice.orelse])]


def stored_in(block):
    """Return the attributes that a block of statements gives a value."""
    every = [n for one in block for n in ast.walk(one) if isinstance(n, ast.Attribute)]
    return [n for n in every if isinstance(n.ctx, ast.Store)]


def moving(choice, name):
    """Return the fields of a Twist that an `if` gives another value than 0."""
    given = [n for n in ast.walk(choice) if isinstance(n, ast.Assign) and getattr(n.value, "value", 1) != 0]
    fields = [target for n in given for target in n.targets]
    return [one for one in map(dotted, fields) if one.startswith((name + ".linear.", name + ".angular."))]


def zeros_in(choice):
    """Return what an `if` gives the value 0."""
    given = [n for n in ast.walk(choice) if isinstance(n, ast.Assign) and getattr(n.value, "value", 1) == 0]
    return {dotted(target) for n in given for target in n.targets}


def values_never_set_back(tree):
    """Yield each `if` that gives a name, or a speed of a Twist that is kept, a fixed value which nothing takes back:
    `stopped = True`, where all other lines that set `stopped` run once, at the beginning."""
    given = {}
    for node in all_of(tree, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.For):
        for target in getattr(node, "targets", None) or [node.target]:
            given.setdefault(dotted(target), []).append(node)
    shared = {name for n in all_of(tree, ast.Global) for name in n.names}
    tests = [n.test for n in all_of(tree, ast.If, ast.While, ast.IfExp)][: 10 * USES_LIMIT]
    asked = {name for test in tests for name in names_in(test)}
    sent = {dotted(n.args[0]) for n in calls_in(tree, "publish") if n.args}
    made = {one for one in sent - {"..."} if len(given.get(one, ())) == 1}
    for name, nodes in given.items():
        is_speed = name.count(".") > 1 and name.rsplit(".", 2)[0] in made
        if 1 < len(nodes) < USES_LIMIT and (is_speed or (name in asked and is_kept(name, nodes, shared))):
            yield from never_back(name, nodes, tree, is_speed)


def is_kept(name, nodes, shared):
    """Whether a name keeps its value from call to call, and is given nothing but True and False."""
    fixed = all(getattr(getattr(n, "value", None), "value", None) in (True, False) for n in nodes)
    return fixed and (name.startswith("self.") or name in shared)


def never_back(name, nodes, tree, is_speed):
    """Yield the one `if` in which a name gets another value than at the beginning."""
    at_first, later = [], []
    for node in nodes:
        choice = choice_around(node, tree)
        is_first = choice is None and function_around(node, tree) in ("", "__init__", "main")
        if is_first and not in_loop(node, tree):
            at_first.append(node.value)
        elif choice is not None and isinstance(node, ast.Assign):
            later.append((choice, node))
        else:
            return
    values = {repr(getattr(node.value, "value", node)) for _, node in later}
    if len(at_first) != 1 or len({choice for choice, _ in later}) != 1 or len(values) != 1:
        return
    (choice, node), before = later[0], at_first[0]
    value, back = getattr(node.value, "value", None), dotted(before)
    if isinstance(before, ast.Constant):
        back = repr(before.value)
    is_other = value in ((0,) if is_speed else (True, False)) and back not in (repr(value), "0", "0.0")
    # `if not started: started = True` is to happen once
    if is_other and "..." not in back and name not in names_in(choice.test):
        message = "`%s` is %r from line %d on, and no line sets it back" % (name, value, node.lineno)
        fix = "set `%s` back to %s %s" % (name, back, where_it_is_over(choice, node))
        yield slip(node.lineno, "wrong-value", message, fix, "stuck")


def where_it_is_over(choice, node):
    """Return in words where to take back what a statement does in an `if`."""
    if node in choice.body and len(choice.orelse) <= 1:
        return "in an `else` of the `if` on line %d" % choice.lineno
    return "in the `else` of line %d" % choice.lineno if node in choice.body else "where that is over"


def choice_around(node, tree):
    """Return the `if` around a statement, but not that of `__name__`; None where it stands in none."""
    parents = parents_of(tree)
    while node is not tree and not isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        node = parents[node]
        if isinstance(node, ast.If) and "__name__" not in names_in(node.test):
            return node
    return None


def in_loop(node, tree):
    parents = parents_of(tree)
    while node is not tree and not isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        node = parents[node]
        if isinstance(node, (ast.While, ast.For)):
            return True
    return False


def emptied_files(tree):
    """A topic's callback that opens its file with 'w' for each row that it writes."""
    functions = functions_in(tree)
    callbacks = {id(one): one for one in (callback_of(n, functions) for n in all_of(tree, ast.Call)) if one}
    held = held_open(tree) if callbacks else {}
    for function in callbacks.values():
        inside = list(ast.walk(function))
        calls = [n for n in inside if isinstance(n, ast.Call)]
        modes = [(n, argument(n, 1, "mode")) for n in calls if called_name(n) == "open"]
        opens = [n for n, mode in modes if mode and text_of(mode[0]).startswith("w")]
        rows = [n for n in calls if called_name(n) in ("write", "writerow", "print")]
        # who writes all rows again each time may empty the file first
        whole = {called_name(n) for n in calls} & {
            "writerows",
            "dump",
            "writelines",
            "join",
            "savetxt",
            "to_csv",
        }
        if opens and rows and not whole and not any(isinstance(n, (ast.For, ast.While)) for n in inside):
            message = (
                "each call of `%s` opens the file with 'w', which deletes what was in it" % function.name
            )
            fix = "on line %d, write 'a' in place of 'w'" % opens[0].lineno
            name = ast.dump(opens[0].args[0]) if opens[0].args else ""
            kept = [n for n in held.get(name, ()) if n not in calls]
            if kept:  # what it holds back is written over the rows at the end
                fix += ", and let `flush()` of the file that line %d opens follow what is written to it"
                fix %= kept[0].lineno
            yield slip(opens[0].lineno, "wrong-value", message, fix, "emptied")


def held_open(tree):
    """Return the calls that open a file to write, which is open while the node spins and which nothing flushes, by the
    name of the file."""
    held, parents = {}, parents_of(tree)
    is_flushed, is_closed = calls_in(tree, "flush"), calls_in(tree, "close")
    opens = [n for n in all_of(tree, ast.Call) if called_name(n) == "open" and n.args]
    for node in opens[:USES_LIMIT] if not is_flushed else ():
        mode, around = argument(node, 1, "mode"), parents[node]
        block = parents[around] if isinstance(around, ast.withitem) else None
        spins = calls_in(block, "spin", "sleep") if block is not None else not is_closed
        if mode and text_of(mode[0]).startswith("w") and spins:
            held.setdefault(ast.dump(node.args[0]), []).append(node)
    return held


def in_callback(tree):
    """Return where a script that waits for messages, or for a timer, does its work."""
    calls = calls_in(tree, "Subscriber", "Timer")
    given = [one for n in calls for one in argument(n, 1 if called_name(n) == "Timer" else 2, "callback")]
    own = {functions_in(tree).get(dotted(one).rpartition(".")[2]) for one in given}
    one = own.pop() if len(own) == 1 else None
    return " in the callback" + (" `%s`, line %d" % (one.name, one.lineno) if one else "")


def letters_of_keys(tree):
    """`for key in section:` goes through the letters of `section`, where that is a key itself: `d[section][key]`."""
    for outer in all_of(tree, ast.For):
        key, whole = dotted(outer.target), dotted(outer.iter)
        for inner in [n for n in all_of(outer, ast.For) if dotted(n.iter) == key and "..." not in whole]:
            for read in all_of(inner, ast.Subscript):
                part, own = read.value, dotted(inner.target)
                is_under = isinstance(part, ast.Subscript) and dotted(part.value) == whole
                if is_under and names_in(part.slice) == {key} and names_in(read.slice) == {own}:
                    message = "`for %s in %s` on line %d goes through the letters of the key `%s`"
                    message %= (own, key, inner.lineno, key)
                    fix = "on line %d, write `for %s in %s[%s]:`" % (
                        inner.lineno,
                        dotted(inner.target),
                        whole,
                        key,
                    )
                    yield slip(read.lineno, "wrong-value", message, fix, "letters")
