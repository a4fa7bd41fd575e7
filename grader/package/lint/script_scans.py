"""Finds what a student's Python makes of a scan, for `slips.py`: which of its ranges it reads, and whether a single one
that is small counts.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
from collections import Counter

from script_names import (
    USES_LIMIT,
    key_of,
)
from script_tree import (
    FUNCTIONS,
    all_of,
    callback_of,
    called_name,
    calls_in,
    dotted,
    functions_in,
    names_in,
    parents_of,
    published_type,
    slip,
    statements_of,
)


def scan_slips(tree):
    """Which ranges of a scan are read, and what is not decided by the smallest of them."""
    yield from not_the_smallest(tree)
    yield from nothing_taken_for_near(tree)
    yield from drives_where_near(tree)
    yield from not_in_metres(tree)
    yield from angles_for_indexes(tree)
    yield from ranges_read(tree)


SMALLEST = ("min", "nanmin", "amin", "sorted", "sort", "argmin")
PRINTS = ("print", "loginfo", "logwarn", "logdebug", "logerr", "write")


def not_the_smallest(tree):
    """`sum(front) / len(front)`, `max(front) < 0.5`, or `any(r > 0.5 for r in front)`, in a script that reads a scan
    and looks for no smallest one, but to print it."""
    held = names_of_ranges(tree)
    every = all_of(tree, ast.Call)
    printed = {id(n) for call in every if called_name(call) in PRINTS for n in ast.walk(call)}
    if not held or any(called_name(n) in SMALLEST and id(n) not in printed for n in every):
        return
    for node in all_of(tree, ast.BinOp):
        is_mean = (
            isinstance(node.op, ast.Div)
            and called_name(node.left) == "sum"
            and called_name(node.right) == "len"
        )
        if is_mean and node.left.args and node.right.args and names_in(node.left) & held:
            name = dotted(node.right.args[0])
            message = "the mean of many ranges is large even where one of them is small"
            fix = "on line %d, write `min(%s)` in its place" % (node.lineno, "…" if "..." in name else name)
            yield slip(node.lineno, "wrong-value", message, fix, "mean")
    made = {dotted(n.targets[0]): n.value for n in all_of(tree, ast.Assign) if calls_of(n.value, "max")}
    tests = [n for n in all_of(tree, ast.Compare) if isinstance(n.ops[0], (ast.Lt, ast.LtE))]
    for value in (made.get(dotted(n.left), n.left) for n in tests):
        for call in (one for one in calls_of(value, "max") if names_in(one) & held):
            message = "the largest of these ranges is small only where all of them are"
            fix = "on line %d, write `min` for `max`" % call.lineno
            yield slip(call.lineno, "wrong-value", message, fix, "mean")
    yield from far_decides(tree, held)


def calls_of(node, *names):
    """Return the calls of these functions in a value."""
    return [n for n in ast.walk(node) if called_name(n) in names] if node is not None else []


def names_of_ranges(tree):
    """Return the names in a script that stand for ranges of a scan: the field's own, and what is made of them."""
    held = {dotted(n) for n in all_of(tree, ast.Attribute) if is_ranges(n)}
    for node in all_of(tree, ast.Assign) if held else ():
        if names_in(node.value) & held and not calls_of(node.value, "len", "min", "max", "sum"):
            held |= {
                dotted(target) for target in node.targets if isinstance(target, (ast.Name, ast.Attribute))
            }
    return held - {"..."}


FAR = (ast.Gt, ast.GtE)


