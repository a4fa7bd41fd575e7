"""Finds mistakes in Python sources that do not run as meant, and repairs their text. The standard library only.

`examine` is the entry; it runs in a child process with limits (`limited_child.py`). Pairs of a file's name and its text
come in; for each, the steps go out (a mistake, and the text that has it repaired), and the names that the last text
uses. Nothing is executed. What does not parse is for `syntax_repair.py`, calls are for `call_repair.py`;
`package/repairs/python.py` puts the answer in words.
"""

from __future__ import annotations

import ast
import builtins
import re
import sys
import warnings
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from itertools import pairwise
from typing import Any

from grader.package.call_repair import (
    with_arguments,
    with_callbacks,
    with_calls,
    with_globals,
    with_lines_turned,
    with_quoted_calls,
    with_values_called,
)
from grader.package.member_repair import with_members
from grader.package.syntax_repair import (
    Step,
    as_python3,
    edited,
    is_docstring,
    last_name,
    lost_head,
    make_readable,
    span_of,
    step_to,
    syntax_error,
    with_line,
)
from grader.wording import is_one_edit

OLD_NAMES = {"raw_input": "input", "xrange": "range", "unicode": "str", "basestring": "str", "unichr": "chr"}
MESSAGES = {
    "std_msgs": "Bool Byte Char ColorRGBA Empty Float32 Float32MultiArray Float64 Float64MultiArray Int16 "
    "Int16MultiArray Int32 Int32MultiArray Int64 Int8 Int8MultiArray String UInt16 UInt32 UInt64 UInt8",
    "geometry_msgs": "Point PoseStamped PoseWithCovarianceStamped Quaternion Twist TwistStamped Vector3 Wrench",
    "nav_msgs": "OccupancyGrid Odometry",
    "sensor_msgs": "CompressedImage Image Imu JointState Joy LaserScan NavSatFix PointCloud2 Range",
}
OBVIOUS_NAMES = {
    **dict.fromkeys(("true", "TRUE"), "True"),
    **dict.fromkeys(("false", "FALSE"), "False"),
    **dict.fromkeys(("null", "NULL", "none", "nil", "nullptr"), "None"),
    **dict.fromkeys(("_name_", "__name", "_name", "name__"), "__name__"),
}
NAME_CHARS_MIN = 4
"""Of shorter names, a letter that is not the same is the larger part."""
SHORT_NAME_CHARS_MIN = 2
"""Names of one letter are different names."""
SIZE = re.compile(r"^U|\d+")
"""What sets number types of one kind apart: `UInt8`, `Int16`."""
SLIP_CHARS = 3
OF_ROS = {
    "rosbag", "roscpp", "rosgraph", "roslaunch", "roslib", "rosmsg", "rosnode", "rosparam", "rospkg", "rosservice",
    "rostopic",
}  # fmt: skip
"""Modules that there are, whose names begin like that of another one."""
MODULES = frozenset({"math", "os", "random", "rospy", "sys", "time"})
NAMES_OF_ROSPY = (
    "AnyMsg DEBUG Duration ERROR FATAL Header INFO MasterProxy Message Publisher ROSException ROSInitException "
    "ROSInternalException ROSInterruptException ROSSerializationException ROSTimeMovedBackwardsException Rate Service "
    "ServiceException ServiceProxy SubscribeListener Subscriber Time Timer TransportException TransportInitError "
    "TransportTerminated WARN client core delete_param exceptions get_caller_id get_master get_name get_namespace "
    "get_node_uri get_param get_param_cached get_param_names get_published_topics get_ros_root get_rostime get_time "
    "get_topic_class has_param impl init_node is_shutdown logdebug logdebug_once logdebug_throttle logerr logerr_once "
    "logerr_throttle logfatal logfatal_once logfatal_throttle loginfo loginfo_once loginfo_throttle logout logwarn "
    "logwarn_once logwarn_throttle msg msproxy myargv names numpy_msg on_shutdown parse_rosrpc_uri remap_name "
    "resolve_name rostime search_param service set_param signal_shutdown sleep spin timer topics wait_for_message "
    "wait_for_service"
)
ROSPY = frozenset(NAMES_OF_ROSPY.split())
LOOPED = frozenset({"is_shutdown", "sleep", "spin"})
OF_TWO_FRAMES = {"lookup_transform", "can_transform", "lookupTransform", "canTransform", "waitForTransform"}
ROLES = {
    "Publisher": "publisher",
    "Subscriber": "subscriber",
    **dict.fromkeys(("Service", "SimpleActionServer", "ActionServer"), "server"),
    **dict.fromkeys(("ServiceProxy", "wait_for_service", "SimpleActionClient", "ActionClient"), "client"),
    "init_node": "node",
    "get_param": "param",
    "has_param": "param",
    "set_param": "set-param",
    "delete_param": "set-param",
}


