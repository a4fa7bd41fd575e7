"""Repairs of names that rospy lacks: its own in other letters, and those of ROS 2 and roscpp; and of a script that
never makes its node, or too late.

The text of a script that parses comes in, and the steps go out that repair it, as in `examine.py`. It runs in a
child process: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from difflib import get_close_matches

from grader.package.python_repairs.names import ROSPY, bound_in, rospy_in
from grader.package.python_repairs.syntax import (
    Step,
    edited,
    last_name,
    nodes_in,
    span_of,
    step_to,
    tree_of,
)
from grader.wording import is_one_edit

OTHER_CALLS = {
    **dict.fromkeys(("advertise", "create_publisher", "pub", "publish"), "Publisher"),
    **dict.fromkeys(("create_subscription", "create_subscriber", "sub", "subscribe", "listen"), "Subscriber"),
    **dict.fromkeys(("advertise_service", "create_service"), "Service"),
    **dict.fromkeys(("service_client", "create_client"), "ServiceProxy"),
    **dict.fromkeys(("create_timer",), "Timer"),
    **dict.fromkeys(("create_rate", "loop_rate"), "Rate"),
    **dict.fromkeys(("init", "node", "create_node"), "init_node"),
    **dict.fromkeys(("info", "log", "print", "log_info"), "loginfo"),
    **dict.fromkeys(("warn", "warning", "log_warning", "logwarning"), "logwarn"),
    **dict.fromkeys(("error", "log_error", "logerror"), "logerr"),
    **dict.fromkeys(("debug",), "logdebug"),
    **dict.fromkeys(("param",), "get_param"),
}
"""Calls of ROS 2 and roscpp, and such as students make up, in small letters with a `_` between their words."""
TYPE_FIRST = {
    "create_publisher": "rospy.Publisher({1}, {0}, queue_size={2})",
    "create_subscription": "rospy.Subscriber({1}, {0}, {2})",
    "create_service": "rospy.Service({1}, {0}, {2})",
    "create_client": "rospy.ServiceProxy({1}, {0})",
    "create_timer": "rospy.Timer(rospy.Duration({0}), {1})",
}
"""Calls of ROS 2 that take their arguments in another order: the call of rospy with them."""
LOGGER = "get_logger"
LEVELS = {
    "info": "loginfo",
    "warn": "logwarn",
    "warning": "logwarn",
    "error": "logerr",
    "debug": "logdebug",
    "fatal": "logfatal",
}
"""The methods of a logger of ROS 2."""
OTHER_MODULES = ("rclpy", "ros", "roscpp", "ros2", "rospy2")


def with_rospy(text: str) -> Iterator[Step]:
    """`import rospy` in place of `import rclpy`, in a script that takes all its calls from rospy."""
    tree, lines = tree_of(text), text.split("\n")
    for node in (n for n in tree.body if isinstance(n, ast.Import) and len(n.names) == 1):
        module, name = node.names[0].name, node.names[0].asname or node.names[0].name
        named = {n.id for n in nodes_in(tree) if isinstance(n, ast.Name)}
        uses = [n for n in nodes_in(tree) if isinstance(n, ast.Attribute) and last_name(n.value) == name]
        spans = [span for n in uses if (span := span_of(lines, n.value)) is not None]
        of_rospy = "init_node" in {n.attr for n in uses} and {n.attr for n in uses} <= ROSPY
        if module not in OTHER_MODULES or not of_rospy or len(spans) != len(uses):
            continue
        if name != "rospy" and ("rospy" in named or bound_in(tree) & {"rospy", "*"}):
            continue
        at = node.lineno - 1
        edits = [(line, start, end, "rospy") for line, start, end in spans]
        changed = edited(text, edits).split("\n")
        changed[at] = changed[at][: node.col_offset] + "import rospy"
        yield from step_to("other-module", node.lineno, text, "\n".join(changed), module)
        return


def with_attributes(text: str) -> Iterator[Step]:
    """`rospy.subscriber(…)` and `rospy.create_subscription(…)`, for `rospy.Subscriber(…)`; rospy may have another
    name in the script."""
    tree, lines = tree_of(text), text.split("\n")
    calls = {id(n.func): n for n in nodes_in(tree) if isinstance(n, ast.Call)}
    around = {id(n.value): n for n in nodes_in(tree) if isinstance(n, ast.Attribute)}
    alone = {id(n.value) for n in nodes_in(tree) if isinstance(n, ast.Expr)}
    imported = [a for n in nodes_in(tree) if isinstance(n, ast.Import) for a in n.names]
    rospy = next((a.asname for a in imported if a.name == "rospy" and a.asname), "rospy")
    if rospy in {n.id for n in nodes_in(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}:
        return
    for node in nodes_in(tree):
        is_lacking = (
            isinstance(node, ast.Attribute)
            and isinstance(node.ctx, ast.Load)  # a value may be given to it: `rospy.rate = 10`
            and isinstance(node.value, ast.Name)
            and node.value.id == rospy
            and node.attr not in ROSPY
            and not node.attr.startswith("_")
        )
        if not is_lacking or not isinstance(node, ast.Attribute):
            continue
        call = calls.get(id(node))
        edit = _of_call(lines, node.attr, call, alone=id(call) in alone) if call is not None else None
        edit = edit or _with_line(lines, node, around.get(id(node)))
        span = span_of(lines, node)
        meant = _near(node.attr, is_called=call is not None)
        if edit is None and meant and span is not None:
            line, _, end = span
            edit = (line, end - len(node.attr), end, meant)
        if edit is None:
            continue
        edit = (*edit[:3], edit[3].replace("rospy.", f"{rospy}."))
        for step in step_to("attribute", node.lineno, text, edited(text, [edit]), f"{rospy}.{node.attr}"):
            yield step
            yield from with_attributes(step["text"])
            return


def _with_line(
    lines: list[str], first: ast.Attribute, whole: ast.Attribute | None
) -> tuple[int, int, int, str] | None:
    """Return the edit of `rospy.init.node` to `rospy.init_node`; None of any other name."""
    span = span_of(lines, whole) if whole is not None else None
    if whole is None or span is None or f"{first.attr}_{whole.attr}" not in ROSPY:
        return None
    line, start, end = span
    begin = end - len(f"{first.attr}.{whole.attr}")
    is_plain = begin > start and lines[line][begin:end] == f"{first.attr}.{whole.attr}"
    return (line, begin, end, f"{first.attr}_{whole.attr}") if is_plain else None


def _is_logger(node: ast.expr, owners: set[str]) -> bool:
    """Return whether it is `self.get_logger()`."""
    called = node.func if isinstance(node, ast.Call) else None
    return isinstance(called, ast.Attribute) and called.attr == LOGGER and last_name(called.value) in owners


def with_logger(text: str) -> Iterator[Step]:
    """`rospy.loginfo(…)` in place of each `self.get_logger().info(…)` of ROS 2, in a script that has no such method."""
    tree, lines = tree_of(text), text.split("\n")
    imported = {a.asname or a.name for n in nodes_in(tree) if isinstance(n, ast.Import) for a in n.names}
    inherits = {
        last_name(base) for n in nodes_in(tree) if isinstance(n, ast.ClassDef) for base in n.bases
    } - {"object"}
    given = {
        last_name(target)
        for n in nodes_in(tree)
        if isinstance(n, ast.Assign) and isinstance(n.value, ast.Call)
        if ast.unparse(n.value.func) == "rospy.init_node"
        for target in n.targets
    }
    named = {n.attr for n in nodes_in(tree) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
    if "rospy" not in imported or inherits or LOGGER in bound_in(tree) | named:
        return
    edits, first = [], 0
    for node in (n for n in nodes_in(tree) if isinstance(n, ast.Call)):
        called = node.func
        if not isinstance(called, ast.Attribute) or not _is_logger(called.value, {"self", "rospy", *given}):
            continue
        level = LEVELS.get(called.attr, "")
        span = span_of(lines, node.func)
        if not level or span is None or node.keywords or len(node.args) != 1:
            return  # how often it is to log is not known
        edits.append((*span, f"rospy.{level}"))
        first = first or node.lineno
    if edits:
        yield from step_to("attribute", first, text, edited(text, edits), f"{LOGGER}() in rospy")


def _near(name: str, *, is_called: bool) -> str:
    """Return the name of rospy's that is written so in other letters; "" where there is none."""
    known = [one for one in sorted(ROSPY) if not (is_called and one.isupper())]
    plain = {_plain(one): one for one in known}
    near = get_close_matches(name, known, 1, 0.85) + [one for one in known if is_one_edit(name, one)]
    return plain.get(_plain(name)) or next(iter(near), "")


