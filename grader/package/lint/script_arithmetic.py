"""Finds wrong arithmetic in a student's Python, of indexes, angles, distances and times, for `slips.py`.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re
from collections import Counter

from script_names import (
    key_of,
)
from script_roots import wrong_roots
from script_tree import (
    all_of,
    called_name,
    dotted,
    listed,
    names_in,
    parents_of,
    slip,
    text_of,
)
from script_values import IN_DEGREES, function_around, number_of

SIDES = ("width", "height")


def arithmetic_slips(tree):
    """Numbers that are worked out wrongly."""
    sides, cells, axes = grid_sides(tree), names_of_cells(tree), axes_of(tree)
    for node in all_of(tree, ast.Subscript):
        key, line = key_of(node), getattr(node, "lineno", 0)
        if is_quotient(key):
            message = "`/` makes a float, also of whole numbers, and an index is a whole number"
            fix = "on line %d, write `//` instead of `/` in the index" % line
            yield slip(line, "float-index", message, fix, dotted(node.value))
        if dotted(node.value).rpartition(".")[2] in cells:
            yield from wrong_step(node, key, sides, axes)
    yield from past_the_edge(tree, sides, axes)
    yield from cut_to_zero(tree)
    yield from whole_angles(tree)
    yield from turned_atan(tree, axes)
    yield from multiplied_cells(tree)
    yield from mixed_units(tree)
    yield from turned_errors(tree)
    yield from exact_distances(tree)
    yield from mixed_points(tree)
    yield from mixed_coordinates(tree)
    yield from float_seconds(tree)
    yield from wrong_roots(tree)
    yield from unset_fields(tree)


def unset_fields(tree):
    """A field of a new message that is compared or calculated with, and that no line gives a value."""
    imports = [n for n in all_of(tree, ast.ImportFrom, ast.Import) if "msg" in ast.dump(n)]
    messages = {a.asname or a.name for n in imports for a in n.names}
    made, filled = {}, {n.attr for n in all_of(tree, ast.Attribute) if isinstance(n.ctx, ast.Store)}
    several = {dotted(n) for one in all_of(tree, ast.Tuple, ast.List) for n in one.elts if is_stored(n)}
    for node in all_of(tree, ast.Assign):
        for target in node.targets:
            made.setdefault(dotted(target), []).append(node)
    calls = all_of(tree, ast.Call)
    given = [
        v for n in calls if called_name(n) != "publish" for v in [*n.args, *(k.value for k in n.keywords)]
    ]
    other = {dotted(one) for one in given} | {n.arg for n in all_of(tree, ast.arg)} | several
    new = {}
    for name, nodes in made.items():
        call = nodes[0].value
        is_new = isinstance(call, ast.Call) and not call.args + call.keywords and "..." not in name
        if is_new and len(nodes) == 1 and name not in other and dotted(call.func).split(".")[0] in messages:
            new[name] = nodes[0].lineno
    told = set()
    for node in all_of(tree, ast.BinOp, ast.Compare):
        sides = [node.left, node.right] if isinstance(node, ast.BinOp) else [node.left, *node.comparators]
        for field in map(dotted, sides):
            owner = next((name for name in new if field.startswith(name + ".")), "")
            parts = field[len(owner) + 1 :].split(".")
            wholes = {owner + "." + ".".join(parts[:end]) for end in range(1, len(parts))}
            if owner and field not in told and not filled & set(parts) and not wholes & other:
                told.add(field)
                beside = [m for m in made if m.rpartition(".")[0] == field.rpartition(".")[0]]
                line = max([new[owner], *(n.lineno for m in beside for n in made[m])])
                message = "no line gives `%s` a value, so it is that of a new message, 0 or empty" % field
                fix = "below line %d, write `%s = …`" % (line, field)
                yield slip(node.lineno, "wrong-value", message, fix, "new-field")


def is_stored(node):
    return isinstance(getattr(node, "ctx", None), ast.Store)


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


def wrong_step(node, key, sides, axes):
    """`data[row * height + column]`, where a row has as many cells as it is wide, and `data[column * width + row]`.
    `axes` says which names are made of an x, and which of a y."""
    parts = [key.left, key.right] if isinstance(getattr(key, "op", None), ast.Add) else []
    steps = [part for part in parts if is_product(part)]
    if len(steps) != 1:
        return
    factors = [dotted(steps[0].left), dotted(steps[0].right)]
    added = dotted(parts[1 - parts.index(steps[0])])
    high = [name for name in factors if sides.get(name) == "height"]
    wide = [name for name in sides if sides[name] == "width"]
    # the one that is written as the other is: `self.width` beside `self.height`
    wide.sort(key=lambda name: name.rpartition(".")[0] != high[0].rpartition(".")[0]) if high else None
    width = next((name for name in factors if name in wide), wide[0] if high and wide else "")
    column = next((name for name in factors if name not in sides), "")
    if width and axes.get(column, ("",))[0] == "x" and axes.get(added, ("",))[0] == "y":
        message = "the index of a cell is `row * width + column`, and here the column is multiplied"
        fix = "on line %d, write `%s * %s + %s` for the index" % (node.lineno, added, width, column)
        if (
            column.rpartition(".")[2].lower().startswith(("row", "r", "y", "j"))
        ):  # they have each other's value
            message = "`%s` is worked out from an x, and `%s` from a y" % (column, added)
            lines = sorted((axes[column][1], axes[added][1]))
            fix = "on lines %d and %d, write y for x, and x for y" % tuple(lines)
        yield slip(node.lineno, "wrong-value", message, fix, "step")
    elif len(high) == 1 and wide:
        message = "a row of the grid has as many cells as it is wide, and this steps by its height"
        fix = "on line %d, write `%s` in place of `%s`" % (node.lineno, wide[0], high[0])
        yield slip(node.lineno, "wrong-value", message, fix, "step")


SENSED = re.compile(r"(?i)accel|magnet|gyro|imu|(?:^|[._]|d)z$")


def turned_atan(tree, axes):
    """`math.atan2(dx, dy)`, which takes y first."""
    named = {
        "dx": "x",
        "x": "x",
        "dy": "y",
        "y": "y",
        "diff_x": "x",
        "diff_y": "y",
        "delta_x": "x",
        "delta_y": "y",
    }
    for call in all_of(tree, ast.Call):
        if called_name(call) not in ("atan2", "arctan2") or len(call.args) != 2:
            continue
        if [called_name(one) for one in call.args] in (["cos", "sin"], ["sin", "sin"], ["cos", "cos"]):
            angles = [ast.dump(one.args[0]) for one in call.args if one.args]
            if len(angles) == len(call.args) and angles[0] == angles[1]:
                message = "an angle is brought between -pi and pi by its sine, and then its cosine"
                fix = "on line %d, write `%s(sin(…), cos(…))`" % (call.lineno, dotted(call.func))
                yield slip(call.lineno, "wrong-value", message, fix, "swapped")
        found = []
        for one in () if is_compass(call, tree) else call.args:
            names = names_in(one)
            if any(SENSED.search(name) for name in names):
                break  # how a sensor is tilted is another angle
            last = {
                axes[name][0] if name in axes else named.get(name.rpartition(".")[2].lower())
                for name in names
            }
            found.append(last - {None})
        if found == [{"x"}, {"y"}]:
            message = "`%s` takes y first, and then x" % called_name(call)
            fix = "on line %d, swap the two values in the brackets of `%s`" % (call.lineno, called_name(call))
            yield slip(call.lineno, "wrong-value", message, fix, "swapped")


COMPASS = re.compile(r"bearing|compass|azimuth|north", re.IGNORECASE)


def is_compass(call, tree):
    """Whether an angle is meant from the north, clockwise: by its name, or since it is taken from a quarter turn."""
    parents, node = parents_of(tree), call
    around = parents[call]
    # a pose's own angle is counted from x to the left
    if is_difference(around) and dotted(around.right).rpartition(".")[2].lower() in HEADINGS[:2]:
        return False
    while not isinstance(node, ast.stmt):
        node = parents[node]
    names = {dotted(one) for one in getattr(node, "targets", ())}
    if any(map(COMPASS.search, [*names, function_around(call, tree)])):
        return True
    quarters = [n for n in all_of(tree, ast.BinOp) if is_difference(n) and is_quarter(n.left)]
    return any(n.right is call or call in ast.walk(n.right) or names & names_in(n.right) for n in quarters)


def is_quarter(node):
    return getattr(node, "value", None) == 90 or (
        is_quotient(node) and any(n.endswith("pi") for n in names_in(node))
    )


def multiplied_cells(tree):
    """`column = int(p.x * resolution)`, where a cell is so many metres long."""
    lines = []
    # `resolution = 1 / 0.05`, and 20: so many cells are a metre.
    inverse = {
        dotted(n.targets[0])
        for n in all_of(tree, ast.Assign)
        if isinstance(getattr(n.value, "op", None), ast.Div)
        or (isinstance(n.value, ast.Constant) and type(n.value.value) in (int, float) and n.value.value >= 1)
    }
    for node in all_of(tree, ast.BinOp) if any("resolution" in name for name in names_in(tree)) else ():
        sides = [node.left, node.right] if is_product(node) else []
        points = [one for one in sides if any(map(is_point, ast.walk(one)))]
        lengths = [one for one in sides if "resolution" in dotted(one) and dotted(one) not in inverse]
        around = parents_of(tree)[node]
        if points and lengths and called_name(around) in WHOLE:
            lines.append(node.lineno)
    if lines:
        message = "a cell's number is the point's coordinate divided by the resolution, and this multiplies"
        fix = "on %s, write `/` in place of `*`" % listed(sorted(set(lines)))
        yield slip(lines[0], "wrong-value", message, fix, "times")


def is_point(node):
    return isinstance(node, ast.Attribute) and node.attr in ("x", "y")


OF_DEGREES, OF_SCANS = (
    re.compile(r"(?:^|_)deg(?:rees?)?$", re.IGNORECASE),
    ("angle_min", "angle_max", "angle_increment"),
)


def mixed_units(tree):
    """`math.degrees(math.atan2(dy, dx)) - pose.theta`, of which one is in degrees, and the other in radians."""
    # A name of the script's own may be in degrees.
    stored = [n for n in all_of(tree, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Store)]
    own = {dotted(n).rpartition(".")[2] for n in stored}
    for node in all_of(tree, ast.BinOp):
        sides = [node.left, node.right]
        degrees = [one for one in sides if called_name(one) in IN_DEGREES]
        radians = [
            n
            for n in sides
            if (getattr(n, "attr", "") == "theta" and "theta" not in own)
            or called_name(n) in ("atan2", "radians")
        ]
        if isinstance(node.op, (ast.Add, ast.Sub)) and len(degrees) == len(radians) == 1:
            name = called_name(degrees[0])
            message = "this mixes an angle in degrees with one in radians"
            fix = "on line %d, leave out `%s(…)`, so that you have both in radians" % (node.lineno, name)
            yield slip(node.lineno, "wrong-value", message, fix, "mixed")
        named = [dotted(n) for n in sides if OF_DEGREES.search(dotted(n).rpartition(".")[2])]
        of_scan = [dotted(n) for n in sides if getattr(n, "attr", "") in OF_SCANS]
        if isinstance(node.op, (ast.Add, ast.Sub, ast.Div, ast.FloorDiv)) and len(named) == len(of_scan) == 1:
            message = "this mixes degrees, `%s`, with the radians of `%s`" % (named[0], of_scan[0])
            fix = "on line %d, write `math.radians(%s)` in place of `%s`" % (node.lineno, named[0], named[0])
            yield slip(node.lineno, "wrong-value", message, fix, "mixed")


KEEP_SIGNS = ("min", "max", "float", "clip")
HEADINGS = ("theta", "yaw", "heading")


def turned_errors(tree):
    """`error = pose.theta - math.atan2(dy, dx)`, by which the robot turns without a minus."""
    given = all_of(tree, ast.Assign)
    turns = [n.value for n in given if dotted(n.targets[0]).endswith(".angular.z")]
    inside = [n for value in turns for n in ast.walk(value)]
    # a number of its own, a sign, a choice or a function may put it right
    if not inside or any(isinstance(n, (ast.USub, ast.Sub, ast.IfExp)) for n in inside):
        return
    if any(called_name(n) not in KEEP_SIGNS for n in inside if isinstance(n, ast.Call)):
        return
    used = {name for value in turns for name in names_in(value)}
    of_turns = [n for one in given if dotted(one.targets[0]) in used for n in ast.walk(one.value)]
    if any(isinstance(n, ast.Constant) and n.value for n in turns) or any(
        isinstance(n, ast.USub) for n in of_turns
    ):
        return
    towards = {dotted(n.targets[0]) for n in given if called_name(n.value) in ("atan2", "arctan2")}
    for node in all_of(tree, ast.BinOp):
        is_direction = called_name(node.right) in ("atan2", "arctan2") or dotted(node.right) in towards
        is_heading = dotted(node.left).rpartition(".")[2].lower() in HEADINGS
        if isinstance(node.op, ast.Sub) and is_heading and is_direction:
            message = "the angle to turn by is the direction of the goal minus the heading, and not the other way round"
            fix = "on line %d, swap what stands on the two sides of the minus" % node.lineno
            yield slip(node.lineno, "wrong-value", message, fix, "swapped")


NEVER_NEGATIVE = ("sqrt", "hypot", "dist", "abs", "fabs")


def exact_distances(tree):
    """`while distance != 0` and `abs(error) > -0.1`, of what is worked out and never below 0."""
    roots = NEVER_NEGATIVE[:3]
    made = {dotted(n.targets[0]) for n in all_of(tree, ast.Assign) if called_name(n.value) in roots}
    made |= {
        dotted(t)
        for t, value in pairs_of(tree)
        if called_name(value) == "min" and "ranges" in ast.dump(value)
    }
    made |= {
        one.name
        for one in all_of(tree, ast.FunctionDef)
        if any(called_name(getattr(n, "value", None)) in roots for n in one.body if isinstance(n, ast.Return))
    }
    for node in all_of(tree, ast.Compare):
        asked, number = called_name(node.left) or dotted(node.left), number_of(node.comparators[0])
        if number is None or len(node.ops) > 1 or asked not in {*made, *NEVER_NEGATIVE}:
            continue
        if number < 0 or (number == 0 and isinstance(node.ops[0], ast.Lt)):
            message = "`%s` is never below 0, and this compares it with %g" % (asked, number)
            right = "`%g` in place of `%g`" % (-number, number)
            fix, name = "on line %d, write %s" % (node.lineno, right), "negative"
            if not number:
                fix, name = "on line %d, write how near is near enough in place of 0" % node.lineno, ""
            yield slip(node.lineno, "wrong-value", message, fix, name)
        elif number == 0 and isinstance(node.ops[0], (ast.Eq, ast.NotEq)) and asked not in NEVER_NEGATIVE[3:]:
            message = "a distance that is worked out is hardly ever exactly 0"
            sign = ">" if isinstance(node.ops[0], ast.NotEq) else "<"
            fix = "on line %d, compare it with how near is near enough: `%s 0.1`" % (node.lineno, sign)
            yield slip(node.lineno, "wrong-value", message, fix, "exact")


COORDINATE = re.compile(r"(?:(.*[._])|(d)?)([xy])", re.IGNORECASE)


def point_of(node):
    """Return whose coordinate a value is, and which: `("goal.", "x")` of `goal.x`; None of all else."""
    found = COORDINATE.fullmatch(dotted(node))
    return (found.group(1) or "", found.group(3).lower()) if found and not found.group(2) else None


def pairs_of(tree):
    """Return each target of an assignment with its value, also of `x, y = a, b`."""
    pairs = []
    for node in all_of(tree, ast.Assign):
        target, value = node.targets[0], node.value
        both = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        targets, values = (target.elts, value.elts) if both else ([target], [value])
        pairs += [(one, values[at]) for at, one in enumerate(targets[: len(values)])]
    return pairs


GOALS = re.compile(r"goal|target|dest|waypoint", re.IGNORECASE)


def mixed_points(tree):
    """`atan2(goal.y - y, x - goal.x)`, of which one difference is turned, and `goal.x - pose.y`."""
    given = [(dotted(target), value) for target, value in pairs_of(tree)]
    counts = Counter(name for name, _ in given)
    once = {name: value for name, value in given if counts[name] == 1}
    for node in all_of(tree, ast.Call):
        is_angle = called_name(node) in ("atan2", "arctan2") and len(node.args) == 2
        values = [once.get(dotted(one), one) for one in node.args] if is_angle else []
        sides = [(n, point_of(n.left), point_of(n.right)) for n in values if is_difference(n)]
        owners = [(left[0], right[0], n.lineno) for n, left, right in sides if left and right]
        turned = [line for left, right, line in owners if GOALS.search(right) and not GOALS.search(left)]
        if len({one for pair in owners for one in pair[:2]}) == len(owners) == len(turned) + 1 == 2:
            message = (
                "`%s` gets one difference from the place to the goal, and one from the goal to the place"
            )
            fix = "on line %d, swap what stands on the two sides of the minus" % turned[0]
            yield slip(turned[0], "wrong-value", message % called_name(node), fix, "turned")
    for node in filter(is_difference, all_of(tree, ast.BinOp)):
        left, right = point_of(node.left), point_of(node.right)
        if left and right and left[0] != right[0] and left[1] != right[1]:
            message = "`%s - %s` mixes an x with a y" % (dotted(node.left), dotted(node.right))
            fix = "on line %d, take x from x, and y from y" % node.lineno
            yield slip(node.lineno, "wrong-value", message, fix, "mixed")


def is_difference(node):
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub)


def mixed_coordinates(tree):
    """`y = msg.x` beside `x = msg.x` in a callback, and an `x = msg.x` there alone, where `y` never changes."""
    read = {dotted(n) for n in all_of(tree, ast.Name, ast.Attribute) if isinstance(n.ctx, ast.Load)}
    values = {}
    for target, value in pairs_of(tree):
        values.setdefault(dotted(target), []).append(value)
    for function in all_of(tree, ast.FunctionDef):
        taken = {}
        for target, value in pairs_of(function):
            owner = dotted(value).partition(".")[0]
            points = [point_of(target), point_of(value)]
            if None not in points and owner != "self" and owner in {one.arg for one in function.args.args}:
                taken.setdefault((points[0][0], points[1][0]), {})[points[0][1]] = (points[1][1], target)
        for (own, whose), found in taken.items():
            axis, (read_axis, target) = next(iter(found.items()))
            other = "y" if axis == "x" else "x"
            name, right = own + other, "`%s%s = %s%s`" % (own, other, whose, other)
            if other in found and found[other][0] == read_axis:
                wrong = other if read_axis == axis else axis
                line, message = found[wrong][1].lineno, "`%s%s` gets the %s" % (own, wrong, read_axis)
                fix = "on line %d, write `%s%s = %s%s`" % (line, own, wrong, whose, wrong)
                yield slip(line, "wrong-value", message, fix, "mixed")
            elif other not in found and axis == read_axis and name in read and all_constant(values.get(name)):
                message = "nothing gives `%s` the value that comes, as line %d does for `%s%s`"
                message %= (name, target.lineno, own, axis)
                yield slip(
                    target.lineno,
                    "wrong-value",
                    message,
                    "below line %d, write %s" % (target.lineno, right),
                    "mixed",
                )


def all_constant(values):
    """Whether there are any, and each is a number that stands in the script, or None."""
    return bool(values) and all(isinstance(one, ast.Constant) for one in values)


def axes_of(tree):
    """Return the names that are made of an x alone, or of a y alone, each with the line, and whether they are whole."""
    found, twice = {}, set()
    for node in all_of(tree, ast.Assign):
        read = {getattr(n, "attr", getattr(n, "id", "")) for n in ast.walk(node.value)} & {"x", "y"}
        name = dotted(node.targets[0])
        twice |= {name} if name in found else set()
        if len(read) == 1:
            is_whole = any(
                called_name(n) in WHOLE or isinstance(n, ast.FloorDiv) for n in ast.walk(node.value)
            )
            found[name] = (read.pop(), node.lineno, is_whole)
    return {name: of for name, of in found.items() if name not in twice}


WHOLE = ("int", "floor", "trunc", "round")


def past_the_edge(tree, sides, axes):
    """`if column > width: return`, and `if column <= width:`: the last column is `width - 1`."""
    signs = {ast.Gt: (">", ">="), ast.LtE: ("<=", "<"), ast.Lt: ("<", "<="), ast.GtE: (">=", ">")}
    lines = {}
    for node in all_of(tree, ast.Compare):
        each = [node.left, *node.comparators]
        for at, op in enumerate(node.ops):
            left, right = dotted(each[at]), dotted(each[at + 1])
            cell, side = (right, left) if isinstance(op, (ast.Lt, ast.GtE)) else (left, right)
            if type(op) in signs and side in sides and cell in axes and axes[cell][2]:
                lines.setdefault((node.lineno, signs[type(op)]), []).append(
                    (cell, side, "`%s` and `%s`" % (left, right))
                )
    for (line, (shown, meant)), found in lines.items():
        cell, side, _ = found[0]
        message = "the last `%s` is `%s - 1`, and this takes `%s` for one, too" % (cell, side, side)
        places = ", and between ".join(place for _, _, place in found[:2])
        fix = "on line %d, write `%s` in place of `%s` between %s" % (line, meant, shown, places)
        yield slip(line, "wrong-value", message, fix, "edge")


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