def examine(files: list[list[str]], types: list[str], site: str) -> Iterator[dict[str, Any]]:
    """Yield for each pair of name and text its steps and its names. `types` are message types that the lab uses, `site`
    is the folder that has fissix."""
    warnings.simplefilter("ignore")
    sys.path.append(site)
    for file, text in files:
        try:
            steps = list(_steps(text, types))
            names = _names(steps[-1]["text"] if steps else text)
        except (RecursionError, MemoryError):
            steps, names = [], []
        yield {"file": file, "steps": steps, "names": names}


def _steps(text: str, types: list[str]) -> Iterator[Step]:
    for step in make_readable(text):
        text = step["text"]
        yield step
    if syntax_error(text) is None:
        for repair in (
            _without_old_names,
            _without_old_print,
            lambda t: _with_modules(t, types),
            lambda t: _with_classes(t, types),
            lambda t: _with_imports(t, types),
            lambda t: with_members(t, ROSPY),
            _with_quotes,
            _with_names,
            _with_attributes,
            with_values_called,
            with_calls,
            with_quoted_calls,
            with_callbacks,
            with_arguments,
            with_globals,
            with_lines_turned,
            _with_start,
            _with_main,
            _with_spin,
        ):
            for step in repair(text):
                text = step["text"]
                yield step


# ---- what parses, and is not meant


def _without_old_names(text: str) -> Iterator[Step]:
    tree, lines = ast.parse(text), text.split("\n")
    bound = _bound(tree)
    uses = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id in OLD_NAMES and n.id not in bound]
    spans = [(span, OLD_NAMES[n.id]) for n in uses if (span := span_of(lines, n))]
    if spans:
        names = ", ".join(sorted({n.id for n in uses}))
        after = edited(text, [(*span, new) for span, new in spans])
        yield from step_to("old-name", min(n.lineno for n in uses), text, after, names)


def _without_old_print(text: str) -> Iterator[Step]:
    """`print >>file, x` parses, as a shift."""
    for node in ast.walk(ast.parse(text)):
        value = node.value if isinstance(node, ast.Expr) else None
        first = value.elts[0] if isinstance(value, ast.Tuple) and value.elts else value
        if (
            isinstance(first, ast.BinOp)
            and isinstance(first.op, ast.RShift)
            and last_name(first.left) == "print"
        ):
            for after in as_python3(text.split("\n"), first.lineno - 1):
                for step in step_to("old-name", first.lineno, text, after, "print >>"):
                    text = step["text"]
                    yield step


def _bound(tree: ast.Module) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            found.add(node.id)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.arg):
            found.add(node.arg)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found.update((a.asname or a.name).partition(".")[0] for a in node.names)
        elif isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar):
            found.add(node.name or "")
    return found


def _with_modules(text: str, types: list[str]) -> Iterator[Step]:
    """`from std_msgs import String`, `from std_msg.msg import String` and `import std_msgs.msg.String`, for
    `from std_msgs.msg import String`."""
    known = {package: set(names.split()) for package, names in MESSAGES.items()}
    for package, _, name in (kind.partition("/") for kind in types):
        known.setdefault(package, set()).add(name)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for step in _with_class_imported(text, node, known):
                text = step["text"]
                yield step
            continue
        if not isinstance(node, ast.ImportFrom) or node.level or not node.module:
            continue
        module = node.module
        package, _, inner = module.partition(".")
        if module.endswith("msg") and module.removesuffix("msg") in known:
            package, inner = module.removesuffix("msg"), ""
        names = {alias.name for alias in node.names}
        misspelt = (
            inner not in ("", "msg") and not is_one_edit(inner.lower(), "msg") and inner.lower() != "msg"
        )
        if misspelt or (package in known and inner == "msg"):
            continue
        near = package if package in known else next(iter(get_close_matches(package, known, 1, 0.85)), "")
        lines, at = text.split("\n"), node.lineno - 1
        after = re.sub(rf"from\s+{re.escape(module)}\b", f"from {near}.msg", lines[at], count=1)
        if near and all(_is_near_one(name, known[near]) for name in names) and after != lines[at]:
            for step in step_to("module", at + 1, text, with_line(lines, at, after), module):
                text = step["text"]
                yield step


