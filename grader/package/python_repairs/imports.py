"""Repairs of a script's imports, and of the classes of messages that it names with their module.

The text of a script that parses comes in, and the steps go out that repair it, as in `examine.py`. It runs in a
child process: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Collection, Iterator
from difflib import get_close_matches

from grader.installable import MODULE_OF
from grader.package.python_repairs.blocks import with_line
from grader.package.python_repairs.names import bound_in, meant_by
from grader.package.python_repairs.syntax import (
    Step,
    edited,
    is_docstring,
    last_name,
    nodes_in,
    span_of,
    step_to,
    tree_of,
)
from grader.wording import is_one_edit, join_words

MESSAGES = {
    "std_msgs": "Bool Byte Char ColorRGBA Empty Float32 Float32MultiArray Float64 Float64MultiArray Int16 "
    "Int16MultiArray Int32 Int32MultiArray Int64 Int8 Int8MultiArray String UInt16 UInt32 UInt64 UInt8",
    "geometry_msgs": "Point PoseStamped PoseWithCovarianceStamped Quaternion Twist TwistStamped Vector3 Wrench",
    "nav_msgs": "OccupancyGrid Odometry",
    "sensor_msgs": "CompressedImage Image Imu JointState Joy LaserScan NavSatFix PointCloud2 Range",
}
OTHERS_OF_STD = {
    *("Duration", "Header", "Int64MultiArray", "MultiArrayDimension", "MultiArrayLayout", "Time"),
    *(f"UInt{size}MultiArray" for size in (8, 16, 32, 64)),
}
"""Classes of std_msgs of which a name alone does not say that they are meant."""
SIZE = re.compile(r"^U|\d+")
"""What sets number types of one kind apart: `UInt8`, `Int16`."""
SLIP_CHARS = 3
OF_ROS = {
    "rosbag", "roscpp", "rosgraph", "roslaunch", "roslib", "rosmsg", "rosnode", "rosparam", "rospkg", "rosservice",
    "rostopic",
}  # fmt: skip
"""Modules that there are, whose names begin like that of another one."""
MODULES_OF_MESSAGES = ("point_cloud2",)
"""Modules beside the `msg` of a package of messages, called nearly like a class."""
NO_MESSAGES = "messages are not imported from {}"
SUFFIX = "the module of {} is called {}"
OF_ROSPY = frozenset({
    "Duration", "Publisher", "ROSException", "ROSInterruptException", "Rate", "Service", "ServiceException",
    "ServiceProxy", "Subscriber", "Time", "Timer", "get_caller_id", "get_name", "get_param", "get_rostime",
    "get_time", "init_node",
    "is_shutdown", "logdebug", "logerr", "loginfo", "logwarn", "on_shutdown", "set_param", "signal_shutdown", "sleep",
    "spin", "wait_for_message", "wait_for_service",
})  # fmt: skip
"""What scripts import from rospy."""
MODULES = frozenset({"math", "os", "random", "rospy", "sys", "time"})


def without_suffixes(text: str, types: list[str]) -> Iterator[Step]:
    """`import talker.py` for `import talker`, wherever the code has it; then what else is wrong with imports."""
    named = [n for n in nodes_in(tree_of(text)) if isinstance(n, ast.Import | ast.ImportFrom | ast.Attribute)]
    places = {name: n.lineno for n in reversed(named) if (name := _file_of(n))}
    for name, line in sorted(places.items(), key=lambda one: one[1]):
        lines = text.split("\n")
        for number in {n.lineno - 1 for n in named if _file_of(n) or ast.unparse(n) == name}:
            lines[number] = re.sub(rf"(?<![\w.]){re.escape(name)}\b", name.removesuffix(".py"), lines[number])
        why = SUFFIX.format(name, name.removesuffix(".py"))
        for step in step_to("module", line, text, "\n".join(lines), why):
            text = step["text"]
            yield step
    yield from with_modules(text, types)


def _file_of(node: ast.AST) -> str:
    """Return what an import names with the `.py` of its file, `talker.py`; "" of any other."""
    names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
    names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
    return next((name for name in names if name.endswith(".py")), "")


def with_modules(text: str, types: list[str]) -> Iterator[Step]:
    """`from std_msgs import String`, `from std_msg.msg import String` and `import std_msgs.msg.String`, for
    `from std_msgs.msg import String`."""
    known = {package: set(names.split()) for package, names in MESSAGES.items()}
    for package, _, name in (kind.partition("/") for kind in types):
        known.setdefault(package, set()).add(name)
    for node in nodes_in(tree_of(text)):
        if isinstance(node, ast.Import):
            for step in (*_with_class_imported(text, node, known), *_with_inner_module(text, node)):
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
        misspelt = inner.lower() not in ("", "msg") and not is_one_edit(inner.lower(), "msg")
        if misspelt or (package in known and inner == "msg"):
            continue
        near = package if package in known else next(iter(get_close_matches(package, known, 1, 0.85)), "")
        lines, at = text.split("\n"), node.lineno - 1
        after = re.sub(rf"from\s+{re.escape(module)}\b", f"from {near}.msg", lines[at], count=1)
        if near and all(_is_near_one(name, known[near]) for name in names) and after != lines[at]:
            for step in step_to(
                "module", at + 1, text, with_line(lines, at, after), NO_MESSAGES.format(module)
            ):
                text = step["text"]
                yield step


def _is_near_one(name: str, known: Collection[str]) -> bool:
    """Return whether it is one of the classes, or a slip in one, which `with_classes` puts right."""
    slips = [one.lower() for one in known if name not in MODULES_OF_MESSAGES]
    return name in known or any(is_one_edit(name.lower(), one) or name.lower() == one for one in slips)


def with_classes(text: str, types: list[str]) -> Iterator[Step]:
    """`from std_msgs.msg import Sting` where the script uses `String`, which nothing imports; or where it uses `Sting`
    too, and the lab's own type is meant, or the same word in other letters."""
    tree, lines = tree_of(text), text.split("\n")
    uses = [n for n in nodes_in(tree) if isinstance(n, ast.Name)]
    known = {name for names in MESSAGES.values() for name in names.split()}
    known |= {t.partition("/")[2] for t in types}
    unbound = {n.id for n in uses} & known - bound_in(tree)
    for node in nodes_in(tree):
        package, _, module = (getattr(node, "module", "") or "").partition(".")
        if not isinstance(node, ast.ImportFrom) or module != "msg":
            continue
        of_lab = {name for own, _, name in (t.partition("/") for t in types) if own == package}
        same = {name.lower(): name for name in {*MESSAGES.get(package, "").split(), *of_lab}}
        places: list[tuple[ast.AST, str]] = []
        for alias in (one for one in node.names if one.name not in known and one.asname is None):
            used = [n for n in uses if n.id == alias.name]
            other_letters = [name for name in sorted(unbound) if name.lower() == alias.name.lower()]
            alike = get_close_matches(alias.name, unbound, 1, 0.8)
            alike = alike or [one for one in sorted(unbound) if is_one_edit(alias.name, one)]
            right = other_letters or alike if not used else []
            # of other packages not all classes are known: Pose may be there beside Pose2D
            near = get_close_matches(alias.name, of_lab, 1, 0.75) if package == "std_msgs" else []
            meant = next(iter(right or near), same.get(alias.name.lower(), ""))
            if not meant or (not right and meant in unbound):
                continue  # the import of what is used is missing
            places += [(place, meant) for place in (alias, *used)]
        if places:
            spans = [(span_of(lines, place), meant) for place, meant in places]  # type: ignore[arg-type] # it has a place
            edits = [(*span, meant) for span, meant in spans if span is not None]
            first = next(one for one in node.names if one is places[0][0])
            yield from step_to("name", first.lineno, text, edited(text, edits), first.name)
            return