def far_decides(tree, held):
    """`for r in ranges: if r > 0.5: near = False`, and the same in one line: a single range that is large decides."""
    found = {}
    for loop in all_of(tree, ast.For):
        only = loop.body[0] if len(loop.body) == 1 else None
        if not isinstance(only, ast.If) or only.orelse or not names_in(loop.iter) & held:
            continue
        flags = {dotted(n.targets[0]) for n in only.body if is_flag(n)}
        if flags and len(flags) == len(only.body):
            found[only.lineno] = (only.test, names_in(loop.target))
    for node in all_of(tree, ast.Call):
        each = node.args[0] if node.args and called_name(node) in ("any", "all") else None
        if isinstance(each, (ast.GeneratorExp, ast.ListComp)) and names_in(each.generators[0].iter) & held:
            # `all(r < 0.5 …)` is another one, and `all(r > 0.5 …)` is right
            names, turned = names_in(each.generators[0].target), called_name(node) == "all"
            found[node.lineno] = (each.elt, names, turned)
    for line, (test, names, *turned) in found.items():
        kinds = (ast.Lt, ast.LtE) if any(turned) else FAR
        is_bound = isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.ops[0], kinds)
        if is_bound and dotted(test.left) in names and number_in(test.comparators[0]) is not None:
            message = (
                "this is decided by the largest of the ranges, and a wall is near where the smallest one is"
            )
            fix = "on line %d, ask whether `min(…)` of them is small, or whether any of them is" % line
            yield slip(line, "wrong-value", message, fix, "mean")


def is_flag(node):
    """Whether a statement gives a name True or False."""
    return isinstance(node, ast.Assign) and getattr(node.value, "value", None) in (True, False)


def number_in(node):
    """Return the number, or the name of one in capitals, that something is compared with; None of all else."""
    name = dotted(node).rpartition(".")[2]
    value = getattr(node, "value", None)
    return name if name.isupper() else value if type(value) in (int, float) and value else None


def nothing_taken_for_near(tree):
    """`if math.isinf(r): r = 0`, in a script that reads a scan and does not leave out what is 0."""
    compared = [n for n in all_of(tree, ast.Compare) if isinstance(n.ops[0], (ast.Gt, ast.NotEq, ast.GtE))]
    filtered = [
        n for n in compared if getattr(n.comparators[0], "value", None) == 0 or "range_min" in ast.dump(n)
    ]
    if filtered or not any(is_ranges(n) for n in all_of(tree, ast.Attribute)):
        return
    for node in all_of(tree, ast.If, ast.IfExp, ast.Assign):
        line, asked = zero_given(node, tree)
        parts = asked.values if isinstance(asked, ast.BoolOp) and isinstance(asked.op, ast.Or) else [asked]
        if line and any(map(asks_for_inf, parts)):
            message = "inf says that nothing is in reach, and this makes 0 of it, as if a wall were touched"
            yield slip(line, "wrong-value", message, "on line %d, write `10.0` in place of 0" % line, "inf")


def zero_given(node, tree):
    """Return the line on which a value becomes 0, and the condition on that value under which it does; 0 for none."""
    if isinstance(node, ast.IfExp):
        value, test, names = node.body, node.test, {dotted(node.orelse)}
    elif isinstance(node, ast.Assign):  # `ranges[np.isinf(ranges)] = 0`
        target = node.targets[0]
        if not isinstance(target, ast.Subscript):
            return 0, None
        value, test, names = node.value, key_of(target), {dotted(target.value)}
    else:
        only, test = node.body[0] if len(node.body) == 1 else None, node.test
        value = getattr(only, "value", None)
        names = {dotted(one) for one in getattr(only, "targets", ())}
        if isinstance(only, ast.Return):
            block = parents_of(tree)[node]
            below = statements_of(block)[:USES_LIMIT]
            names = {dotted(n.value) for n in below if isinstance(n, ast.Return)}
    is_zero = is_number(value) and value.value == 0
    return (value.lineno, test) if is_zero and names & names_in(test) else (0, None)


def is_number(node):
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def asks_for_inf(test):
    """Whether a condition is that a value is inf."""
    if called_name(test) == "isinf":
        return True
    sides = [test.left, *test.comparators] if isinstance(test, ast.Compare) and len(test.ops) == 1 else []
    is_inf = [called_name(n) == "float" or getattr(n, "attr", "") in ("inf", "range_max") for n in sides]
    return any(is_inf) and not isinstance(test.ops[0], (ast.NotEq, ast.Lt, ast.LtE))