def _is_near_one(name: str, known: Collection[str]) -> bool:
    """Return whether it is one of the classes, or a slip in one, which `_with_classes` puts right."""
    return name in known or any(
        is_one_edit(name.lower(), one.lower()) or name.lower() == one.lower() for one in known
    )


def _with_classes(text: str, types: list[str]) -> Iterator[Step]:
    """`from std_msgs.msg import Sting` where the script uses `String`, which nothing imports; or where it uses `Sting`
    too, and the lab's own type is meant, or the same word in other letters."""
    tree, lines = ast.parse(text), text.split("\n")
    uses = [n for n in ast.walk(tree) if isinstance(n, ast.Name)]
    known = {name for names in MESSAGES.values() for name in names.split()} | {
        t.partition("/")[2] for t in types
    }
    unbound = {n.id for n in uses} & known - _bound(tree)
    for node in ast.walk(tree):
        package, _, module = (getattr(node, "module", "") or "").partition(".")
        if not isinstance(node, ast.ImportFrom) or module != "msg":
            continue
        of_lab = {name for own, _, name in (t.partition("/") for t in types) if own == package}
        same = {name.lower(): name for name in {*MESSAGES.get(package, "").split(), *of_lab}}
        for alias in (one for one in node.names if one.name not in known and one.asname is None):
            used = [n for n in uses if n.id == alias.name]
            other_letters = [name for name in sorted(unbound) if name.lower() == alias.name.lower()]
            right = other_letters or get_close_matches(alias.name, unbound, 1, 0.8) if not used else []
            # of other packages not all classes are known: Pose may be there beside Pose2D
            near = get_close_matches(alias.name, of_lab, 1, 0.75) if package == "std_msgs" else []
            meant = next(iter(right or near), same.get(alias.name.lower(), ""))
            if not meant or (not right and meant in unbound):
                continue  # the import of what is used is missing
            spans = [span_of(lines, place) for place in (alias, *used)]  # type: ignore[arg-type] # it has a place too
            edits = [(*span, meant) for span in spans if span is not None]
            yield from step_to("name", alias.lineno, text, edited(text, edits), alias.name)
            return


def _with_class_imported(text: str, node: ast.Import, known: dict[str, set[str]]) -> Iterator[Step]:
    parts = node.names[0].name.split(".")
    package, module, name = parts if len(parts) == 3 else ("", "", "")
    lines, at = text.split("\n"), node.lineno - 1
    if len(node.names) > 1 or node.names[0].asname or module != "msg" or name not in known.get(package, ()):
        return
    whole = f"{package}.msg.{name}"
    used = any(isinstance(n, ast.Attribute) and ast.unparse(n) == whole for n in ast.walk(ast.parse(text)))
    right = f"import {package}.msg" if used else f"from {package}.msg import {name}"
    after = re.sub(rf"import\s+{re.escape(whole)}\b", right, lines[at], count=1)
    yield from step_to("module", at + 1, text, with_line(lines, at, after), whole)