def _with_class_imported(text: str, node: ast.Import, known: dict[str, set[str]]) -> Iterator[Step]:
    tree, lines, at = tree_of(text), text.split("\n"), node.lineno - 1
    for one in node.names:
        parts = one.name.split(".")
        package, module, name = parts if len(parts) == 3 else ("", "", "")
        if one.asname or module != "msg" or name not in known.get(package, ()):
            continue
        used = any(isinstance(n, ast.Attribute) and ast.unparse(n) == one.name for n in nodes_in(tree))
        right = f"import {package}.msg" if used else f"from {package}.msg import {name}"
        after = re.sub(rf"import\s+{re.escape(one.name)}\b", right, lines[at], count=1)
        if others := [ast.unparse(ast.Import([other])) for other in node.names if other is not one]:
            blanks = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
            after = "\n".join(blanks + line for line in (*others, right))
        yield from step_to("module", at + 1, text, with_line(lines, at, after), NO_MESSAGES.format(one.name))
        return


def _with_inner_module(text: str, node: ast.Import) -> Iterator[Step]:
    """`import std_msgs.mgs`, for `import std_msgs.msg`."""
    package, _, inner = node.names[0].name.partition(".")
    lines, at = text.split("\n"), node.lineno - 1
    if package in MESSAGES and is_one_edit(inner.lower(), "msg"):
        after = lines[at].replace(f"{package}.{inner}", f"{package}.msg", 1)
        why = NO_MESSAGES.format(f"{package}.{inner}")
        yield from step_to("module", at + 1, text, with_line(lines, at, after), why)


