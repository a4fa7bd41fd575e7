"""Finds wrong arithmetic in a student's Python, of indexes, angles, distances and times, for `slips.py`, and with which
indexes it reads a scan.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
from collections import Counter

from script_names import (
    USES_LIMIT,
    all_of,
    called_name,
    dotted,
    key_of,
    listed,
    names_in,
    parents_of,
    slip,
    text_of,
)

SIDES = ("width", "height")


def arithmetic_slips(tree):
    """Numbers that are worked out wrongly, and which ranges of a scan are read."""
    sides, cells = grid_sides(tree), names_of_cells(tree)
    for node in all_of(tree, ast.Subscript):
        key, line = key_of(node), getattr(node, "lineno", 0)
        if is_quotient(key):
            message = "`/` makes a float, also of whole numbers, and an index is a whole number"
            fix = "on line %d, write `//` instead of `/` in the index" % line
            yield slip(line, "float-index", message, fix, dotted(node.value))
        if dotted(node.value).rpartition(".")[2] in cells:
            yield from wrong_step(node, key, sides)
    yield from cut_to_zero(tree)
    yield from whole_angles(tree)
    yield from float_seconds(tree)
    yield from not_the_smallest(tree)
    yield from ranges_read(tree)
    yield from without_root(tree)


def is_quotient(node):
    """Whether a value is divided; `folder / 'file'` is a path."""
    texts = [n for n in ast.walk(node) if isinstance(n, ast.JoinedStr) or type(getattr(n, "value", 0)) is str]
    return isinstance(getattr(node, "op", None), ast.Div) and not texts


def grid_sides(tree):
    """Return the names of a grid's sides, `width` or `height`: those of parameters of that name, and of the fields of
    its info."""
    found = {}
    for node in all_of(tree, ast.Assign):
        read = (
            text_of(node.value.args[0]) if called_name(node.value) == "get_param" and node.value.args else ""
        )
        pairs = [(dotted(target), read or dotted(node.value)) for target in node.targets]
        for name, side in pairs + [(dotted(node.value), name) for name, _ in pairs if ".info." in name]:
            if side.endswith(SIDES):
                found.setdefault(name, set()).add("width" if side.endswith("width") else "height")
    for node in all_of(tree, ast.Attribute):
        if node.attr in SIDES and ".info." in dotted(node):
            found[dotted(node)] = {node.attr}
    # One number for both is the side of a square.
    return {name: of.pop() for name, of in found.items() if "..." not in name and len(of) == 1}


def names_of_cells(tree):
    """Return the last names of the lists with a grid's cells; a list of the script's own may have another order."""
    pairs = [(target, n.value) for n in all_of(tree, ast.Assign) for target in n.targets]
    held = [one for pair in pairs if any(getattr(n, "attr", "") == "data" for n in pair) for one in pair]
    held += [n.value for n in all_of(tree, ast.keyword) if n.arg == "data"]
    return {dotted(one).rpartition(".")[2] for one in held} | {"data"}


def wrong_step(node, key, sides):
    """`data[row * height + column]`, where a row has as many cells as the grid is wide."""
    parts = [key.left, key.right] if isinstance(getattr(key, "op", None), ast.Add) else []
    steps = [part for part in parts if is_product(part)]
    if len(steps) != 1:
        return
    factors = [dotted(steps[0].left), dotted(steps[0].right)]
    high = [name for name in factors if sides.get(name) == "height"]
    wide = [name for name in sides if sides[name] == "width"]
    # the one that is written as the other is: `self.width` beside `self.height`
    wide.sort(key=lambda name: name.rpartition(".")[0] != high[0].rpartition(".")[0]) if high else None
    if len(high) == 1 and wide:
        message = "a row of the grid has as many cells as it is wide, and this steps by its height"
        fix = "on line %d, write `%s` in place of `%s`" % (node.lineno, wide[0], high[0])
        yield slip(node.lineno, "wrong-value", message, fix, "step")


def cut_to_zero(tree):
    """`column = int(x / size)` of which the script asks whether it is below 0: -0.5 becomes 0."""
    for function in all_of(tree, ast.FunctionDef):
        inside = list(ast.walk(function))
        asked = set()
        for test in (n for n in inside if isinstance(n, ast.Compare)):
            sides = [test.left, *test.comparators]
            # `0 <= n`, and not `n > 0`: what is below 0 is told from 0
            pairs = [
                (sides[at + isinstance(op, (ast.Gt, ast.LtE))], sides[at + isinstance(op, (ast.Lt, ast.GtE))])
                for at, op in enumerate(test.ops)
                if isinstance(op, (ast.Lt, ast.LtE, ast.Gt, ast.GtE))
            ]
            asked.update(dotted(one) for one, of in pairs if getattr(of, "value", None) == 0)
        # `if n < 0: n = 0` comes to the same
        tests = [n for n in inside if isinstance(n, ast.If)]
        asked -= {dotted(t) for n in tests for one in n.body for t in getattr(one, "targets", ())}
        made = [
            n for n in inside if isinstance(n, ast.Assign) and called_name(n.value) == "int" and n.value.args
        ]
        given = {n.lineno: n.value.args[0] for n in made if dotted(n.targets[0]) in asked}
        # not where the number itself is compared with 0
        lines = [at for at, one in given.items() if is_quotient(one) and not names_in(one) & asked]
        if lines:
            message = "`int(…)` cuts off towards 0, so that what is just below 0 becomes 0"
            fix = "on %s, write `math.floor(…)` in place of `int(…)`" % listed(lines)
            yield slip(lines[0], "wrong-value", message, fix, "cut")


def float_seconds(tree):
    """`stamp.secs = rospy.get_time()`: both parts of a time are whole numbers."""
    for node in all_of(tree, ast.Assign):
        target, name = dotted(node.targets[0]), called_name(node.value)
        is_own = target.count(".") <= target.startswith("self.")  # a `self.secs` is the script's
        is_part = target.endswith((".secs", ".nsecs")) and not is_own
        if is_part and name in ("get_time", "time", "to_sec"):
            message = "`%s` takes a whole number, and `%s()` is a float" % (target, name)
            fix = "on line %d, write `%s = rospy.Time.now()`" % (node.lineno, target.rpartition(".")[0])
            yield slip(node.lineno, "wrong-value", message, fix, "secs")


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


def without_root(tree):
    """`distance = dx ** 2 + dy ** 2`: a sum of two squares that is called a distance."""
    named = [(dotted(n.targets[0]), n.value) for n in all_of(tree, ast.Assign)]
    for function in all_of(tree, ast.FunctionDef):
        named += [(function.name, n.value) for n in function.body if isinstance(n, ast.Return)]
    sums = [(name, value) for name, value in named if isinstance(getattr(value, "op", None), ast.Add)]
    squared = squares_in_use(tree) if sums else ()
    for name, value in sums:
        last = name.rpartition(".")[2]
        is_called_so = "dist" in last.lower() and "sq" not in last.lower() and "2" not in last
        if is_called_so and is_square(value.left) and is_square(value.right) and last not in squared:
            message = "`%s` is the square of a distance, as without a square root" % name
            fix = "on line %d, write `(… + …) ** 0.5`, with brackets around the whole sum" % value.lineno
            yield slip(value.lineno, "wrong-value", message, fix, "rootless")


def squares_in_use(tree):
    """Return the last names of what a root is taken of elsewhere, or is compared as a square: with a square or a
    product, or with each other, by `key=` or with the least one so far."""
    kept = {(dotted(t), dotted(n.value)) for n in all_of(tree, ast.Assign) for t in n.targets}
    used = [n for n in all_of(tree, ast.Call) if called_name(n) == "sqrt"]
    powers = [n for n in all_of(tree, ast.BinOp) if isinstance(n.op, ast.Pow)]
    used += [n for n in powers if getattr(n.right, "value", 0) == 0.5]
    used += [n for n in all_of(tree, ast.keyword) if n.arg == "key"]
    for node in all_of(tree, ast.Compare):
        sides = [node.left, *node.comparators]
        products = [one for one in sides if isinstance(getattr(one, "op", None), (ast.Pow, ast.Mult))]
        pair = tuple(map(dotted, sides))
        used += [node] if products or any(map(is_square, sides)) or kept & {pair, pair[::-1]} else []
    return {name.rpartition(".")[2] for one in used for name in names_in(one)}


def is_square(node):
    """Whether a value is `x ** 2` or `pow(x, 2)`."""
    power = node.right if isinstance(getattr(node, "op", None), ast.Pow) else None
    last = node.args[1] if called_name(node) == "pow" and len(node.args) > 1 else power
    return getattr(last, "value", None) == 2


OF_QUATERNION = 4


def whole_angles(tree):
    """Quaternions of the sine and cosine of a whole angle."""
    given = [(dotted(n.targets[0]), n.value) for n in all_of(tree, ast.Assign)]
    sides = {name: value for name, value in reversed(given) if name.endswith(".w")}
    halves = {name for name, value in given if any(map(is_part, ast.walk(value)))}
    halves |= {dotted(n.target) for n in all_of(tree, ast.AugAssign) if isinstance(n.op, (ast.Div, ast.Mult))}
    for node in all_of(tree, ast.Assign, ast.Call):
        angle, lines = whole_angle(node, sides, halves) or ("", [])
        if angle:
            message = "a quaternion is made of half the angle, and `%s` is all of it" % angle
            fix = "on %s, write `%s / 2` in place of `%s`" % (listed(lines), angle, angle)
            yield slip(node.lineno, "wrong-value", message, fix, "half")


def is_part(node):
    """Whether a value is divided, or multiplied by a number below 1."""
    sides = (
        [getattr(node.left, "value", None), getattr(node.right, "value", None)] if is_product(node) else []
    )
    return is_quotient(node) or any(isinstance(one, float) and 0 < one < 1 for one in sides)


def is_product(node):
    return isinstance(getattr(node, "op", None), ast.Mult)


def whole_angle(node, sides, halves):
    """Return the angle and the lines of `q.z = sin(yaw)` and `q.w = cos(yaw)`, or of a Quaternion made of these; None
    of all else. `sides` are the values of each `q.w`."""
    if called_name(node) == "Quaternion" and len(node.args) == OF_QUATERNION:
        parts = node.args[2:]
    elif isinstance(node, ast.Assign) and getattr(node.targets[0], "attr", "") == "z":
        parts = [node.value, sides.get(dotted(node.targets[0].value) + ".w")]
    else:
        return None
    if [called_name(one) for one in parts] != ["sin", "cos"]:
        return None
    angles = {dotted(one.args[0]) for one in parts if one.args} - {"...", *halves}
    angles = {one for one in angles if "half" not in one.lower()}
    return (angles.pop(), sorted({one.lineno for one in parts})) if len(angles) == 1 else None


def ranges_read(tree):
    """Which ranges of a scan a script reads (`0:45`), where each index is a number, or a part of their count."""
    parents, found = parents_of(tree), []
    held = {dotted(t) for n in all_of(tree, ast.Assign) if is_ranges(n.value) for t in n.targets} - {"..."}
    stored = [n for n in all_of(tree, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Store)]
    counts = Counter([dotted(n) for n in stored] + [n.arg for n in all_of(tree, ast.arg)])
    given = [(dotted(target), n.value) for n in all_of(tree, ast.Assign) for target in n.targets]
    once = {name: value for name, value in given if counts[name] == 1}
    for node in all_of(tree, ast.Name, ast.Attribute):
        if not isinstance(node.ctx, ast.Load) or not (is_ranges(node) or dotted(node) in held):
            continue
        around = parents[node]
        if isinstance(around, ast.Assign) or called_name(around) == "len" or is_truth(node, around):
            continue
        index = index_text(around, once) if isinstance(around, ast.Subscript) and around.value is node else ""
        if not index or len(found) >= USES_LIMIT:
            return  # here it may read any of them
        found.append(slip(node.lineno, "ranges-read", index, name=dotted(node)))
    yield from found


def is_truth(node, around):
    """Whether it is only asked whether there is anything: `if ranges`, `not ranges`."""
    return getattr(around, "test", None) is node or isinstance(getattr(around, "op", None), ast.Not)


def is_ranges(node):
    return getattr(node, "attr", "") == "ranges"


def index_text(subscript, once):
    """Return what stands in the brackets, where it is a number, a part of the count, or a slice of these; else "".
    `once` are the values of the names that get only one."""
    key = key_of(subscript)
    parts = [key.lower, key.upper] if isinstance(key, ast.Slice) and key.step is None else [key]
    numbers = ["" if one is None else index_in(one, once) for one in parts]
    return "" if None in numbers else ":".join(numbers)


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