def _plain(name: str) -> str:
    return name.replace("_", "").lower()


def _of_call(
    lines: Sequence[str], name: str, call: ast.Call, *, alone: bool
) -> tuple[int, int, int, str] | None:
    """Return the edit that makes the call one of rospy's; None where it is not sure which is meant."""
    words = {_plain(one): new for one, new in OTHER_CALLS.items()}
    new = words.get(_plain(name), "")
    span, of_name = span_of(list(lines), call), span_of(list(lines), call.func)
    if span is None or of_name is None or _plain(name) in {_plain(one) for one in ROSPY if not one.isupper()}:
        return None
    if name == "ok" and not call.args and f"not {ast.unparse(call)}" not in lines[span[0]]:
        return (*span, "not rospy.is_shutdown()")
    first = call.args[0] if call.args else None
    is_text = isinstance(first, ast.Constant) and isinstance(first.value, str)
    template, given = TYPE_FIRST.get(name, ""), [ast.unparse(one) for one in call.args]
    values = given + [
        ast.unparse(one.value) for one in call.keywords if one.arg in ("qos_profile", "queue_size")
    ]
    if template and (not is_text or name == "create_timer"):
        wanted = template.count("{")
        return (*span, template.format(*values)) if len(values) >= wanted else None
    if not new or not call.args or (new == "init_node" and not (alone and is_text)):
        return None
    if new in ("Publisher", "Subscriber", "Service", "ServiceProxy") and (not is_text or len(given) < 2):
        return None  # `rospy.publish(msg)` is a method's
    return (of_name[0], of_name[2] - len(name), of_name[2], new)