def drives_where_near(tree):
    """`if min(front) > 0.5: cmd.angular.z = 1` with `else: cmd.linear.x = 0.2`, which is the wrong way round."""
    held = names_of_ranges(tree)
    made = [n for n in all_of(tree, ast.Assign) if held and is_smallest(n.value, held)]
    near = {dotted(n.targets[0]) for n in made}
    for node in all_of(tree, ast.If)[:USES_LIMIT] if held else ():
        test = node.test if isinstance(node.test, ast.Compare) and len(node.test.ops) == 1 else None
        if test is None or not (is_smallest(test.left, held) or dotted(test.left) in near):
            continue
        is_far = isinstance(test.ops[0], FAR)
        is_bound = is_far or isinstance(test.ops[0], (ast.Lt, ast.LtE))
        free, wall = (node.body, node.orelse) if is_far else (node.orelse, node.body)
        if (
            is_bound
            and number_in(test.comparators[0]) is not None
            and speeds_in(wall)
            and not speeds_in(free)
        ):
            signs = ("<", ">") if is_far else (">", "<")
            message = "this drives where something is near, and stops or turns where the way is free"
            fix = "on line %d, write `%s` in place of `%s`, or swap the two branches" % (node.lineno, *signs)
            yield slip(node.lineno, "wrong-value", message, fix, "turned")


FARTHEST = (10, 1000)
"""No laser of a lab looks farther, in metres: a larger number that a range is compared with is one of centimetres."""


def not_in_metres(tree):
    """`min(scan.ranges) < 50`, also where the 50 is the value of a name."""
    given = {}
    for n in all_of(tree, ast.Assign, ast.AnnAssign):
        for target in getattr(n, "targets", None) or [n.target]:
            given.setdefault(dotted(target).rpartition(".")[2], []).append(n.value)
    held = names_of_ranges(tree)
    near = {dotted(n.targets[0]) for n in all_of(tree, ast.Assign) if held and smallest_in(n.value, held)}
    for node in all_of(tree, ast.Compare) if held else ():
        sides = [node.left, node.comparators[0]] if len(node.ops) == 1 else []
        bounds = [n for n in sides if not (smallest_in(n, held) or dotted(n) in near)]
        if len(bounds) != 1 or len(sides) != 2 or type(node.ops[0]) not in (ast.Lt, ast.LtE, *FAR):
            continue
        values = [bounds[0]] if is_number(bounds[0]) else given.get(dotted(bounds[0]).rpartition(".")[2], ())
        value = values[0] if len(values) == 1 and is_number(values[0]) else None
        if value is not None and FARTHEST[0] <= value.value <= FARTHEST[1]:
            name = "" if value is bounds[0] else ", `%s`" % dotted(bounds[0])
            message = "a range is in metres, and is compared with %g%s on line %d" % (
                value.value,
                name,
                node.lineno,
            )
            fix = "on line %d, write the distance in metres, as in `%g`" % (value.lineno, value.value / 100)
            yield slip(value.lineno, "wrong-value", message, fix, "metres")


def smallest_in(node, held):
    """Whether a value is the smallest of ranges, or one of them."""
    node = node.body if isinstance(node, ast.IfExp) else node
    return is_smallest(node, held) or (isinstance(node, ast.Subscript) and dotted(node.value) in held)


FULL = 6.3
"""More than any angle in radians."""