def with_imports(text: str, types: list[str]) -> Iterator[Step]:
    """The import of what a script uses: the names of rospy, then classes of messages and modules."""
    for step in _with_names_of_rospy(text):
        text = step["text"]
        yield step
    yield from _with_each_import(text, types)


def _with_each_import(text: str, types: list[str]) -> Iterator[Step]:
    tree = tree_of(text)
    bound = bound_in(tree)
    if "*" in bound:
        return
    packages = {name: package for package, names in MESSAGES.items() for name in names.split()}
    packages |= {"Header": "std_msgs", "TransformStamped": "geometry_msgs"}
    packages |= {name: package for package, _, name in (kind.partition("/") for kind in types)}
    parts = [n for n in nodes_in(tree) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    modules = {last_name(n.value) for n in parts}
    of_messages = {last_name(n.value): ast.unparse(n) for n in parts if n.attr in ("msg", "srv")}
    loaded = [n for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    missing = {n.id: n.lineno for n in sorted(loaded, key=lambda n: -n.lineno) if n.id not in bound}
    for name in sorted(missing, key=lambda name: (missing[name], name)):
        if hasattr(builtins, name) or re.search(rf"\.(msg|srv)\s*,\s*{name}\b", text):
            continue  # it is there, or a dot is missing before it
        if name in MODULES and name in modules:
            after = _import_meant(text, name) or _add_import(text, f"import {name}", "", "")
        elif name in of_messages and name not in MESSAGES and meant_by(name, bound & set(MESSAGES)):
            continue  # it is the name that is misspelt
        elif name in of_messages:
            whole = of_messages[name]
            after = _import_meant(text, whole) or _add_import(text, f"import {whole}", "", "")
        elif name in packages and (meant := _imported_instead(tree, name, packages[name], types)):
            yield from _with_class(text, name, meant)
            return
        elif module := f"{packages[name]}.msg" if name in packages else MODULE_OF.get(name):
            after = _add_import(text, f"from {module} import {name}", module, name)
        else:
            continue
        for step in step_to("import", missing[name], text, after, name):
            text = step["text"]
            yield step


def _with_names_of_rospy(text: str) -> Iterator[Step]:
    """`from rospy import …`, with all that a script without rospy takes from it: the line is missing, or a comment."""
    tree, lines = tree_of(text), text.split("\n")
    modules, bound = (
        {one.name for n in nodes_in(tree) if isinstance(n, ast.Import) for one in n.names},
        bound_in(tree),
    )
    named = {
        n.id: n.lineno for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)
    }
    lost = sorted(named.keys() & OF_ROSPY - bound)
    if "init_node" not in lost or "rospy" in modules or "*" in bound:
        return
    in_comments = (re.match(r"#[#\s]*(from\s+rospy\s+import\s.*\binit_node\b.*)", line) for line in lines)
    number, found = next(((n, one) for n, one in enumerate(in_comments) if one), (0, None))
    if found is not None:
        why = "this line, which imports from rospy, is commented out: delete its `#`"
        yield from step_to("module", number + 1, text, with_line(lines, number, found[1]), why)
    else:
        why = f"{join_words(lost)} {'are' if lost[1:] else 'is'} not imported from rospy"
        after = _add_import(text, f"from rospy import {', '.join(lost)}", "", "")
        yield from step_to("module", named["init_node"], text, after, why)


def _imported_instead(tree: ast.Module, name: str, package: str, types: list[str]) -> str:
    """Return the lab's type that the script imports and never uses, where it uses another size of it: Int8 for Int16;
    "" where there is none."""
    of_lab = {kind.partition("/")[2] for kind in types if kind.startswith(f"{package}/")}
    froms = [n for n in nodes_in(tree) if isinstance(n, ast.ImportFrom) and n.module == f"{package}.msg"]
    imported = {a.name for n in froms for a in n.names if a.asname is None}
    used = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)}
    same = (one for one in sorted(imported & of_lab - used) if SIZE.sub("", one) == SIZE.sub("", name))
    return "" if name in of_lab else next(same, "")