def with_call_imported(text: str, name: str) -> tuple[str, str]:
    """Return how a script calls what rospy has under that name, and its text, which imports it: `rospy.spin`, `spin`;
    "" where it does not import anything of rospy on a line that ends with it."""
    tree, lines = tree_of(text), text.split("\n")
    rospy = rospy_in(tree, "")
    if rospy:
        return f"{rospy}.{name}", text
    for node in (n for n in tree.body if isinstance(n, ast.ImportFrom) and n.module == "rospy"):
        given = {a.name: a.asname or a.name for a in node.names}
        if name in given or "*" in given:
            return given.get(name, name), text
        line, _, end = span_of(lines, node) or (0, 0, 0)
        if end and not lines[line][:end].endswith(")") and name not in bound_in(tree):
            return name, edited(text, [(line, end, end, f", {name}")])
    return "", text


def with_init(text: str, name: str) -> Iterator[Step]:
    """A script that publishes or subscribes, and never makes its node: it gets the script's name."""
    tree, lines = tree_of(text), text.split("\n")
    makes = {"Publisher", "Subscriber"}
    calls = [n.func for n in nodes_in(tree) if isinstance(n, ast.Call)]
    made = {ast.unparse(one) for one in calls if last_name(one) in makes}
    written, text_now = with_call_imported(text, "init_node")
    owner = written.removesuffix("init_node")
    # a module that others import makes no node
    makes |= {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    runs = [
        s
        for s in runs_of(tree)
        if any(isinstance(n, ast.Call) and last_name(n.func) in makes for n in nodes_in(s))
    ]
    is_asked = bool(written) and not made.isdisjoint({owner + one for one in ("Publisher", "Subscriber")})
    if "init_node" in text or not runs or not is_asked or not name.isidentifier():
        return
    first: ast.stmt = runs[0]
    while isinstance(first, ast.If | ast.Try):
        first = first.body[0]
    called = (
        ast.unparse(first.value.func)
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Call)
        else ""
    )
    own = [n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == called]
    first = next((one for function in own for one in function.body if not _is_head(one)), first)
    at, line = first.lineno - 1, f"{written}('{name}')"
    lines = text_now.split("\n")
    before = lines[at][: first.col_offset]
    if not before.strip():
        after = "\n".join([*lines[:at], before + line, *lines[at:]])
        yield from step_to("init", at + 1, text, after, line)


def with_named_node(text: str, name: str) -> Iterator[Step]:
    """`init_node(sys.argv[1])`: the node gets the script's name, as nothing gives it one."""
    tree, lines = tree_of(text), text.split("\n")
    for call in (n for n in nodes_in(tree) if isinstance(n, ast.Call) and n.args and name.isidentifier()):
        given = call.args[0]
        of_argv = isinstance(given, ast.Subscript) and last_name(given.value) == "argv"
        span = span_of(lines, given) if of_argv and last_name(call.func) == "init_node" else None
        if span is not None:
            why = "the node's name is read from the command line, and nothing gives one there"
            yield from step_to("argument", span[0] + 1, text, edited(text, [(*span, repr(name))]), why)
            return