def angles_for_indexes(tree):
    """`ranges[int(math.radians(90))]`, and `ranges[int(math.pi / 2)]`: an index is a number of steps."""
    for node in all_of(tree, ast.Subscript):
        key = key_of(node) if is_ranges(node.value) else None
        inside = list(ast.walk(key)) if key is not None and not isinstance(key, ast.Slice) else []
        angles = [
            n for n in inside if called_name(n) in ("radians", "deg2rad") or getattr(n, "attr", "") == "pi"
        ]
        steps = [n.right for n in inside if isinstance(getattr(n, "op", None), (ast.Div, ast.FloorDiv))]
        # `angle * 57.3` is in degrees
        products = [n for n in inside if isinstance(getattr(n, "op", None), ast.Mult)]
        turned = any(is_number(one) and one.value > FULL for n in products for one in (n.left, n.right))
        if angles and not turned and all(map(is_number, steps)) and not calls_of(key, "degrees", "len"):
            message = "this takes an angle in radians for an index, which counts the ranges"
            fix = "on line %d, write `int((angle - msg.angle_min) / msg.angle_increment)`, with your angle and message"
            yield slip(node.lineno, "wrong-value", message, fix % node.lineno, "angle")
    yield from whole_radians(tree)


def whole_radians(tree):
    """`SECTOR = int(math.radians(45))`, which is 0, in a script whose slices of ranges have that name."""
    slices = [n for n in all_of(tree, ast.Subscript) if is_ranges(n.value)]
    names = {name.rpartition(".")[2] for one in slices for name in names_in(key_of(one))} if slices else ()
    for node in all_of(tree, ast.Assign) if names else ():
        whole = node.value if called_name(node.value) in ("int", "round") else None
        angle = whole.args[0] if whole is not None and len(whole.args) == 1 else None
        if (
            called_name(angle) in ("radians", "deg2rad")
            and dotted(node.targets[0]).rpartition(".")[2] in names
        ):
            name, given = dotted(node.targets[0]), angle.args[0] if angle.args else None
            number = repr(given.value) if is_number(given) else "the number of degrees"
            message = "`%s` is a whole number of radians, of which hardly anything is left, and an index counts ranges"
            fix = "on line %d, write `%s = %s` where the scan has a range for each degree"
            yield slip(node.lineno, "wrong-value", message % name, fix % (node.lineno, name, number), "angle")


def is_smallest(node, held):
    return called_name(node) in SMALLEST[:3] and bool(names_in(node) & held)


def speeds_in(block):
    """Return the statements of a block that make a robot drive forward."""
    given = [n for one in block for n in ast.walk(one) if isinstance(n, ast.Assign)]
    return [
        n
        for n in given
        if dotted(n.targets[0]).endswith(".linear.x")
        and not isinstance(n.value, ast.UnaryOp)
        and getattr(n.value, "value", 1) != 0
    ]


def ranges_read(tree):
    """Which ranges of a scan a script reads (`0:45`), where each index is a number, or a part of their count."""
    parents, found = parents_of(tree), []
    copies = {dotted(t): n.value for n in all_of(tree, ast.Assign) if copied(n.value) for t in n.targets}
    held = copies.keys() - {"..."}
    copied_from = {id(copied(value)) for name, value in copies.items() if name in held}
    stored = [n for n in all_of(tree, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Store)]
    counts = Counter([dotted(n) for n in stored] + [n.arg for n in all_of(tree, ast.arg)])
    given = [(dotted(target), n.value) for n in all_of(tree, ast.Assign) for target in n.targets]
    once = {name: value for name, value in given if counts[name] == 1}
    for node in all_of(tree, ast.Name, ast.Attribute):
        if not isinstance(node.ctx, ast.Load) or not (is_ranges(node) or dotted(node) in held):
            continue
        around = parents[node]
        if (
            id(node) in copied_from
            or isinstance(around, ast.Assign)
            or called_name(around) == "len"
            or is_truth(node, around)
        ):
            continue
        indexes = []
        if isinstance(around, ast.Subscript) and around.value is node:
            indexes = indexes_in(around, once, tree)
        if not indexes or len(found) >= USES_LIMIT:
            return  # here it may read any of them
        found += [slip(line, "ranges-read", index, name=dotted(node)) for line, index in indexes]
    yield from found