def _with_imports(text: str, types: list[str]) -> Iterator[Step]:
    tree = ast.parse(text)
    bound = _bound(tree)
    if "*" in bound:
        return
    packages = {name: package for package, names in MESSAGES.items() for name in names.split()}
    packages |= {name: package for package, _, name in (kind.partition("/") for kind in types)}
    parts = [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    modules = {last_name(n.value) for n in parts}
    of_messages = {
        last_name(n.value): f"{last_name(n.value)}.{n.attr}" for n in parts if n.attr in ("msg", "srv")
    }
    loaded = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    missing = {n.id: n.lineno for n in sorted(loaded, key=lambda n: -n.lineno) if n.id not in bound}
    for name in sorted(missing, key=lambda name: (missing[name], name)):
        if hasattr(builtins, name):
            continue
        if name in MODULES and name in modules:
            after = _import_meant(text, name) or _add_import(text, f"import {name}", "", "")
        elif name in of_messages:
            after = _add_import(text, f"import {of_messages[name]}", "", "")
        elif name in packages and (meant := _imported_instead(tree, name, packages[name], types)):
            yield from _with_class(text, name, meant)
            return
        elif name in packages:
            after = _add_import(
                text, f"from {packages[name]}.msg import {name}", f"{packages[name]}.msg", name
            )
        else:
            continue
        for step in step_to("import", missing[name], text, after, name):
            text = step["text"]
            yield step


def _imported_instead(tree: ast.Module, name: str, package: str, types: list[str]) -> str:
    """Return the lab's type that the script imports and never uses, where it uses another size of it: Int8 for Int16;
    "" where there is none."""
    of_lab = {kind.partition("/")[2] for kind in types if kind.startswith(f"{package}/")}
    froms = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module == f"{package}.msg"]
    imported = {a.name for n in froms for a in n.names if a.asname is None}
    used = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    same = (one for one in sorted(imported & of_lab - used) if SIZE.sub("", one) == SIZE.sub("", name))
    return "" if name in of_lab else next(same, "")


def _with_class(text: str, name: str, meant: str) -> Iterator[Step]:
    """`Int8` in place of each `Int16`."""
    lines = text.split("\n")
    uses = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Name) and n.id == name]
    spans = [span for n in uses if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(*span, meant) for span in spans])
        yield from step_to("name", min(spans)[0] + 1, text, after, name)


def _import_meant(text: str, name: str) -> str:
    """Return the text with `import rospy` in place of `import ros`, a module that there is none of and that nothing in
    the script uses; "" where no line imports such a one."""
    tree, lines = ast.parse(text), text.split("\n")
    used = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    for one in (n for n in tree.body if isinstance(n, ast.Import) and len(n.names) == 1):
        module = one.names[0].name
        alike = (
            module[:SLIP_CHARS] == name[:SLIP_CHARS] or module.lower() == name or is_one_edit(module, name)
        )
        is_slip = alike and module not in OF_ROS and module not in used
        if is_slip and one.names[0].asname is None and lines[one.lineno - 1].strip() == f"import {module}":
            return with_line(lines, one.lineno - 1, lines[one.lineno - 1].replace(module, name))
    return ""


def _add_import(text: str, statement: str, module: str, name: str) -> str:
    """The text with one more import: in the line that imports from this module, or below the last import."""
    body, lines = ast.parse(text).body, text.split("\n")
    imports = [s for s in body if isinstance(s, ast.Import | ast.ImportFrom)]
    for one in imports:
        if module and isinstance(one, ast.ImportFrom) and one.module == module and not one.level:
            other = next((a for a in one.names if a.name.lower() == name.lower() and not a.asname), None)
            place = span_of(lines, other) if other is not None else None  # type: ignore[arg-type] # as below
            if place is not None:
                return edited(text, [(*place, name)])
            span = span_of(lines, one.names[-1])  # type: ignore[arg-type] # an alias has a place too
            if span is not None:
                return edited(text, [(span[0], span[2], span[2], f", {name}")])
    first = next((s for s in body if not is_docstring(s)), None)
    at = (imports[-1].end_lineno or 0) if imports else (first.lineno - 1 if first else len(lines))
    return "\n".join([*lines[:at], statement, *lines[at:]])


def _with_names(text: str) -> Iterator[Step]:
    """`true`, `rospu` and `Sting`: a name that nothing in the file has, and one alone is nearly the same."""
    tree, lines = ast.parse(text), text.split("\n")
    bound = _bound(tree)
    if "*" in bound or any(isinstance(n, ast.Try) and _catches_names(n) for n in ast.walk(tree)):
        return
    shared = {name for one in tree.body for name in _bound_by(one)}
    known = bound | set(dir(builtins)) | {"__file__"}
    for block in (n for n in tree.body if not isinstance(n, ast.Import | ast.ImportFrom)):
        own = shared | (_bound(ast.Module([block], [])) if isinstance(block, ast.FunctionDef) else set())
        missing = [n for n in ast.walk(block) if isinstance(n, ast.Name) and n.id not in known]
        stated = (n.value for n in ast.walk(block) if isinstance(n, ast.Expr))
        alone = {n.id for n in stated if isinstance(n, ast.Name) and _is_slip(n.id.lower(), "pass")}
        for name in dict.fromkeys(n.id for n in missing):
            guards = name == "name" and any(_is_guard(n) for n in tree.body)
            meant = OBVIOUS_NAMES.get(name) or (guards and "__name__") or _meant_by(name, own)
            meant = meant or (name in alone and "pass") or ""
            spans = [span for n in missing if n.id == name and (span := span_of(lines, n))]
            if meant and spans:
                after = edited(text, [(*span, meant) for span in spans])
                for step in step_to("name", spans[0][0] + 1, text, after, name):
                    text, lines = step["text"], step["text"].split("\n")
                    yield step
                    yield from _with_names(text)
                    return