def _with_class(text: str, name: str, meant: str) -> Iterator[Step]:
    """`Int8` in place of each `Int16`."""
    lines = text.split("\n")
    uses = [n for n in nodes_in(tree_of(text)) if isinstance(n, ast.Name) and n.id == name]
    spans = [span for n in uses if (span := span_of(lines, n))]
    if spans:
        after = edited(text, [(*span, meant) for span in spans])
        yield from step_to("name", min(spans)[0] + 1, text, after, name)


def _import_meant(text: str, name: str) -> str:
    """Return the text with `import rospy` in place of `import ros`, a module that there is none of and that nothing in
    the script uses; "" where no line imports such a one."""
    tree, lines = tree_of(text), text.split("\n")
    used = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)}
    for one in (n for n in tree.body if isinstance(n, ast.Import) and len(n.names) == 1):
        module = one.names[0].name
        begins_alike = "." not in name and module[:SLIP_CHARS] == name[:SLIP_CHARS]
        alike = begins_alike or module.lower() == name or is_one_edit(module, name)
        is_slip = alike and module not in OF_ROS and module.partition(".")[0] not in used
        if is_slip and one.names[0].asname is None and lines[one.lineno - 1].strip() == f"import {module}":
            return with_line(lines, one.lineno - 1, lines[one.lineno - 1].replace(module, name))
    return ""


def _add_import(text: str, statement: str, module: str, name: str) -> str:
    """The text with one more import: in the line that imports from this module, or below the last import."""
    body, lines = tree_of(text).body, text.split("\n")
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


def with_message_classes(text: str) -> Iterator[Step]:
    """`std_msgs.msg.Sting(…)`, `std_msgs.mgs.String(…)` and `std_msgs.String(…)`, for `std_msgs.msg.String(…)`."""
    for step in _with_modules_of_messages(text):
        text = step["text"]
        yield step
    names = set(MESSAGES["std_msgs"].split())
    for node in (n for n in nodes_in(tree_of(text)) if isinstance(n, ast.Attribute)):
        owner, member, span = ast.unparse(node.value), node.attr, span_of(text.split("\n"), node)
        meant = ""
        if owner == "std_msgs.msg" and member not in names | OTHERS_OF_STD:
            same = [one for one in names if one.lower() == member.lower()]
            near = same or [one for one in names if is_one_edit(one.lower(), member.lower())]
            meant = near[0] if len(near) == 1 else ""
        elif owner in MESSAGES and member not in ("msg", "srv") and is_one_edit(member.lower(), "msg"):
            meant = "msg"
        if meant and span is not None:
            line, _, end = span
            after = edited(text, [(line, end - len(member), end, meant)])
            for step in step_to("attribute", line + 1, text, after, f"{owner}.{member}"):
                yield step
                yield from with_message_classes(step["text"])
            return


def _with_modules_of_messages(text: str) -> Iterator[Step]:
    """`import std_msgs` of a script that takes classes from it, each without the `msg` before it."""
    tree, lines = tree_of(text), text.split("\n")
    parts = [n for n in nodes_in(tree) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    for package, names in MESSAGES.items():
        of_package = [n for n in parts if last_name(n.value) == package]
        classes = [n for n in of_package if n.attr in names.split()]
        imports = [n for n in nodes_in(tree) if isinstance(n, ast.Import)]
        places = [(n.lineno, a) for n in imports for a in n.names if (a.name, a.asname) == (package, None)]
        if not places or not classes or classes != of_package:
            continue
        line, whole = places[0]
        spans = [span_of(lines, n) for n in (whole, *(n.value for n in classes))]  # type: ignore[arg-type] # it has a place
        after = edited(text, [(*span, f"{package}.msg") for span in spans if span is not None])
        yield from step_to("module", line, text, after, NO_MESSAGES.format(package))
        return
