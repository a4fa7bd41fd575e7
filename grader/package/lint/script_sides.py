"""Finds names that say another side than their values have, for `slips.py`: ranges of a scan to the left that are
called right, and frames that are given to each other's field; and numbers whose names say how far or how long.

Nothing is executed. Python 3.8, standard library only.
"""

import ast
import re

from script_counters import signed
from script_scans import index_in, is_ranges
from script_tree import all_of, called_name, calls_in, dotted, slip, text_of

WORDS = re.compile(r"(?i:(?:^|_)(left|right)(?:_|$))|[a-z](Left|Right)(?![a-z])|^(left|right)(?=[A-Z])")
ACTS = re.compile(r"turn|go(?:_|$)|goes|steer|drive|spin|rotat|move|should|veer", re.IGNORECASE)
ROUND = 360
"""So many ranges has the scan of the robots that a course has, one for each degree, the first of which is ahead."""
ASIDE = (20, 160)
"""Degrees from straight ahead between which a range is to the left, or to the right."""


def named_sides(tree):
    """`right = min(ranges[45:135])`, and `RIGHT = 90`: degrees and indexes count to the left from straight ahead."""
    given = {}
    for n in all_of(tree, ast.Assign):
        for target in n.targets:
            given.setdefault(dotted(target), []).append(n.value)
    once = {name: values[0] for name, values in given.items() if len(values) == 1}
    of_scan = any(is_ranges(n) for n in all_of(tree, ast.Attribute)) or "LaserScan" in {
        n.name for one in all_of(tree, ast.ImportFrom) for n in one.names
    }
    for node in all_of(tree, ast.Assign, ast.FunctionDef) if of_scan else ():
        is_value = isinstance(node, ast.Assign)
        name = dotted(node.targets[0]) if is_value else node.name
        word = side_in(name)
        returned = (
            [n.value for n in ast.walk(node) if isinstance(n, ast.Return)] if not is_value else [node.value]
        )
        # to turn right where the left is near is right
        if not word or len(returned) != 1 or returned[0] is None or ACTS.search(name) or decides(returned[0]):
            continue
        found = sides_read(returned[0], once, constant=is_value and name.rpartition(".")[2].isupper())
        other = "left" if word == "right" else "right"
        if found and all(side == other for side, _, _ in found):
            line, text = found[0][2] or node.lineno, " and ".join(dict.fromkeys(one[1] for one in found))
            right = " + ".join(dict.fromkeys(mirrored(one[1]) for one in found))
            message = "`%s` is %s, which is to the %s: a scan counts from straight ahead to the left" % (
                name,
                text,
                other,
            )
            yield slip(
                line,
                "wrong-value",
                message,
                "on line %d, write `%s` in place of `%s`" % (line, right, text),
                "side",
            )


def overlapping_sides(tree):
    """`right = min(ranges[:-45])` beside `left = min(ranges[:45])`: nearly all ranges, those to the left too."""
    found = {}
    for node in all_of(tree, ast.Assign):
        reads = [
            n for n in ast.walk(node.value) if isinstance(n, ast.Subscript) and isinstance(n.slice, ast.Slice)
        ]
        word = side_in(dotted(node.targets[0]))
        if (
            word
            and len(reads) == 1
            and is_ranges(reads[0].value)
            and not ACTS.search(dotted(node.targets[0]))
        ):
            found[word] = (node, dotted(reads[0].value), *(signed(one) for one in ends_of(reads[0].slice)))
    if len(found) < 2 or found["left"][1] != found["right"][1]:
        return
    for word, other in (("left", "right"), ("right", "left")):
        (node, name, first, last), (_, _, begin, end) = found[word], found[other]
        if not first and not begin and last is not None and last < 0 < (end or 0):
            read, right = "[:%d]" % last, "[%d:]" % last
        elif last is None and end is None and (begin or 0) < 0 < (first or 0):
            read, right = "[%d:]" % first, "[:%d]" % first
        else:
            continue
        message = "`%s%s` has nearly all ranges, those to the %s too" % (name, read, other)
        fix = "on line %d, write `%s%s` in place of `%s%s`" % (node.lineno, name, right, name, read)
        yield slip(node.lineno, "wrong-value", message, fix, "side")


def ends_of(key):
    return key.lower, key.upper


def decides(value):
    return any(isinstance(n, (ast.Compare, ast.BoolOp, ast.IfExp)) for n in ast.walk(value))


def side_in(name):
    """Return the one side that a name says, "" of none or both."""
    words = {"".join(found).lower() for found in WORDS.findall(name.rpartition(".")[2])}
    return words.pop() if len(words) == 1 else ""


def sides_read(value, once, constant):
    """Return the side, the text and the line of each range that a value is made of, or of the degrees that it is;
    nothing where any of them is not known, or to no side."""
    reads = [n for n in ast.walk(value) if isinstance(n, ast.Subscript)]
    found = []
    if constant and not reads:
        number = index_in(value, once)
        found = [(side_of(number, number), number, value.lineno)] if number is not None else []
    for one in reads:
        name = dotted(one.value)
        if not (
            is_ranges(one.value)
            or is_ranges(once.get(name))
            or name.rpartition(".")[2] in ("ranges", "beams")
        ):
            continue
        key = getattr(one.slice, "value", one.slice) if type(one.slice).__name__ == "Index" else one.slice
        ends = (key.lower, key.upper) if isinstance(key, ast.Slice) else (key, key)
        numbers = ["" if end is None else index_in(end, once) for end in ends]
        if None in numbers or getattr(key, "step", None) is not None:
            return []
        text = "%s[%s]" % (name, ":".join(numbers) if isinstance(key, ast.Slice) else numbers[0])
        found.append((side_of(*numbers), text, one.lineno))
    return found if all(side for side, _, _ in found) else []