def _is_guard(node: ast.stmt) -> bool:
    """Return whether a statement begins the script's own part, `if name == 'main':` too."""
    test = node.test if isinstance(node, ast.If) else None
    word = test.comparators[0] if isinstance(test, ast.Compare) else None
    return isinstance(word, ast.Constant) and str(word.value).strip("_ ").lower() == "main"


def _with_quotes(text: str) -> Iterator[Step]:
    """`Publisher(chatter, …)`, for `Publisher('chatter', …)`: a name without a value, where ROS is told one; and
    `details[name]`, where the name stands for a key of parameters."""
    tree, lines = ast.parse(text), text.split("\n")
    known = _bound(tree) | set(dir(builtins))
    if "*" in known:
        return
    stored: dict[str, list[int]] = {}
    for name in (n for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)):
        stored.setdefault(name.id, []).append(name.lineno)
    texts = [n for n in _texts_of_ros(tree) if isinstance(n, ast.Name)]
    missing = [n for n in texts if n.id not in known and not _meant_by(n.id, set(stored))]
    assigned = [n for n in ast.walk(tree) if isinstance(n, ast.Assign)]
    own = {id(inner): last_name(n.targets[0]) for n in assigned for inner in ast.walk(n.value)}
    keys = [
        n
        for n in _keys_of_parameters(tree)
        if n.id not in known or (stored.get(n.id) == [n.lineno] and own.get(id(n)) == n.id)
    ]
    spans = [(span, n.id) for n in (*missing, *keys) if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(*span, f"'{name}'") for span, name in spans])
        words = ", ".join(dict.fromkeys(name for _, name in sorted(spans)))
        yield from step_to("quotes", min(spans)[0][0] + 1, text, after, words)