def copied(value):
    """Return the ranges that a value has all of, in their order: `msg.ranges`, `list(msg.ranges)`, and a list of what
    is made of each; None of all else."""
    if called_name(value) in ("list", "tuple", "array", "asarray", "nan_to_num", "clip") and value.args:
        value = value.args[0]
    if isinstance(value, ast.ListComp) and len(value.generators) == 1 and not value.generators[0].ifs:
        value = value.generators[0].iter
    return value if is_ranges(value) else None


def is_truth(node, around):
    """Whether it is only asked whether there is anything: `if ranges`, `not ranges`."""
    return getattr(around, "test", None) is node or isinstance(getattr(around, "op", None), ast.Not)


def is_ranges(node):
    return getattr(node, "attr", "") == "ranges"


def indexes_in(subscript, once, tree):
    """Return what stands in the brackets, each with its line, where it is a number, a part of the count, or a slice of
    these, also as a variable of a loop or of a function; else nothing. `once` are the values of the names that get only
    one."""
    key = key_of(subscript)
    if isinstance(key, ast.Slice):
        numbers = ["" if one is None else index_in(one, once) for one in (key.lower, key.upper)]
        return [] if key.step is not None or None in numbers else [(subscript.lineno, ":".join(numbers))]
    number = index_in(key, once)
    return [(subscript.lineno, number)] if number is not None else counted_in(key, subscript, once, tree)