NEED_NODE = ("Rate", "sleep", "get_time", "get_rostime", "Time.now", "wait_for_message")
"""What fails in rospy before the node is made."""


def with_times(text: str) -> Iterator[Step]:
    """`stamp = rospy.Time.now()` for `stamp = rospy.get_time()`, and `lifetime = rospy.Duration(5)` for `lifetime = 5`:
    a message's time is no number of seconds."""
    tree, lines = tree_of(text), text.split("\n")
    rospy = rospy_in(tree)
    found = [
        (target, node.value)
        for node in nodes_in(tree)
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Attribute) and last_name(target.value) != "self"
    ]
    edits, words = [], dict[str, int]()
    for target, value in found if rospy else ():
        right, span = _right_time(target.attr, value, rospy), span_of(lines, value)
        if right and span is not None:
            edits.append((*span, right.format(lines[span[0]][slice(*span[1:])])))
            words.setdefault(ast.unparse(target), target.lineno)
    if edits:
        yield from step_to("time", min(words.values()), text, edited(text, edits), ", ".join(words))


def _right_time(field: str, value: ast.expr, rospy: str) -> str:
    """Return what is to be written in place of a number that is given to a time; "" where it is none."""
    called = ast.unparse(value.func).rpartition(".")[2] if isinstance(value, ast.Call) else ""
    if field == "stamp" and called in {"get_time", "time", "to_sec", "to_nsec", "time_ns"}:
        return f"{rospy}.Time.now()"
    number = value.value if isinstance(value, ast.Constant) else None
    is_number = isinstance(number, int | float) and not isinstance(number, bool)
    return f"{rospy}.Duration({{}})" if field in DURATIONS and is_number else ""


DURATIONS = ("lifetime", "time_from_start", "time_to_live")
"""Fields of ROS's messages that are durations."""


def with_node_first(text: str) -> Iterator[Step]:
    """A script that makes its node below a line of the same block that needs it: `init_node` moves up."""
    tree, lines = tree_of(text), text.split("\n")
    needing = {f"{rospy_in(tree)}.{name}" for name in NEED_NODE}
    blocks = (
        getattr(node, part, None) for node in nodes_in(tree) for part in ("body", "orelse", "finalbody")
    )
    for block in (one for one in blocks if isinstance(one, list)):
        calls = [one.value if isinstance(one, ast.Expr) else None for one in block]
        place = next(
            (i for i, one in enumerate(calls) if last_name(getattr(one, "func", None)) == "init_node"), 0
        )
        early = [
            i
            for i, one in enumerate(block[:place])
            if not needing.isdisjoint(_called_now(one)) or _reads_private(one)
        ]
        if not early:
            continue
        first, init, end = block[early[0]], block[place], block[place].end_lineno or 0
        between = {name for one in block[early[0] : place] for name in bound_in(one)}
        alone = not lines[init.lineno - 1][: init.col_offset].strip() and lines[end - 1].rstrip().endswith(
            ")"
        )
        if alone and between.isdisjoint(n.id for n in nodes_in(init) if isinstance(n, ast.Name)):
            at, moved = first.lineno - 1, lines[init.lineno - 1 : end]
            after = [*lines[:at], *moved, *lines[at : init.lineno - 1], *lines[end:]]
            yield from step_to("late", first.lineno, text, "\n".join(after), str(init.lineno))
            return


def _called_now(statement: ast.stmt) -> set[str]:
    """Return what a statement calls, a definition nothing."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return set()
    return {ast.unparse(n.func) for n in nodes_in(statement) if isinstance(n, ast.Call)}


def _reads_private(statement: ast.stmt) -> bool:
    """Return whether a statement asks for a parameter of the node's own, as `~rate`, whose name the node's begins."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return False
    calls = (n for n in nodes_in(statement) if isinstance(n, ast.Call) and n.args)
    asked = (n.args[0] for n in calls if last_name(n.func) in {"get_param", "has_param", "set_param"})
    return any(isinstance(one, ast.Constant) and str(one.value).startswith("~") for one in asked)


def _is_head(statement: ast.stmt) -> bool:
    """Return whether it is a docstring or a `global`, which come first."""
    constant = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return constant or isinstance(statement, ast.Global)


def runs_of(tree: ast.Module) -> Iterator[ast.stmt]:
    """Yield the statements of a script that do more than to define or import names."""
    plain = ast.FunctionDef | ast.ClassDef | ast.Import | ast.ImportFrom
    return (one for one in tree.body if not isinstance(one, plain))