def _texts_of_ros(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield what stands where ROS is told the name of a node, a topic, a parameter or a frame."""
    yield from (node for _, node in _named_texts(tree))
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and last_name(node.func) in OF_TWO_FRAMES:
            yield from node.args[:2]
        elif isinstance(node, ast.Assign) and last_name(node.targets[0]) in ("frame_id", "child_frame_id"):
            yield node.value


def _keys_of_parameters(tree: ast.Module) -> Iterator[ast.Name]:
    """Yield the names in the brackets behind what `get_param(…)` gives."""
    read = {
        ast.unparse(n.targets[0])
        for n in ast.walk(tree)
        if isinstance(n, ast.Assign)
        and isinstance(n.value, ast.Call)
        and last_name(n.value.func) == "get_param"
    }
    for node in ast.walk(tree):
        root: ast.expr | None = node if isinstance(node, ast.Subscript) else None
        while isinstance(root, ast.Subscript):
            root = root.value
        of_call = isinstance(root, ast.Call) and last_name(root.func) == "get_param"
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name) and root is not None:
            yield from [node.slice] if of_call or ast.unparse(root) in read else []


def _meant_by(name: str, own: set[str]) -> str:
    """Return the one name of the script's own that is meant by one that has no value; "" where there is not one."""
    if always := [one for one in ("__name__", "True", "False", "None") if is_one_edit(name, one)]:
        return always[0]
    longer = [one for one in own if len(one) >= NAME_CHARS_MIN]
    near = get_close_matches(name, longer, 2, 0.8) if len(name) >= NAME_CHARS_MIN else []
    if len(near) == 1 or len(name) < SHORT_NAME_CHARS_MIN:
        return near[0] if near else ""
    slips = [one for one in own if len(one) >= SHORT_NAME_CHARS_MIN and _is_slip(name, one)]
    return slips[0] if len(slips) == 1 else ""


def _is_slip(name: str, other: str) -> bool:
    """Return whether two short names differ by capitals, by a letter that is missing, or by two that are exchanged; by
    another letter they are different names."""
    one, two = name.lower(), other.lower()
    return one == two or (is_one_edit(one, two) and (len(one) != len(two) or sorted(one) == sorted(two)))


def _bound_by(statement: ast.stmt) -> set[str]:
    """Return the names that a statement of the script gives a value to, none of those within functions and classes."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return {statement.name}
    return _bound(ast.Module([statement], []))


def _catches_names(block: ast.Try) -> bool:
    kinds = [ast.unparse(handler.type) if handler.type else "" for handler in block.handlers]
    return any("NameError" in kind for kind in kinds)


def _with_attributes(text: str) -> Iterator[Step]:
    """`rospy.subscriber(…)`, for `rospy.Subscriber(…)`: what rospy lacks, and has nearly under that name."""
    lines = text.split("\n")
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Attribute) or last_name(node.value) != "rospy" or node.attr in ROSPY:
            continue
        plain = {name.lower(): name for name in ROSPY}
        if isinstance(node.ctx, ast.Store):
            continue  # a value is given to it: `rospy.rate = 10`
        near = [
            *get_close_matches(node.attr, ROSPY, 1, 0.85),
            *(one for one in ROSPY if is_one_edit(node.attr, one)),
        ]
        meant = plain.get(node.attr.lower()) or next(iter(near), "")
        span = span_of(lines, node)
        if meant and span is not None and not node.attr.startswith("_"):
            line, _, end = span
            after = edited(text, [(line, end - len(node.attr), end, meant)])
            for step in step_to("attribute", line + 1, text, after, f"rospy.{node.attr}"):
                text, lines = step["text"], step["text"].split("\n")
                yield step


def _with_start(text: str) -> Iterator[Step]:
    """A function that goes on after two blank lines: the first line of the next one is missing; or, where it makes the
    node or calls a function there, the line that begins the script's own part."""
    tree, lines = ast.parse(text), text.split("\n")
    functions = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
    plain = (ast.FunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom)
    started = any(
        isinstance(n, ast.Call) for one in tree.body if not isinstance(one, plain) for n in ast.walk(one)
    )
    for function in functions:
        for before, after in pairwise(function.body):
            if after.lineno - (before.end_lineno or after.lineno) <= BLANK_LINES:
                continue
            rest = ast.Module(function.body[function.body.index(after) :], [])
            calls = {last_name(n.func) for n in ast.walk(rest) if isinstance(n, ast.Call)}
            head = lost_head(text, ast.unparse(rest))
            begins = not started and calls & {"init_node", *(one.name for one in functions)}
            line = head or ("if __name__ == '__main__':" if begins else "")
            changed = "\n".join([*lines[: after.lineno - 1], line, *lines[after.lineno - 1 :]])
            if line and syntax_error(changed) is None:
                yield from step_to("start", after.lineno, text, changed, function.name)
                return


BLANK_LINES = 2
"""So many stand between a function and what comes after it (PEP 8)."""


def _with_main(text: str) -> Iterator[Step]:
    """A script that calls nothing, or only where `__name__` has a value that it never has."""
    tree, lines = ast.parse(text), text.split("\n")
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare) and isinstance(node.left, ast.Name) and node.left.id == "__name__":
            word, span = node.comparators[0], span_of(lines, node.comparators[0])
            if (
                isinstance(word, ast.Constant)
                and (
                    str(word.value).strip("_ ").lower() == "main" or is_one_edit(str(word.value), "__main__")
                )
                and span
            ):
                if word.value != "__main__":
                    after = edited(text, [(*span, "'__main__'")])
                    yield from step_to("guard", node.lineno, text, after, str(word.value))
                return
    runs = (
        s
        for s in tree.body
        if not isinstance(s, ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom)
    )
    if any(isinstance(n, ast.Call) for s in runs for n in ast.walk(s)):
        return
    makers = [
        f
        for f in tree.body
        if isinstance(f, ast.FunctionDef)
        and len(f.args.args) == len(f.args.defaults)
        and any(isinstance(n, ast.Call) and last_name(n.func) == "init_node" for n in ast.walk(f))
    ]
    named = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    if len(makers) == 1 and makers[0].name not in named:
        after = f"{text.rstrip()}\n\n\nif __name__ == '__main__':\n    {makers[0].name}()\n"
        yield from step_to("main", makers[0].lineno, text, after, makers[0].name)