def counted_in(key, node, once, tree, depth=0):
    """Return the same of a variable of a loop over `range(-5, 5)`, or of a function that is called with such ones, or
    with numbers: `ranges[int(degrees) % 360]`."""
    while True:
        if called_name(key) in ("int", "round") and len(key.args) == 1:
            key = key.args[0]
        elif isinstance(getattr(key, "op", None), ast.Mod):
            key = key.left
        else:
            break
    name, parents = getattr(key, "id", None), parents_of(tree)
    around = node
    while name and around is not tree and not isinstance(around, FUNCTIONS):
        around = parents[around]
        for loop in getattr(around, "generators", [around]):
            if getattr(getattr(loop, "target", None), "id", None) == name:
                return range_of(loop.iter, once)
    given = [one.arg for one in around.args.args] if isinstance(around, ast.FunctionDef) else []
    stored = (
        [n for n in ast.walk(around) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        if given
        else []
    )
    if name not in given or name in {n.id for n in stored} or depth > 1:
        return []
    place = given.index(name) - (given[0] == "self")
    calls = [n for n in all_of(tree, ast.Call) if called_name(n) == around.name]
    found = []
    for call in calls if len(calls) < USES_LIMIT else ():
        value = call.args[place] if 0 <= place < len(call.args) else None
        number = index_in(value, once)
        one = (
            [(call.lineno, number)] if number is not None else counted_in(value, call, once, tree, depth + 1)
        )
        if not one:
            return []
        found += one
    return found


def range_of(call, once):
    """Return the slices that have the numbers of `range(first, last)`, or those of a list, with its line; nothing of
    all else."""
    if isinstance(call, (ast.List, ast.Tuple)):
        numbers = [index_in(one, once) for one in call.elts[:USES_LIMIT]]
        return [] if None in numbers else [(call.lineno, one) for one in numbers]
    given = [part_of_count(one, once) for one in call.args] if called_name(call) == "range" else []
    if not 1 <= len(given) <= 2 or None in given or any(times for times, _, _ in given):
        return []
    first, last = given[0][2] if len(given) > 1 else 0, given[-1][2]
    if first >= 0:
        return [(call.lineno, "%d:%d" % (first, last))]
    below = (call.lineno, "%d:%s" % (first, last if last < 0 else ""))
    return [below, (call.lineno, ":%d" % last)] if last > 0 else [below]


DEEP = 8


def index_in(node, once):
    """Return the text of an index that is a whole number, or a part of the count `n` of ranges: `n*3//4-45`; None of
    all else."""
    found = part_of_count(node, once)
    if found is None:
        return None
    times, by, more = found
    text = "n" + ("*%d" % times if times != 1 else "") + ("//%d" % by if by != 1 else "") if times else ""
    return text + ("%+d" % more if text and more else "" if text else str(more))


def part_of_count(node, once, depth=0):
    """Return the numbers a, b and c where a value is `a * count // b + c`, `count` being that of ranges; else None."""
    sign = -1 if isinstance(getattr(node, "op", None), ast.USub) else 1
    value = getattr(node.operand if sign < 0 else node, "value", None)
    if type(value) is int and abs(value) < 1e6:
        return (0, 1, sign * value)
    if depth >= DEEP or node is None:
        return None
    if isinstance(node, ast.Call):
        name, given = called_name(node), node.args[0] if len(node.args) == 1 else None
        is_count = name == "len" and "ranges" in dotted(given)
        return (1, 1, 0) if is_count else part_of_count(given, once, depth + 1) if name == "int" else None
    if isinstance(node, ast.BinOp):
        left, right = (part_of_count(one, once, depth + 1) for one in (node.left, node.right))
        return None if left is None or right is None else computed(left, node.op, right)
    return part_of_count(once.get(dotted(node)), once, depth + 1)


def computed(left, op, right):
    """Return the same of a sum, a product or a quotient of two."""
    (times, by, more), (other, _, number) = left, right
    if isinstance(op, (ast.Add, ast.Sub)) and not other:
        return (times, by, more + number if isinstance(op, ast.Add) else more - number)
    if isinstance(op, (ast.Add, ast.Mult)) and not times and other:
        return computed(right, op, left)
    if other or number <= 0 or (times and more):
        return None
    if isinstance(op, (ast.Div, ast.FloorDiv)):
        return (times, by * number, 0) if times else (0, 1, more // number)
    return (times * number, by, more * number) if isinstance(op, ast.Mult) else None


OF_MOMENTS = ("LaserScan", "Range")
"""Messages that say how it is now, of which the first one alone is of no use."""


def first_scans(tree):
    """Callbacks that keep the first scan, and nothing of those that come later."""
    functions = functions_in(tree)
    for call in all_of(tree, ast.Call):
        own = callback_of(call, functions)
        if own is None or published_type(call) not in OF_MOMENTS:
            continue
        heard = next((a.arg for a in own.args.args if a.arg != "self"), "")
        reads = [n for n in ast.walk(own) if isinstance(n, ast.Name) and n.id == heard]
        for one in (n for n in ast.walk(own) if isinstance(n, ast.If)):
            name = asked_for_none(one.test)
            taken = (n for n in one.body if isinstance(n, ast.Assign))
            whole = (n for n in taken if dotted(n.value) in (heard, heard + ".ranges"))
            kept = {dotted(t) for n in whole for t in n.targets}
            inside = set(ast.walk(ast.Module(one.body, [])))
            given = [n for n in all_of(tree, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Store)]
            given = [n for n in given if dotted(n) == name]
            once = calls_in(own, "unregister", "signal_shutdown", "set")
            # where it begins, and here
            if name in kept and not once and not one.orelse and inside.issuperset(reads) and len(given) <= 2:
                message = "`%s` keeps the first message of its topic, and none that comes later" % name
                fix = "on line %d, take out the condition, so that each message takes its place" % one.lineno
                yield slip(one.lineno, "wrong-value", message, fix, "first")
                break


def asked_for_none(test):
    """Return the name of `name is None` and `not name`; "" of all else."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return dotted(test.operand)
    is_none = isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is) and len(test.ops) == 1
    return dotted(test.left) if is_none and getattr(test.comparators[0], "value", 0) is None else ""