def side_of(first, last):
    """Return the side to which indexes of a scan, or degrees, from the first to the last look; "" where both do."""
    try:
        start, end = int(first or 0), int(last or ROUND)
    except ValueError:  # a part of the count
        return ""
    middle = (start + end) / 2 if start <= end else None
    if middle is None or end - start > ROUND / 2:
        return ""
    turned = middle % ROUND
    low, high = ASIDE
    return "left" if low <= turned <= high else "right" if ROUND - high <= turned <= ROUND - low else ""


def mirrored(text):
    """Return an index, a slice or degrees of the other side: `ranges[225:315]` of `ranges[45:135]`."""
    name, bracket, inside = text.rstrip("]").partition("[")
    numbers = inside.split(":") if bracket else [name]
    if len(numbers) == 1:
        number = int(numbers[0])
        return "%s[%d]" % (name, (ROUND - number) % ROUND) if bracket else str(-number)
    start, end = int(numbers[0] or 0), int(numbers[1] or ROUND)
    start, end = ROUND - end, ROUND - start
    if start >= ROUND:
        start, end = start - ROUND, end - ROUND
    return "%s[%s:%s]" % (name, start or "", "" if end == ROUND else end)


def frames_swapped(tree):
    """`t.header.frame_id = child` beside `t.child_frame_id = parent`."""
    found = {}
    for n in all_of(tree, ast.Assign):
        owner, field = frame_field(n)
        given = dotted(n.value).rpartition(".")[2]
        is_child = bool(re.search("child", given, re.IGNORECASE))
        is_parent = not is_child and bool(re.search("parent", given, re.IGNORECASE))
        if (field == "child" and is_parent) or (field == "parent" and is_child):
            found.setdefault(owner, {})[field] = n
    for one in found.values():
        if len(one) == 2:
            first, second = sorted(one.values(), key=lambda n: n.lineno)
            message = "`header.frame_id` is the parent, and gets `%s`; `child_frame_id` gets `%s`"
            message %= (dotted(one["parent"].value), dotted(one["child"].value))
            fix = "swap the values of lines %d and %d" % (first.lineno, second.lineno)
            yield slip(first.lineno, "wrong-value", message, fix, "frames")


def frame_field(assigned):
    """Return the transform of which a line sets a frame, and which of its two: `child`, `parent`; "" of any other."""
    target = dotted(assigned.targets[0])
    ends = {".child_frame_id": "child", ".header.frame_id": "parent"}
    return next(
        ((target[: -len(end)], field) for end, field in ends.items() if target.endswith(end)), ("", "")
    )


OF_FRAMES = ("sendTransform", "TransformStamped")
LOOK_UPS = ("lookup_transform", "lookupTransform", "can_transform")


def frames_named(tree):
    """Where two texts that may be frames are given next to each other: to a call, or to the two fields of a
    transform."""
    names = {one.name for n in all_of(tree, ast.ImportFrom) for one in n.names}
    if not calls_in(tree, *OF_FRAMES) and OF_FRAMES[1] not in names:
        return
    texts = {}
    for n in all_of(tree, ast.Assign):
        owner, field = frame_field(n)
        if field and text_of(n.value):
            texts.setdefault(owner, []).append(n)
    for pair in texts.values():
        if len(pair) == 2:
            child, parent = sorted(pair, key=lambda n: frame_field(n)[1])
            lines = sorted({parent.lineno, child.lineno})
            both = "lines %d and %d" % (lines[0], lines[-1]) if len(lines) > 1 else ""
            yield slip(lines[0], "frames", text_of(parent.value), both, text_of(child.value))
    for call in all_of(tree, ast.Call):
        words = [text_of(one) for one in [*call.args, *(k.value for k in call.keywords)]]
        if sum(map(bool, words)) == 2 and called_name(call) not in LOOK_UPS:
            first, second = filter(None, words)
            yield slip(call.lineno, "frames", first, "", second)


LENGTHS = re.compile(r"(?i)(?:^|_)(?:side|length|len|dist|distance|leg|edge|metres|meters)(?:_|$)")
TIMES = re.compile(r"(?i)(?:^|_)(?:duration|time|secs|seconds)(?:_|$)")
NUMBERS_LIMIT = 10


def numbers_of_way(tree):
    """`SIDE = 1.0` and `DRIVE_TIME = 5`, where that is the only line that gives the name a value, and a time is read in
    one place: another one may be that of a turn. No slips."""
    given, read = {}, {}
    for node in all_of(tree, ast.Name, ast.Attribute):
        name = dotted(node).rpartition(".")[2]
        count = read if isinstance(node.ctx, ast.Load) else given
        count[name] = count.get(name, 0) + 1
    found = []
    for node in all_of(tree, ast.Assign):
        name, value = dotted(node.targets[0]), getattr(node.value, "value", None)
        short = name.rpartition(".")[2]
        what = "distance" if LENGTHS.search(short) else "time" if TIMES.search(short) else ""
        is_once = (
            given.get(short) == 1 and len(node.targets) == 1 and (what == "distance" or read.get(short) == 1)
        )
        if what and is_once and type(value) in (int, float) and 0 < value < 1e6:
            found.append(slip(node.lineno, "way-number", "%.9g" % value, what, name))
    yield from found[:NUMBERS_LIMIT]