def _with_spin(text: str) -> Iterator[Step]:
    """A node that only waits for messages, and ends at once."""
    tree = ast.parse(text)
    calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call)]
    waits = [c for c in calls if last_name(c.func) in {"Subscriber", "Service", "Timer"}]
    rospy = next((a.asname or a.name for n in ast.walk(tree) if isinstance(n, ast.Import)
                  for a in n.names if a.name == "rospy"), "")  # fmt: skip
    loops = any(isinstance(n, ast.While) for n in ast.walk(tree))
    makes_node = any(last_name(c.func) == "init_node" for c in calls)
    if not waits or loops or not rospy or not makes_node or LOOPED & {last_name(c.func) for c in calls}:
        return
    lines = text.split("\n")
    block = _last_block(tree, waits)
    last = block[-1]
    before = isinstance(last, ast.Return) or (len(block) == 1 and isinstance(last, ast.Pass))
    first_line = lines[last.lineno - 1]
    indentation = first_line[: len(first_line) - len(first_line.lstrip())]
    at = last.lineno - 1 if before else last.end_lineno or last.lineno
    after = "\n".join([*lines[:at], f"{indentation}{rospy}.spin()", *lines[at:]])
    yield from step_to("spin", at + 1, text, after, f"{rospy}.spin()")


def _last_block(tree: ast.Module, waits: list[ast.Call]) -> list[ast.stmt]:
    """The body in which the node would have to stay: of the function that subscribes, or else of the script."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and any(c in set(ast.walk(node)) for c in waits):
            return node.body
    block = tree.body
    while isinstance(block[-1], ast.If | ast.Try):
        block = block[-1].body
    return block


# ---- names that ROS is told


def _names(text: str) -> list[dict[str, Any]]:
    """Return the texts that name a topic, a node or a parameter, each with its role, value and place."""
    if syntax_error(text) is not None:
        return []
    tree, lines = ast.parse(text), text.split("\n")
    constants, keys = _constants(tree), _keys_read(tree)
    found = []
    for role, node in _named_texts(tree):
        given = constants.get(node.id) if isinstance(node, ast.Name) else node
        if not isinstance(given, ast.Constant) or not isinstance(given.value, str):
            continue
        span = span_of(lines, given)
        if span is not None and _is_literal(lines[span[0]][span[1] : span[2]], given.value):
            place = {"line": span[0] + 1, "start": span[1], "end": span[2]}
            found.append({"role": role, "value": given.value, **place, "keys": keys.get(id(node), [])})
    return found


def _keys_read(tree: ast.Module) -> dict[int, list[str]]:
    """Return for the first argument of a call, by its identity, the keys that are read of what the call gives:
    `first` of `get_param('name')['first']`, and of `name['first']` below `name = get_param('name')`."""
    calls = {ast.unparse(n.targets[0]): n.value for n in ast.walk(tree) if isinstance(n, ast.Assign)}
    found: dict[int, list[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):
            of = node.value if isinstance(node.value, ast.Call) else calls.get(ast.unparse(node.value))
            if isinstance(of, ast.Call) and of.args and isinstance(node.slice.value, str):
                found.setdefault(id(of.args[0]), []).append(node.slice.value)
    return found


def _named_texts(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    for call in ast.walk(tree):
        if isinstance(call, ast.Subscript) and isinstance(call.slice, ast.Constant):
            yield "key", call.slice
        if not isinstance(call, ast.Call):
            continue
        role = ROLES.get(last_name(call.func), "")
        keyword = "param_name" if role.endswith("param") else "name"
        given = [*call.args[:1], *(k.value for k in call.keywords if k.arg == keyword)]
        if role and given:
            yield role, given[0]


def _constants(tree: ast.Module) -> dict[str, ast.expr]:
    """Names that are given one value, once, in the whole file."""
    found: dict[str, list[ast.expr]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    found.setdefault(target.id, []).append(node.value)
    return {name: values[0] for name, values in found.items() if len(values) == 1}


def _is_literal(source: str, value: str) -> bool:
    return len(source) < 300 and source.endswith((f"'{value}'", f'"{value}"')) and "\n" not in value
